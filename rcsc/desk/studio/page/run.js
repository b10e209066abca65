// The levels: every one beside the others, what is done to it, and why a line did not match.

import { doLine, typeLine } from "./bus.js";
import { exampled } from "./controls.js";
import { changes, exchanges, short } from "./exchanges.js";
import { faults, linesOf } from "./level.js";
import { make, spoken } from "./make.js";
import { lookAt } from "./moments.js";

export function mount(root, bus) {
  const cards = make("div", { class: "cards scroll", role: "list", "aria-label": "Levels" });
  const drawer = Drawer(bus);
  root.append(cards, drawer.root);
  bus.on("drawer", (tab) => drawer.show(tab, true));
  bus.on("typed", ({ line, shown }) => drawer.said(line, shown));
  const known = new Map(); // by level: its card
  let levels = "";

  function draw() {
    const run = bus.latest("run"), moment = bus.latest("moment");
    if (!run?.open) {
      levels = "";
      known.clear();
      cards.replaceChildren(closed(bus));
      return;
    }
    const now = JSON.stringify(run.levels.map(({ name, tables }) => [name, tables]));
    if (now !== levels) {
      levels = now;
      known.clear();
      for (const level of run.levels) known.set(level.name, Card(bus, level));
      cards.replaceChildren(...[...known.values()].map(({ root: card }) => card));
    }
    const head = run.source === "live" && bus.selection.tick === run.last;
    root.dataset.tick = moment?.tick ?? "";
    for (const level of moment?.levels ?? []) {
      known.get(level.level)?.show(level, moment.tick, run, head ? run.levels.find(({ name }) => name === level.level) : null);
    }
  }
  let due = false;
  const soon = () => { if (!due) { due = true; requestAnimationFrame(() => { due = false; draw(); }); } };
  bus.on("run", soon);
  bus.on("moment", soon);
  bus.on("build.state", soon);
  bus.on("selection", (_, changed) => { if (!changed || [...changed].some((one) => one !== "tick")) soon(); }); // of another tick the moment comes
}

function closed(bus) {
  const build = bus.latest("build.state"), state = bus.latest("run.state");
  if (!build || !state) return make("div", { class: "closed soft" }, "Connecting …");
  const findings = (build.findings ?? []).filter(({ severity }) => severity === "error");
  return make("div", { class: "closed" },
    build.asks && !build.doing ? asking(bus, build.asks) : null,
    make("h2", {}, build.doing ? `${build.doing[0].toUpperCase()}${build.doing.slice(1)}` : "No system runs"),
    build.doing ? null : make("p", { class: "pre" }, ...spoken(state.why ?? "")),
    ...findings.slice(0, 20).map(finding),
    findings.length > 20 ? make("p", { class: "soft" }, `and ${findings.length - 20} more`) : null,
    build.doing || build.asks ? null : make("button", { type: "button", onclick: () => bus.try("build.open") }, "Prove, compile and open again"));
}

// Asked once a folder, before any of its code runs.
function asking(bus, folder) {
  return make("section", { class: "asking" },
    make("h2", {}, "May the code of this folder run?"),
    make("p", {}, make("code", {}, folder)),
    make("p", {}, "To run its levels starts its plant, its extern procedures and the executors that are generated of its tables, as yours. Agree where you trust who wrote them. Tables, proofs and graphs need none of it."),
    make("button", { type: "button", onclick: () => bus.try("build.trust") }, "Agree, and run it"));
}

// What a check found: where, the least input that shows it, and what would mend it.
function finding({ code, message, primary, witnesses, help }) {
  const { file, start } = primary.place;
  return make("section", { class: "finding" },
    make("p", {}, make("strong", { class: "wrong" }, `${code}: `), ...spoken(message), make("span", { class: "soft", title: file }, ` at ${file.split("/").slice(-2).join("/")}:${start.line}:${start.column}`)),
    ...witnesses.slice(0, 3).map((witness) => make("p", {}, make("span", { class: "soft" }, "for instance "), make("code", {}, witness.input.map(({ variable, value }) => `${variable} = ${value}`).join(", ")),
      witness.lines.length ? `: lines ${witness.lines.map(({ name }) => name).join(" and ")} match` : "",
      witness.region.length ? make("span", { class: "soft" }, "; all of ", make("code", {}, witness.region.join(", "))) : "")),
    ...help.map((text) => make("p", {}, make("span", { class: "soft" }, "help: "), ...spoken(text))));
}

// --- one level ---

function Card(bus, level) {
  const type = (line) => doLine(bus, line);
  const title = make("h3", {}, level.name);
  const ran = make("span", { class: "soft" });
  const body = make("div", { class: "said" });
  const tables = make("div");
  const reasons = make("div", { class: "why" });
  const asks = make("button", { type: "button", "aria-expanded": "false", title: "Why each other line did not match" }, "Why not");
  const cycle = make("button", { type: "button", title: "One cycle of this level alone, on its buffers as they are", onclick: () => type(`step ${level.name}`) }, "Cycle alone");
  const more = make("select", { "aria-label": `More for ${level.name}`, onchange: () => {
    const line = more.value;
    more.value = "";
    if (line) type(line).then((answer) => answer && bus.say(answer.shown.join("\n")));
  } }, make("option", { value: "" }, "More…"),
  ...[["Preprocess alone", `${level.name}.preprocess`], ["State table alone", `${level.name}.state_table`], ["Postprocess alone", `${level.name}.postprocess`],
    ["Start again, from its last cycle", `restart ${level.name}`], ["Start again, anew", `restart ${level.name} anew`],
    ["What the edited tables do otherwise", `diff ${level.name}`], ["Take the edited tables, if they prove", `reload ${level.name}`],
    ["Take them although the next cycle does otherwise", `reload ${level.name} anyway`],
  ].map(([text, line]) => make("option", { value: line }, text)));
  const root = make("article", { class: "card", role: "listitem", "aria-label": `Level ${level.name}` },
    make("header", {}, title, ran, make("span", { class: "buttons" }, asks, cycle, more)), tables, reasons, body);
  root.addEventListener("focusin", choose);
  root.addEventListener("pointerdown", choose);
  function choose() { if (bus.selection.level !== level.name) bus.select({ level: level.name }); }

  let open = false, asked = "", held = [];
  asks.addEventListener("click", () => { open = !open; asks.setAttribute("aria-expanded", open); asks.setAttribute("aria-pressed", open); asked = ""; why(); });
  let last = {};
  async function why() {
    const run = bus.latest("run"), tick = bus.selection.tick;
    const key = `${run.key} ${tick}`;
    const line = bus.selection.level === level.name ? bus.selection.line : "";
    if (!open && !line) { reasons.replaceChildren(); asked = ""; held = []; return; }
    if (asked !== key) {
      asked = key;
      try { held = (await bus.ask("time.why", { tick, level: level.name })).tables; } catch (error) { held = []; reasons.replaceChildren(make("p", { class: "soft" }, error.message)); return; }
      if (asked !== key) return;
    }
    const of = held.filter(({ table }) => open || table === bus.selection.table);
    reasons.replaceChildren(...of.map((table) => reasonTable(table, open ? null : line)));
  }

  function show(box, tick, run, now) {
    last = { box, tick, run };
    const live = run.source === "live";
    for (const part of [cycle, more]) part.disabled = !live;
    title.textContent = level.name;
    root.classList.toggle("chosen", bus.selection.level === level.name);
    ran.textContent = `every ${level.period_ms} ms${box.ran ? "" : "; no cycle in this tick"}`;
    const alone = now?.now.every(([, line]) => line); // what was set by hand may choose another table, of which no line ran
    const lines = alone ? now.now : [...box.before, ...(box.lines.length ? box.lines : [""]).map((line) => [box.table, line])];
    tables.replaceChildren(...linesOf(bus, level, lines, box.ran), ...faults(now ? now.fault : box.fault, box.wrong));
    body.replaceChildren(...(now ? lost(bus.latest("run.state").buffers ?? [], level.name) : []), ...exchanges(box), ...changes(box));
    why();
  }
  return { root, show, last: () => last };
}

/** Buffers of a level that were broken by hand: its neighbour hears nothing, or it does not. */
function lost(buffers, level) {
  const own = (name) => name.startsWith(`${level}.`);
  return buffers.filter(({ name, to, frozen }) => frozen && (own(name) || to.split(", ").some(own)))
    .map(({ name, to }) => make("p", { class: "wrong" }, make("strong", {}, "✗ "), make("code", {}, name), " → ", make("code", {}, to), " is broken: ", own(name) ? "what is written to it is lost" : "nothing new comes from it"));
}

function reasonTable(table, only) {
  const lines = table.lines.filter(({ line }) => !only || line === only);
  if (!lines.length) return make("p", { class: "soft" }, only && only === table.default ? `line ${only} runs where no other matches` : "");
  return make("table", { class: "reasons" }, make("tbody", {}, lines.map((one) => make("tr", { class: one.matches ? "lit" : "" },
    make("th", { scope: "row" }, one.line),
    one.matches ? make("td", {}, "matched") : make("td", {}, make("strong", { class: "code" }, one.values.map(([name, value]) => `${name} = ${short(value)}`).join(", ")),
      ", the cell asks ", one.heading && one.heading !== "when" && one.heading !== one.values[0]?.[0] ? `${one.heading}: ` : "", make("code", {}, one.cell),
      one.failing > 1 ? make("span", { class: "soft" }, `; ${one.failing - 1} more cell${one.failing > 2 ? "s do" : " does"} not hold`) : "")))));
}

// --- the drawer ---

function Drawer(bus) {
  const tabs = [["console", "Console", consoleTab], ["values", "Variables", valuesTab], ["breaks", "Breaks and faults", breaksTab], ["script", "Orders", scriptTab], ["required", "Requirements", requiredTab], ["found", "Proof and logs", foundTab]];
  const bar = make("div", { class: "bar tabs", role: "tablist" });
  const inside = make("div", { class: "inside" });
  const made = new Map();
  let shown = "";
  const hide = make("button", { type: "button", class: "plain", "aria-expanded": "true", onclick: () => { const now = !inside.hidden; inside.hidden = now; hide.setAttribute("aria-expanded", !now); hide.textContent = now ? "Show" : "Hide"; } }, "Hide");
  for (const [name, title] of tabs) {
    bar.append(make("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-selected": "false", tabindex: "-1", onclick: () => show(name) }, title));
  }
  bar.append(make("span", { class: "grow" }), hide);
  bar.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || event.target.role !== "tab") return;
    event.preventDefault();
    const at = tabs.findIndex(([name]) => name === shown);
    show(tabs[(at + step + tabs.length) % tabs.length][0]);
    bar.querySelector(`#tab-${shown}`).focus();
  });
  function show(name, focus = false) {
    shown = name;
    inside.hidden = false;
    for (const tab of bar.querySelectorAll("[role=tab]")) {
      const selected = tab.id === `tab-${name}`;
      tab.setAttribute("aria-selected", selected);
      tab.tabIndex = selected ? 0 : -1;
    }
    if (!made.has(name)) made.set(name, tabs.find(([one]) => one === name)[2](bus));
    const { root, focus: into } = made.get(name);
    root.setAttribute("role", "tabpanel");
    root.setAttribute("aria-labelledby", `tab-${name}`);
    inside.replaceChildren(root);
    made.get(name).shown?.();
    if (focus) into?.();
  }
  show("console");
  return { root: make("section", { class: "drawer", "aria-label": "What is done and seen" }, bar, inside), show,
    said: (line, text) => made.get("console").said(line, text) };
}

function consoleTab(bus) {
  const text = make("div", { class: "scroll transcript code", role: "log", tabindex: "0", "aria-label": "What was typed, and the answers" });
  const words = make("datalist", { id: "run-words" });
  const line = make("input", { class: "code grow", "aria-label": "A command of the shell", placeholder: "a command of the shell: help lists them", spellcheck: "false", autocomplete: "off", list: "run-words" });
  const past = [];
  let at = 0;
  function said(typed, shown, wrong = false) {
    text.append(make("p", { class: "soft" }, `> ${typed}`), ...shown.map((one) => make("p", { class: wrong ? "wrong" : "" }, one)));
    while (text.childElementCount > 800) text.firstChild.remove();
    text.scrollTop = text.scrollHeight;
  }
  const form = make("form", { class: "bar", onsubmit: async (event) => {
    event.preventDefault();
    const typed = line.value.trim();
    if (!typed) return;
    past.push(typed);
    at = past.length;
    line.value = "";
    if (typed === "clear") return text.replaceChildren();
    try { said(typed, (await typeLine(bus, typed)).shown); }
    catch (error) { said(typed, [error.message, ...(error.helps ?? []).map((help) => `help: ${help}`)], true); }
    return undefined;
  } }, line, make("button", {}, "Do"));
  line.addEventListener("keydown", (event) => {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!step || (words.childElementCount && event.altKey)) return;
    event.preventDefault();
    at = Math.max(0, Math.min(past.length, at + step));
    line.value = past[at] ?? "";
  });
  let waiting = 0;
  const complete = (input) => input.addEventListener("input", () => {
    clearTimeout(waiting);
    const part = input.value.split(/[\s()]+/).at(-1);
    if (part.length < 2) return;
    waiting = setTimeout(async () => {
      const found = await bus.ask("run.words", { part }).catch(() => []);
      const head = input.value.slice(0, input.value.length - part.length);
      words.replaceChildren(...found.map((word) => make("option", { value: head + word })));
    }, 150);
  });
  complete(line);
  bus.on("run", () => { line.disabled = !bus.latest("run.state").open; });
  return { root: make("div", { class: "column" }, text, form, words), said, focus: () => line.focus() };
}

function valuesTab(bus) {
  const filter = make("input", { "aria-label": "Filter variables", placeholder: "filter", spellcheck: "false" });
  const changed = make("input", { type: "checkbox", id: "only-changed" });
  const rows = make("tbody");
  const head = make("strong", {}, "");
  let asking = false, again = false, values = [], editing = null;
  const chosen = () => bus.selection.level || bus.latest("run")?.levels?.[0]?.name;
  async function ask() {
    const run = bus.latest("run"), { tick } = bus.selection;
    const level = chosen();
    if (!run?.open || tick === null || !root.isConnected) return;
    if (asking) { again = true; return; }
    asking = true;
    try { values = await bus.ask("time.values", { tick, level }); head.textContent = level; } catch { values = []; }
    asking = false;
    draw(level);
    if (again) { again = false; ask(); }
  }
  function draw(level) {
    if (editing?.isConnected && document.activeElement === editing) return;
    const run = bus.latest("run");
    if (!run?.open) return;
    const settable = run.source === "live" && bus.selection.tick === run.last;
    const part = filter.value.toLowerCase();
    const shown = values.filter(({ name, changed: is }) => name.toLowerCase().includes(part) && (!changed.checked || is));
    rows.replaceChildren(...shown.slice(0, 400).map((one) => {
      const value = one.members.length || one.type === "bool"
        ? make("select", { "aria-label": one.name, disabled: !settable }, (one.members.length ? one.members : ["false", "true"]).map((word) => make("option", { selected: word === one.text }, word)))
        : make("input", { "aria-label": one.name, value: one.text, size: "12", disabled: !settable, spellcheck: "false" });
      value.addEventListener("focus", () => { editing = value; });
      const set = () => { editing = null; bus.try("run.type", { line: `${level}-level.${one.name} = ${value.value}` }).then((answer) => { if (!answer) ask(); }); };
      value.addEventListener("change", set);
      const dragged = (event) => event.dataTransfer.setData("text/plain", `${level}.${one.name}`);
      return make("tr", { class: one.changed ? "changed" : "" }, make("td", { class: "code", draggable: "true", title: "Drag it to the curves", ondragstart: dragged }, one.name), make("td", {}, value), make("td", { class: "soft" }, one.unit),
        make("td", {}, one.changed ? "changed" : ""), make("td", { class: "soft" }, one.kind), make("td", { class: "soft" }, one.range),
        make("td", { class: "soft doc" }, one.doc));
    }));
  }
  filter.addEventListener("input", () => draw(chosen()));
  changed.addEventListener("change", () => draw(chosen()));
  const root = make("div", { class: "column" }, make("div", { class: "bar" }, make("span", {}, "Level ", head), filter, make("label", { for: "only-changed" }, changed, " only what this tick changed")),
    make("div", { class: "scroll" }, make("table", { class: "values" }, make("thead", {}, make("tr", {}, ["Variable", "Value", "Unit", "", "Kind", "Range", ""].map((text) => make("th", {}, text)))), rows)));
  bus.on("moment", ask);
  bus.on("selection", (_, what) => { if (what?.has("level")) ask(); });
  return { root, shown: ask, focus: () => filter.focus() };
}

function breaksTab(bus) {
  const list = make("ul"), faults = make("ul"), buffers = make("ul");
  const what = make("input", { "aria-label": "A condition, or a line, to stop at", placeholder: "a line, or a condition", size: "44", spellcheck: "false", list: "run-words" });
  const type = (line) => doLine(bus, line);
  exampled(bus, (condition, line) => { what.title = `A condition, as ${condition}, or a line, as ${line}`; });
  const add = make("form", { class: "bar", onsubmit: async (event) => { event.preventDefault(); if (await type(`break ${what.value}`)) what.value = ""; } }, what, make("button", {}, "Break there"));
  let before = "";
  bus.on("run.state", (state) => {
    const key = JSON.stringify([state.open, state.breaks, state.faults, state.buffers]);
    if (key === before) return;
    before = key;
    list.replaceChildren(...(state.breaks ?? []).map(({ number, text }) => make("li", {}, `${number}: `, make("code", {}, text), " ", make("button", { type: "button", "aria-label": `Delete breakpoint ${number}`, onclick: () => type(`delete ${number}`) }, "Delete"))));
    faults.replaceChildren(...((state.faults ?? []).length ? state.faults.map(({ name, on }) => make("li", {}, make("label", {}, make("input", { type: "checkbox", checked: on, onchange: () => type(`fault ${name} ${on ? "off" : "on"}`) }), ` ${name}`, on ? make("strong", { class: "wrong" }, " is on") : ""))) : [make("li", { class: "soft" }, "what stands outside declares none")]));
    buffers.replaceChildren(...(state.buffers ?? []).map(({ name, to, frozen }) => make("li", {}, make("label", {}, make("input", { type: "checkbox", checked: frozen, onchange: () => type(`${frozen ? "thaw" : "freeze"} ${name}`) }), " ", make("code", {}, name), ` → ${to}`, frozen ? make("strong", { class: "wrong" }, " broken: what is written to it is lost") : ""))));
  });
  return { root: make("div", { class: "columns scroll" }, make("section", {}, make("h3", {}, "Breakpoints"), add, list), make("section", {}, make("h3", {}, "Faults of the plant"), faults), make("section", {}, make("h3", {}, "Break a buffer"), buffers)), focus: () => what.focus() };
}

function scriptTab(bus) {
  const rows = make("tbody"), none = make("p", { class: "soft" }, ...spoken("No script orders this system; `rcsc studio SCRIPT` starts it with one. Orders given here have the next number."));
  const level = make("select", { "aria-label": "Level that is ordered", onchange: () => draw() });
  const fields = make("span", { class: "bar small" });
  let orders = [];
  const form = make("form", { class: "bar", onsubmit: async (event) => {
    event.preventDefault();
    const given = [...fields.querySelectorAll("[data-field]")].filter((one) => one.value !== one.dataset.initial || one.dataset.command);
    const said = given.map((one) => (one.dataset.command ? one.value : `${one.dataset.field}=${one.value}`)).join(" ");
    const answer = await bus.try("run.type", { line: `order ${level.value} ${said}` });
    if (answer) bus.say(answer.shown.join("\n"));
  } }, level, fields, make("button", {}, "Order"));
  function draw() {
    const of = orders.find(({ level: name }) => name === level.value);
    fields.replaceChildren(...(of?.fields ?? []).flatMap(({ name, command, members, text, unit, range }) => {
      const one = members.length ? make("select", {}, members.map((word) => make("option", { selected: word === text && !command }, word)))
        : make("input", { value: text, size: "6", title: range, spellcheck: "false" });
      Object.assign(one.dataset, { field: name, initial: text, ...(command ? { command: "yes" } : {}) });
      return [make("label", {}, make("span", { class: "soft" }, command ? "" : `${name} `), one, unit ? make("span", { class: "soft" }, ` ${unit}`) : "")];
    }));
  }
  bus.on("run.orders", (said) => {
    orders = said ?? [];
    form.hidden = !orders.length;
    level.replaceChildren(...orders.map(({ level: name }) => make("option", { value: name }, name)));
    draw();
  });
  bus.on("run.rows", (said) => {
    none.hidden = Boolean(said);
    rows.replaceChildren(...(said?.rows ?? []).map(({ number, text, state, reason, ticks }, at) => {
      const now = at === said.at && !said.over;
      return make("tr", { class: now ? "lit" : "", "aria-current": now ? "true" : undefined }, make("td", { class: "soft" }, number), make("td", { class: "code" }, text),
        make("td", { class: state === "done" ? "good" : state && state !== "under way" ? "wrong" : "" }, state), make("td", { class: "soft" }, ticks === null ? "" : `${ticks} cycles`), make("td", {}, reason));
    }));
    rows.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
  });
  return { root: make("div", { class: "column" }, form, make("div", { class: "scroll" }, none, make("table", { class: "values" }, rows))), focus: () => level.focus() };
}

const STANDS = { proved: "good", refuted: "wrong", open: "wrong", conditional: "warn" };

function requiredTab(bus) {
  const rows = make("tbody"), none = make("p", { class: "soft", hidden: true }, ...spoken("Nothing is required: `requirement` in a level's tables, or a file that `system.toml` names as `requirements`."));
  const sums = make("span", { class: "grow soft", role: "status" });
  const open = (one) => bus.try("log.open", { name: one.log }).then((answer) => { if (answer) bus.say(`the run that breaks \`${one.name}\` is shown to everybody`); });
  function row(one) {
    const verdict = make("td", {}, make("strong", { class: STANDS[one.state] ?? "soft" }, one.state), " ", make("span", { class: "soft" }, ...spoken(one.words.startsWith(one.state) ? one.words.slice(one.state.length).replace(/^[:,;]? /, "") : one.words)));
    if (one.log) verdict.append(" ", make("button", { type: "button", "aria-label": `Show the run that breaks ${one.name}`, onclick: () => open(one) }, "Show its run"));
    return make("tr", { "data-state": one.state, "data-name": one.name }, make("td", {}, make("code", {}, one.name), make("div", { class: "soft" }, one.level ? `${one.word} of ${one.level}` : `${one.word} across levels`), one.req.length ? make("div", { class: "soft" }, one.req.join(", ")) : null),
      make("td", { class: "code", title: one.doc }, one.text, make("div", { class: "soft" }, one.place)), verdict,
      make("td", { class: "soft" }, ...one.trusts.flatMap((trust) => [...spoken(trust), make("br")])));
  }
  async function list() {
    const every = await bus.try("required.list") ?? [];
    const count = (state) => every.filter((one) => one.state === state).length;
    const states = [...new Set(every.map(({ state }) => state))];
    sums.textContent = states.map((state) => `${count(state)} ${state}`).join(", ");
    none.hidden = every.length > 0;
    rows.replaceChildren(...every.map(row));
  }
  const again = make("button", { type: "button", onclick: list }, "List again");
  const head = make("thead", {}, make("tr", {}, ["Name", "Says", "Verdict", "Trusts"].map((text) => make("th", {}, text))));
  return { root: make("div", { class: "column" }, make("div", { class: "bar" }, again, sums), make("div", { class: "scroll" }, none, make("table", { class: "values" }, head, rows))), shown: list, focus: () => again.focus() };
}

function foundTab(bus) {
  const logs = make("div"), text = make("pre", { class: "code", hidden: true }), doing = make("span", { class: "soft", role: "status" });
  let cancel = null;
  const stop = make("button", { type: "button", hidden: true, onclick: () => cancel?.abort() }, "Cancel");
  async function job(kind, body, done) {
    cancel?.abort();
    const mine = cancel = new AbortController();
    stop.hidden = false;
    try { done(await bus.ask(kind, body, { signal: mine.signal, progress: (how) => { doing.textContent = how.of ? `${how.text}: ${how.done} of ${how.of}` : how.text; } })); }
    catch (error) { bus.say(error.message, { wrong: true, helps: error.helps }); }
    if (cancel === mine) { cancel = null; stop.hidden = true; doing.textContent = ""; }
  }
  const openLog = (name) => job("log.open", { name }, () => bus.say(`${name} is shown to everybody`));
  async function list() {
    const found = await bus.try("log.list") ?? [];
    const named = ({ name, bytes, changed_s: when, finding }) => make("li", {}, make("button", { type: "button", onclick: () => openLog(name) }, name),
      make("span", { class: "soft" }, ` ${bytes >= 1e6 ? `${(bytes / 1e6).toFixed(1)} MB` : `${Math.ceil(bytes / 1e3)} kB`}, ${new Date(when * 1000).toLocaleString()}`),
      finding ? make("div", { class: "breaks" }, ...spoken(finding)) : null);
    const part = (title, some) => (some.length ? [make("h3", {}, title), make("ul", {}, some.map(named))] : []);
    logs.replaceChildren(...part("Findings: runs that break something", found.filter(({ finding }) => finding)), ...part("Runs that were kept", found.filter(({ finding }) => !finding)));
    if (!found.length) logs.replaceChildren(make("p", { class: "soft" }, ...spoken("no logs here: `rcsc run --log`, `rcsc prove --log` and campaigns write them")));
    return found;
  }
  const prove = make("button", { type: "button", onclick: () => job("build.prove", {}, (answer) => {
    text.hidden = false;
    text.textContent = answer.text;
    const shown = answer.logs.length, runs = shown ? `${shown} ${shown === 1 ? "run shows" : "runs show"} it` : "the text below says what";
    list().then((found) => {
      const [first] = answer.logs.flatMap((path) => found.filter(({ name }) => path.endsWith(name)));
      bus.say(answer.status === 0 ? "the levels are proved together" : `not all is proved: ${runs}`, { wrong: answer.status !== 0,
        then: first ? { [shown === 1 ? "Show the run" : "Show the first run"]: () => openLog(first.name) } : {} });
    });
  }) }, "Prove the levels together");
  const again = make("button", { type: "button", onclick: () => job("build.open", {}, (answer) => bus.say(answer.ok ? "proved, compiled and opened anew" : "the tables are not proved", { wrong: !answer.ok })) }, "Prove, compile and open anew");
  bus.on("prove", () => prove.click());
  bus.on("build.state", (state) => { if (!cancel) doing.textContent = state.doing; });
  return { root: make("div", { class: "column" }, make("div", { class: "bar" }, again, prove, make("button", { type: "button", onclick: list }, "List logs again"), stop, doing),
    make("div", { class: "scroll" }, text, logs)), shown: list, focus: () => prove.focus() };
}

export { lookAt };
