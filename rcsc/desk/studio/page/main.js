// The page's frame: the views in one pane or two, what is said, the keys, and the theme.

import { make, Refusal } from "./bus.js";
import { spoken } from "./make.js";
import { followKeys } from "./keys.js";
import { sharing } from "./share.js";
import { Connected } from "./socket.js";
import { followStart } from "./started.js";
import { verdicts } from "./verdict.js";
import { BELOW, DRAWER, VIEWS } from "./views.js";
import { about } from "./welcome.js";

const bus = new Connected();
const page = (id) => document.getElementById(id);
const store = { get: (key, other) => { try { return localStorage.getItem(`studio.${key}`) ?? other; } catch { return other; } },
  set: (key, value) => { try { localStorage.setItem(`studio.${key}`, value); } catch { /* a private window keeps nothing */ } } };

// --- panes and views ---

/** What parts the two panes: dragged, or moved by arrows; how wide the left one is, is kept. */
function between() {
  const bar = make("div", { class: "between", role: "separator", tabindex: "0", "aria-orientation": "vertical", "aria-label": "How wide the left pane is", "aria-valuemin": "15", "aria-valuemax": "85" });
  function set(percent) {
    const now = Math.round(Math.max(15, Math.min(85, percent)));
    page("panes").style.setProperty("--left", `${now}%`);
    bar.setAttribute("aria-valuenow", now);
    store.set("left", now);
  }
  bar.addEventListener("pointerdown", (event) => { bar.setPointerCapture(event.pointerId); event.preventDefault(); });
  bar.addEventListener("pointermove", (event) => { if (bar.hasPointerCapture(event.pointerId)) set(100 * (event.clientX - page("panes").getBoundingClientRect().x) / page("panes").clientWidth); });
  bar.addEventListener("dblclick", () => set(50));
  bar.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -2, ArrowRight: 2 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    set(Number(bar.getAttribute("aria-valuenow")) + by);
  });
  set(Number(store.get("left", 50)) || 50);
  return bar;
}

const mounted = new Map(); // by name: { root, hooks }
const panes = [0, 1].map((at) => {
  const pane = make("section", { class: "pane", "aria-label": `Pane ${at + 1}` });
  pane.addEventListener("focusin", () => activate(at));
  pane.addEventListener("pointerdown", () => activate(at));
  page("panes").append(...(at ? [between()] : []), pane);
  return { pane, shows: "" };
});
let active = 0;
let two = store.get("two", VIEWS.length > 1 ? "yes" : "no") === "yes" && VIEWS.length > 1;

let before = Promise.resolve(); // a view that was asked for before may still be loaded
function inTurn(act) {
  const done = before.then(act);
  before = done.catch(() => {});
  return done;
}
const show = (name, at = active) => inTurn(() => showNow(name, at));
const split = () => inTurn(() => splitNow(!two));

async function showNow(name, at) {
  const other = panes[1 - at];
  if (two && other.shows === name) return activate(1 - at, true);
  if (other.shows === name) {
    other.shows = panes[at].shows; // the pane beside, which is hidden, takes what stood here
    store.set(`pane${1 - at}`, other.shows);
  }
  if (!mounted.has(name)) {
    const view = VIEWS.find((one) => one.name === name);
    const root = make("div", { class: `view view-${name}`, "data-view": name, tabindex: "-1", role: "region", "aria-label": view.title });
    mounted.set(name, { root, hooks: {} });
    const { mount } = await view.load();
    panes[at].pane.append(root);
    mounted.get(name).hooks = mount(root, bus) ?? {};
  }
  const { root, hooks } = mounted.get(name);
  const gone = panes[at].shows;
  panes[at].shows = name;
  if (gone && gone !== name && mounted.has(gone)) {
    if (other.shows === gone) other.pane.append(mounted.get(gone).root);
    else mounted.get(gone).root.remove();
    mounted.get(gone).hooks.hidden?.();
  }
  panes[at].pane.append(root);
  hooks.shown?.();
  store.set(`pane${at}`, name);
  marks();
  return undefined;
}

function activate(at, focus = false) {
  if (active !== at) { active = at; marks(); }
  if (focus) mounted.get(panes[at].shows)?.root.focus({ preventScroll: true });
}

function marks() {
  page("panes").classList.toggle("two", two);
  panes.forEach(({ pane }, at) => {
    pane.hidden = !two && at !== active;
    pane.classList.toggle("active", two && at === active);
  });
  page("beside").setAttribute("aria-pressed", two);
  for (const button of page("views").children) {
    const at = panes.findIndex(({ shows, pane }) => shows === button.dataset.view && !pane.hidden);
    button.toggleAttribute("data-shown", at >= 0);
    button.setAttribute("aria-pressed", at === active);
  }
}

async function splitNow(wanted) {
  two = wanted && VIEWS.length > 1;
  store.set("two", two ? "yes" : "no");
  if (two && !panes[1 - active].shows) {
    await showNow(VIEWS.find(({ name }) => name !== panes[active].shows).name, 1 - active);
  }
  marks();
  for (const { pane, shows } of panes) if (!pane.hidden) mounted.get(shows)?.hooks.shown?.();
}

VIEWS.forEach(({ name, title }, at) => {
  const key = String(at + 1);
  page("views").append(make("button", { type: "button", "data-view": name, onclick: () => show(name) }, title, " ", make("kbd", {}, key)));
  bus.key(key, `Show ${title} in this pane`, () => show(name).then(() => activate(active, true)));
});
page("beside").hidden = VIEWS.length < 2;
page("beside").addEventListener("click", split);
if (VIEWS.length > 1) {
  bus.key("\\", "One view, or two side by side", split);
  bus.key("o", "Go to the other pane", () => { if (two) activate(1 - active, true); });
}

// --- what is said ---

let breaks = false; // saying it may break, too
function broken(error) {
  if (!error || breaks || error.message === "cancelled") return;
  breaks = true;
  if (error instanceof Refusal) bus.say(error.message, { wrong: true, helps: error.helps });
  else bus.say(`a bug in this page: ${error.message ?? error}`, { wrong: true, helps: ["load the page again: texts and run are kept", "please report it"] });
  breaks = false;
}
addEventListener("error", ({ error }) => broken(error));
addEventListener("unhandledrejection", ({ reason }) => broken(reason));

let clearing = 0, under = null; // what a click would cancel
bus.on("said", ({ text, wrong, helps, cancel, then }) => {
  const line = page("said");
  if (cancel && cancel === under) return line.firstChild.replaceChildren(...spoken(text)); // the button stays where it is
  under = cancel;
  line.className = wrong ? "wrong" : "";
  line.replaceChildren(...(wrong ? [make("strong", {}, "Not done: ")] : []), make("span", {}, ...spoken(text)), ...helps.map((help) => make("span", { class: "help" }, " Help: ", ...spoken(help))), cancel ? make("button", { type: "button", title: "Give up what is under way: .", onclick: cancel }, "Cancel") : "",
    ...Object.entries(then).map(([word, act]) => make("button", { type: "button", onclick: act }, word)),
    make("button", { type: "button", class: "close", "aria-label": "Dismiss", onclick: () => line.replaceChildren() }, "×"));
  clearTimeout(clearing);
  if (!wrong && !cancel && !Object.keys(then).length) clearing = setTimeout(() => line.replaceChildren(), 6000);
});

function stated() {
  const state = bus.latest("run.state");
  let said = bus.latest("connection") === undefined ? "connecting" : "no connection";
  const held = bus.latest("run.held");
  if (bus.latest("connection")) said = held?.text || (!state ? "connected" : state.text);
  page("state").replaceChildren(...spoken(said));
  page("state").title = said.replaceAll("`", "");
  page("state").classList.toggle("wrong", Boolean(bus.latest("connection") && held?.help));
  if (held?.help) page("state").title += `; ${held.help}`;
}
/** What was broken by hand, wherever one looks: a run that stands still for it says why. */
function brokenByHand({ buffers = [], faults = [] }) {
  const every = [...buffers.filter(({ frozen }) => frozen).map(({ name, to }) => `${name} → ${to} is broken: what is written to it is lost`), ...faults.filter(({ on }) => on).map(({ name }) => `fault ${name} is on`)];
  page("broken").hidden = !every.length;
  page("broken").textContent = every.length === 1 ? every[0].replace(/( is broken):.*/, "$1") : `${every.length} things are broken`;
  page("broken").title = every.join("\n");
}
page("broken").addEventListener("click", async () => {
  await show("run");
  bus.tell("drawer", "breaks");
});
for (const [key, what, tab] of DRAWER) bus.key(key, what, () => show("run").then(() => bus.tell("drawer", tab)), "Run");
bus.on("connection", stated);
bus.on("run.state", (state) => {
  brokenByHand(state);
  if (state.title) document.title = `${(page("title").textContent = state.title)} · rcsc studio`;
  stated();
});
bus.on("run.held", stated);

// --- theme ---

const themes = ["system", "light", "dark"];
function theme(name) {
  document.documentElement.dataset.theme = name;
  page("theme").textContent = `Theme: ${name}`;
  store.set("theme", name);
  const dark = name === "dark" || (name === "system" && matchMedia("(prefers-color-scheme: dark)").matches);
  bus.tell("theme", dark ? "dark" : "light");
}
const nextTheme = () => theme(themes[(themes.indexOf(document.documentElement.dataset.theme) + 1) % themes.length]);
page("theme").addEventListener("click", nextTheme);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => theme(document.documentElement.dataset.theme));
theme(themes.includes(store.get("theme", "system")) ? store.get("theme", "system") : "system");

// --- keys ---

followKeys(bus);
function listKeys() {
  const by = Map.groupBy(bus.keys, ({ where }) => where);
  page("keys").querySelector("table").replaceChildren(...[...by].flatMap(([where, several]) => [
    make("tr", {}, make("th", { colspan: "2", scope: "colgroup" }, where)),
    ...several.map(({ keys, what }) => make("tr", {}, make("td", {}, ...keys.split(", ").flatMap((one, at) => [at ? " or " : "", make("kbd", {}, one)])), make("td", {}, what))),
  ]));
  page("keys").showModal();
}
page("help").addEventListener("click", listKeys);
bus.key("?", "List the keys", listKeys);
bus.key("escape", "Leave a field: keys mean what they say here again", () => {});
bus.key(".", "Cancel what is under way in the line below", () => bus.latest("said")?.cancel?.());
bus.key("h", "The start page: other tables, new projects, published tables", () => location.assign("start.html"));
bus.key("t", "Light, dark, or as the system has it", nextTheme);

sharing(bus, page("share"), page("sharing"));

// --- begin ---

/** The latest of a kind of event, or undefined where none comes in a second. */
const first = (kind) => new Promise((done) => { setTimeout(done, 1000); bus.on(kind, done); });

/** Of tables alone nothing runs: what is of a run is not offered until a log is looked at. */
function offer() {
  const alone = bus.latest("build.state")?.system === false && bus.latest("time.state")?.source !== "log";
  page("time").hidden = page("state").hidden = alone;
  for (const button of page("views").children) button.hidden = alone && Boolean(VIEWS.find(({ name }) => name === button.dataset.view).ofRun);
}

verdicts(bus, page("verdict"), show);
about(bus, page("about"), store, show);
followStart(bus, ({ opened }) => { if (!opened) location.replace("start.html"); });
bus.connect();
const { system = true } = await first("build.state") ?? {};
const kept = [0, 1].map((at) => VIEWS.find(({ name }) => name === store.get(`pane${at}`, "")));
if (system) {
  const wanted = [kept[0] ?? VIEWS[0], kept[1] ?? VIEWS[1]];
  await show(wanted[0].name, 0);
  if (two && wanted[1] !== wanted[0]) await show(wanted[1].name, 1);
  else if (two) await splitNow(true);
} else {
  two = false;
  await show("tables", 0);
}
bus.on("build.state", offer);
bus.on("time.state", offer);
if (!kept[0]) { // what stands outside is what people know at a glance: the cell, where it can be seen, beside the table that runs
  const over = bus.on("cell.state", ({ space, drawn }) => { if (space || drawn) { setTimeout(() => over()); if (panes[0].shows === "run") show("cell", 0); } });
}
const below = await BELOW.load();
below.mount(page("time"), bus);
marks();
document.documentElement.dataset.ready = "yes";
