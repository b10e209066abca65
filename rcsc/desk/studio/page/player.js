// What a file does that shows a run, or a moment of one: the studio's time line, levels and curves, of the data that stands in the file.

import { changes, exchanges } from "./exchanges.js";
import { FilmBus, standing, unpacked } from "./film.js";
import { followKeys } from "./keys.js";
import { faults, linesOf } from "./level.js";
import { make, spoken } from "./make.js";
import { lookAt } from "./moments.js";
import { mount as mountCurves } from "./plots.js";
import { mount as mountTime } from "./timeline.js";

const part = (id) => document.getElementById(id);

function play(film) {
  const bus = new FilmBus(film);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const theme = () => bus.tell("theme", dark.matches ? "dark" : "light");
  dark.addEventListener("change", theme);
  theme();
  bus.on("said", ({ text, helps }) => { part("said").replaceChildren(...spoken([text, ...helps].join(" "))); });
  mountTime(part("time"), bus);
  const back = film.at === null ? null : make("button", { type: "button", onclick: () => lookAt(bus, film.at) }, `Back to tick ${film.at}`);
  if (back) part("time").querySelector(".bar").append(back);
  levels(film, bus);
  pictures(film, bus);
  bus.tell("run.state", { open: false, title: document.title });
  bus.tell("time.state", { source: "log", name: document.title, first: film.first, last: film.last, tick_ms: film.tick_ms, levels: film.levels, finding: null });
  mountCurves(part("curves"), bus);
  lookAt(bus, film.at ?? film.last);
  followKeys(bus);
  for (const one of document.querySelectorAll("[data-tick-of]")) one.addEventListener("click", () => lookAt(bus, Number(one.dataset.tickOf)));
}

// --- levels ---

function levels(film, bus) {
  const open = new Set();
  const place = part("moment");
  function variables(level, tick) {
    const rows = Object.entries(film.variables[level] ?? {}).flatMap(([name, { changes: told, unset }]) => {
      const at = standing(told, tick);
      if (at < 0) return [];
      const changed = told[at][0] === tick && tick > film.first, never = unset.some(([from, to]) => from <= tick && tick <= to);
      return [make("tr", { class: changed ? "changed" : "" }, make("td", { class: "code" }, name), make("td", { class: "code" }, told[at][1], changed ? " (changed)" : "", never ? make("span", { class: "soft" }, " (nobody has set it)") : ""))];
    });
    return make("table", {}, make("tbody", {}, rows));
  }
  function card(box, tick) {
    const level = film.levels.find(({ name }) => name === box.level);
    const lines = [...box.before, ...(box.lines.length ? box.lines : [""]).map((line) => [box.table, line])];
    const values = make("details", { open: open.has(box.level) }, make("summary", {}, "Variables"));
    const fill = () => { if (values.open && values.childElementCount < 2) values.append(variables(box.level, tick)); };
    values.addEventListener("toggle", () => { if (values.open) open.add(box.level); else open.delete(box.level); fill(); });
    fill();
    return make("article", { class: `card${bus.selection.level === box.level ? " chosen" : ""}`, "aria-label": `Level ${box.level}` },
      make("header", {}, make("h3", {}, box.level), make("span", { class: "soft" }, `every ${level.period_ms} ms${box.ran ? "" : "; no cycle in this tick"}`)),
      make("div", {}, ...linesOf(bus, level, lines, box.ran), ...faults(box.fault, box.wrong), ...exchanges(box), ...changes(box)), values);
  }
  function draw() {
    const moment = bus.latest("moment");
    if (!moment) return;
    const focused = place.contains(document.activeElement) ? [...place.querySelectorAll("button, summary")].indexOf(document.activeElement) : -1;
    place.replaceChildren(...moment.levels.map((box) => card(box, moment.tick)));
    place.dataset.tick = moment.tick;
    if (focused >= 0) place.querySelectorAll("button, summary")[focused]?.focus({ preventScroll: true });
  }
  bus.on("moment", draw);
  bus.on("selection", (_, changed) => { if (changed && !changed.has("tick")) draw(); });
}

// --- pictures ---

function pictures(film, bus) {
  const sorted = [...film.pictures].sort((a, b) => a.tick - b.tick), figure = part("cell");
  let drawn = null;
  function of(picture) {
    if (picture.of) return part(picture.of).querySelector("svg").cloneNode(true);
    return document.adoptNode(new DOMParser().parseFromString(picture.svg, "image/svg+xml").documentElement);
  }
  bus.on("selection", ({ tick }, changed) => {
    const now = sorted.findLast((one) => one.tick <= tick) ?? sorted[0];
    if (!changed?.has("tick") || !now || now === drawn) return;
    drawn = now;
    figure.replaceChildren(of(now), make("figcaption", {}, `drawn of tick ${now.tick}. `, ...spoken(now.caption.join(" "))));
  });
}

play(await unpacked(part("film")));
