// What a level ran in a tick: for the studio, and for files that show a run.

import { doLine } from "./bus.js";
import { make } from "./make.js";

/** What went wrong in a cycle. */
export function faults(text, wrong) {
  return [text, wrong].filter(Boolean).map((one) => make("p", { class: "wrong" }, make("strong", {}, "✗ "), one));
}

/** Every line of each table that ran: the one that ran is lit, and says so. */
export function linesOf(bus, level, lines, cycled) {
  const by = new Map();
  for (const [table, line] of lines) by.set(table, [...(by.get(table) ?? []), line].filter(Boolean));
  return [...by].map(([table, ran]) => make("div", { class: "tried" },
    make("div", { class: "name" }, make("span", { class: "soft" }, "table "), table, make("span", { class: "soft" }, ran.length ? ", line " : cycled ? ": no line ran" : ": no cycle yet"), make("strong", {}, ran.join(" and "))),
    make("div", { class: "chips", role: "group", "aria-label": `Lines of ${table}` }, (level.tables[table] ?? []).map((line) => {
      const lit = ran.includes(line);
      const chosen = bus.selection.level === level.name && bus.selection.table === table && bus.selection.line === line;
      return make("button", { type: "button", class: `chip${lit ? " lit" : ""}`, "aria-current": lit ? "true" : undefined, "aria-pressed": String(chosen),
        title: lit ? `line ${line} ran` : `line ${line} did not match: press to see ${bus.answers("time.why") ? "why" : "when it did"}`,
        onclick: () => bus.select(chosen ? { line: "" } : { level: level.name, table, line }) }, lit ? `▶ ${line}` : line);
    })),
    bus.selection.level === level.name && bus.selection.table === table && bus.selection.line ? lineButtons(bus, level.name, table, bus.selection.line) : null));
}

function lineButtons(bus, level, table, line) {
  const place = `${level}.${table}.${line}`;
  const live = bus.latest("run").source === "live", shell = bus.answers("run.type");
  const type = (text) => doLine(bus, text).then((answer) => answer && bus.say(answer.shown.join("\n")));
  return make("div", { class: "bar small" }, make("span", { class: "soft" }, `line ${line}: `),
    shell && make("button", { type: "button", disabled: !live, onclick: () => type(`break ${place}`) }, "Break here"),
    shell && make("button", { type: "button", disabled: !live, onclick: () => type(`run to ${place}`) }, "Run to here"),
    make("button", { type: "button", onclick: () => bus.tell("to-line", { level, table, line, back: true }) }, "Ran before"),
    make("button", { type: "button", onclick: () => bus.tell("to-line", { level, table, line, back: false }) }, "Ran next"));
}
