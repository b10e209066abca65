// The page's frame: the views in one pane or two, what is said, the keys, and the theme.

import { make, Refusal } from "./bus.js";
import { spoken } from "./make.js";
import { followKeys } from "./keys.js";
import { sharing } from "./share.js";
import { Connected } from "./socket.js";
import { BELOW, VIEWS } from "./views.js";

const bus = new Connected();
const page = (id) => document.getElementById(id);
const store = { get: (key, other) => { try { return localStorage.getItem(`studio.${key}`) ?? other; } catch { return other; } },
  set: (key, value) => { try { localStorage.setItem(`studio.${key}`, value); } catch { /* a private window keeps nothing */ } } };

// --- panes and views ---

const mounted = new Map(); // by name: { root, hooks }
const panes = [0, 1].map((at) => {
  const pane = make("section", { class: "pane", "aria-label": `Pane ${at + 1}` });
  pane.addEventListener("focusin", () => activate(at));
  pane.addEventListener("pointerdown", () => activate(at));
  page("panes").append(pane);
  return { pane, shows: "" };
});
let active = 0;
let two = store.get("two", VIEWS.length > 1 ? "yes" : "no") === "yes" && VIEWS.length > 1;

async function show(name, at = active) {
  const other = panes[1 - at];
  if (two && other.shows === name) return activate(1 - at, true);
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
    mounted.get(gone).root.remove();
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

async function split(wanted) {
  two = wanted && VIEWS.length > 1;
  store.set("two", two ? "yes" : "no");
  if (two && !panes[1 - active].shows) {
    await show(VIEWS.find(({ name }) => name !== panes[active].shows).name, 1 - active);
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
page("beside").addEventListener("click", () => split(!two));
if (VIEWS.length > 1) {
  bus.key("\\", "One view, or two side by side", () => split(!two));
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
bus.on("said", ({ text, wrong, helps, cancel }) => {
  const line = page("said");
  if (cancel && cancel === under) return line.firstChild.replaceChildren(...spoken(text)); // the button stays where it is
  under = cancel;
  line.className = wrong ? "wrong" : "";
  line.replaceChildren(...(wrong ? [make("strong", {}, "Not done: ")] : []), make("span", {}, ...spoken(text)), ...helps.map((help) => make("span", { class: "help" }, " Help: ", ...spoken(help))), cancel ? make("button", { type: "button", title: "Give up what is under way: .", onclick: cancel }, "Cancel") : "",
    make("button", { type: "button", class: "close", "aria-label": "Dismiss", onclick: () => line.replaceChildren() }, "×"));
  clearTimeout(clearing);
  if (!wrong && !cancel) clearing = setTimeout(() => line.replaceChildren(), 6000);
});

function stated() {
  const state = bus.latest("run.state");
  let said = "no connection";
  const held = bus.latest("run.held");
  if (bus.latest("connection")) said = held?.text || (!state ? "connected" : state.text);
  page("state").replaceChildren(...spoken(said));
  page("state").title = said.replaceAll("`", "");
  page("state").classList.toggle("wrong", Boolean(bus.latest("connection") && held?.help));
  if (held?.help) page("state").title += `; ${held.help}`;
}
bus.on("connection", stated);
bus.on("run.state", (state) => {
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
bus.key("t", "Light, dark, or as the system has it", nextTheme);

sharing(bus, page("share"), page("sharing"));

// --- begin ---

bus.connect();
const wanted = [0, 1].map((at) => VIEWS.find(({ name }) => name === store.get(`pane${at}`, "")) ?? VIEWS[at]);
await show(wanted[0].name, 0);
if (two && wanted[1] && wanted[1] !== wanted[0]) await show(wanted[1].name, 1);
else if (two) await split(true);
const below = await BELOW.load();
below.mount(page("time"), bus);
marks();
document.documentElement.dataset.ready = "yes";
