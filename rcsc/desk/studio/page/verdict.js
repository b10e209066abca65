// What is proved of the system, in a line above the views; opened, all that is not proved, each with the way to it.

import { make, spoken } from "./make.js";
import { deskOf } from "./tables/desk.js";

const NOT = { refuted: ["wrong", "refuted"], open: ["warn", "open"], conditional: ["warn", "conditional"], unknown: ["soft", "not asked"] }; // as the bar tells them, in this order
const TIMED = { any: "Proved for every run, under any timing", late: "Proved as scheduled, and with buffers as late as the system allows", scheduled: "Proved as scheduled, for no other timing" };

export function verdicts(bus, place, show) {
  const desk = deskOf(bus);
  const line = make("summary", {}), list = make("ul", {});
  const every = make("details", {}, line, list);
  place.append(every);
  every.addEventListener("keydown", (event) => { if (event.key === "Escape") { every.open = false; line.focus(); } });
  document.addEventListener("pointerdown", ({ target }) => { if (!every.contains(target)) every.open = false; });
  let required = [], asking = false, known = "";

  async function ask(build) {
    if (!build.ok || build.doing || asking) return;
    asking = true;
    required = await bus.ask("required.list").catch(() => []);
    asking = false;
    draw();
  }

  function draw() {
    const build = bus.latest("build.state") ?? {};
    place.hidden = !build.doing && typeof build.ok !== "boolean";
    const said = build.doing ? [["soft", `… ${build.doing}`]] : [tablesSaid(build), ...(build.ok ? requiredSaid(required) : [])];
    const now = JSON.stringify([said, build.findings?.length, required]);
    if (now === known) return; // what is pressed stays under the hand
    known = now;
    line.replaceChildren(...said.flatMap(([kind, text]) => [make("span", { class: kind }, text), " "]));
    list.replaceChildren(...(build.doing ? [make("li", { class: "soft" }, "What was proved before is told once this is done.")] : items(build)));
  }

  // --- what is listed ---

  const go = (act) => () => { every.open = false; act(); };
  const item = (kind, what, ...buttons) => make("li", {}, make("strong", { class: kind }, { wrong: "✗ ", warn: "◑ ", good: "✓ ", soft: "… " }[kind]), ...what, " ", ...buttons.filter(Boolean).map(([text, act]) => make("button", { type: "button", class: "small", onclick: go(act) }, text)));

  function items(build) {
    const errors = (build.findings ?? []).filter(({ severity }) => severity === "error");
    const prove = ["Prove the levels together", () => show("run").then(() => { bus.tell("drawer", "found"); bus.tell("prove"); })];
    return [
      ...errors.slice(0, 50).map((one) => item("wrong", [...spoken(one.message), make("span", { class: "soft" }, ` ${where(one)}`)], ["Go to it", () => seek(one)])),
      ...required.filter(({ state }) => state === "refuted").map((one) => item("wrong", named(one, "is refuted: a run breaks it"), one.log ? ["Show its run", () => run(one)] : prove)),
      ...required.filter(({ state }) => state === "open").map((one) => item("warn", named(one, "is open: neither proved nor refuted"), ["Read why", () => show("run").then(() => bus.tell("drawer", "required"))])),
      ...required.filter(({ state }) => state === "conditional").map((one) => item("warn", named(one, `is conditional: ${one.words}`))),
      ...together(required.filter(({ state }) => state === "unknown"), (some) => item("soft", ["Nobody has asked yet whether ", ...names(some), ` ${some.length === 1 ? "holds" : "hold"} over time`], prove)),
      ...Object.entries(TIMED).flatMap(([timing, text]) => together(required.filter((one) => one.state === "proved" && one.timing === timing), (some) => item("good", [`${text}: `, ...names(some)], ["Read how", () => show("run").then(() => bus.tell("drawer", "required"))]))),
      ...together(required.filter(({ state }) => state === "assumed"), (some) => item("warn", ["Taken for granted of what stands outside: ", ...names(some)])),
      ...(build.tables ?? []).filter(({ assumptions }) => assumptions.length).map(({ table, assumptions }) => item("warn", ["Table ", make("code", {}, table), " takes for granted: ", ...listed(assumptions.map(({ name, standing }) => [make("code", {}, name), standing === "monitored" ? ", which runs watch" : ""]))])),
    ];
  }

  const together = (some, make_) => (some.length ? [make_(some)] : []);
  const listed = (each) => each.flatMap((one, at) => [at ? ", " : "", ...one]);
  const names = (some) => listed(some.slice(0, 12).map(({ name }) => [make("code", {}, name)])).concat(some.length > 12 ? ` and ${some.length - 12} more` : "");
  const named = ({ name, word, level }, text) => [`${word[0].toUpperCase()}${word.slice(1)} `, make("code", {}, name), level ? ` of ${level}` : "", ` ${text}`];
  const where = ({ primary: { place: { file, start } } }) => `${file.split("/").at(-1)}:${start.line}`;

  async function run(one) {
    if (!await bus.try("log.open", { name: one.log })) return;
    bus.say(`the run that breaks \`${one.name}\` is shown, at the tick in which it does`);
  }

  /** Go to a finding at its table. */
  async function seek({ code, message, primary: { place: { file } } }) {
    const found = desk.files.find((each) => file === each.file || file.endsWith(`/${each.file}`) || each.file.endsWith(`/${file}`));
    await show("tables");
    if (found) desk.seek(found.file, code, message);
  }

  bus.on("build.state", (build) => { draw(); ask(build); });
}

function tablesSaid({ ok, tables = [], findings = [] }) {
  const wrong = findings.filter(({ severity }) => severity === "error").length;
  if (!ok) return ["wrong", `✗ not proved: ${wrong} ${wrong === 1 ? "finding" : "findings"}`];
  const rest = tables.filter(({ assumptions }) => assumptions.length).length;
  return ["good", `✓ ${tables.length} ${tables.length === 1 ? "table" : "tables"} proved: whatever comes in, exactly one line matches${rest ? `; ${rest} trusting assumptions` : ""}`];
}

function requiredSaid(required) {
  const count = (word) => required.filter(({ state }) => state === word).length;
  const proved = count("proved"), assumed = count("assumed");
  const rest = Object.entries(NOT).map(([state, [kind, word]]) => [kind, word, count(state)]).filter(([, , many]) => many);
  const of = (many) => (many === 1 ? "requirement" : "requirements");
  return [...(proved ? [["good", `· ✓ ${proved} ${of(proved)} proved`]] : []),
    ...rest.map(([kind, word, many], at) => [kind, `· ${kind === "wrong" ? "✗ " : ""}${many} ${proved || at ? "" : `${of(many)} `}${word}`]),
    ...(assumed ? [["soft", `· trusting ${assumed} ${assumed === 1 ? "assumption" : "assumptions"} about what stands outside`]] : [])];
}
