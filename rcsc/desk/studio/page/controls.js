// What is done to the run, wherever one looks: run and pause, step, undo, how fast, and until when.

import { doLine } from "./bus.js";
import { make, spoken } from "./make.js";

const RATES = [["4 times the clock", "4"], ["real time", "1"], ["20 times", "20"], ["as fast as it goes", ""], ["a quarter", "0.25"], ["a tenth", "0.1"]];

/** Tell a condition and a line of the system that runs, as examples of what may be typed. */
export function exampled(bus, tell) {
  bus.on("moment", ({ levels }) => {
    const of = levels.find(({ states, table }) => states.length && table);
    const line = of && bus.latest("run").levels.find(({ name }) => name === of.level)?.tables[of.table]?.[0];
    const { name, now } = of?.states.at(-1) ?? {};
    if (line) tell(`${of.level}.${name} = ${now}`, `${of.level}.${of.table}.${line}`);
  });
}

/** The buttons of a run, as a bar, and their keys. */
export function controls(bus) {
  const type = (line) => doLine(bus, line).then((answer) => { if (answer) bus.tell("typed", { line, shown: answer.shown }); return answer; });
  const runs = () => bus.try(bus.latest("run.state")?.going ? "run.pause" : "run.go"), steps = () => type("step");
  const go = make("button", { type: "button", class: "go", onclick: () => once(runs, "Run") }, "Run ", make("kbd", {}, "space"));
  const step = make("button", { type: "button", onclick: () => once(steps, "Step") }, "Step ", make("kbd", {}, "s"));
  const undo = make("button", { type: "button", onclick: () => type("undo") }, "Undo ", make("kbd", {}, "u"));
  const rate = make("select", { "aria-label": "How fast", onchange: () => bus.try("run.rate", { rate: rate.value ? Number(rate.value) : null }) },
    RATES.map(([text, value]) => make("option", { value }, text)));
  const until = make("input", { "aria-label": "Run until a condition holds", placeholder: "run until …", spellcheck: "false", list: "run-words" });
  const back = make("button", { type: "button", class: "back", hidden: true, onclick: () => bus.select({ tick: bus.latest("run").last, follow: true }) }, "Back to now");
  const live = make("button", { type: "button", hidden: true, onclick: () => bus.try("time.live") }, "Back to the live run");
  exampled(bus, (text) => { until.title = `A condition, as ${text}`; });
  const said = make("span", { class: "grow soft ended", role: "status" });
  let waits = null; // what was pressed while the tables were proved
  const comes = () => { const { doing, ok } = bus.latest("build.state") ?? {}; return !bus.latest("run.state")?.open && Boolean(doing) && ok !== false; };
  function once(act, word) {
    if (!comes()) return act();
    waits = waits === act ? null : act;
    return bus.say(waits ? `${word}: as soon as the tables are proved; press again to give it up` : `${word}: given up`);
  }
  function waited() {
    const open = bus.latest("run.state")?.open, act = waits;
    for (const one of [go, step]) one.disabled = !(open || comes()) || bus.latest("run")?.source === "log";
    if (open || bus.latest("build.state")?.ok === false) waits = null;
    if (open) act?.();
  }
  bus.on("build.state", waited);
  bus.on("run.state", waited);
  const past = () => {
    const run = bus.latest("run");
    back.hidden = !run?.open || run.source === "log" || bus.selection.tick === run.last;
  };
  bus.on("run", (run) => {
    const of = bus.latest("run.state");
    const log = run.source === "log";
    go.replaceChildren(of.going ? "Pause " : "Run ", make("kbd", {}, "space"));
    go.setAttribute("aria-pressed", Boolean(of.going));
    for (const one of [until, rate]) one.disabled = !of.open || log;
    waited();
    undo.disabled = !of.open || log || !of.undo;
    if (document.activeElement !== rate) {
      const value = of.rate ? String(of.rate) : "";
      if (![...rate.options].some((one) => one.value === value)) rate.append(make("option", { value }, `${value} times`));
      rate.value = value;
    }
    live.hidden = !log;
    said.replaceChildren(...(log ? [...spoken(run.finding ? `finding: ${run.finding.text}; ` : ""), `log ${run.name}${run.other ? `, of system ${run.other}, which is not the one that is open here` : ""}, ${run.text}`] : [of.ended ?? ""]));
    said.title = said.textContent;
    past();
  });
  bus.on("selection", past);
  bus.key("space", "Run, or pause", () => go.click(), "Run");
  bus.key("s", "One cycle of all levels", () => step.click(), "Run");
  bus.key("u", "Undo the last cycle, or what was set", () => undo.click(), "Run");
  bus.key("r", "Run until a condition holds: type it", () => until.focus(), "Run");
  return make("div", { class: "bar controls" }, go, step, undo, rate,
    make("form", { class: "until", onsubmit: (event) => { event.preventDefault(); if (until.value.trim()) type(`run until ${until.value.trim()}`); } }, until),
    back, live, said);
}
