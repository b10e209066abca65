// What a shared file does: draws the tick that is scrubbed to, of the data that stands in it. Part of such files alone.

import { changes, exchanges } from "./exchanges.js";
import { make } from "./make.js";

function play(film, scrub, place, figure) {
  const slider = make("input", { type: "range", min: film.first, max: film.last, "aria-label": "Tick" });
  const readout = make("output", {});
  const step = (by) => () => go(tick + by);
  const open = new Set();
  let tick = film.at;
  scrub.append(make("button", { type: "button", onclick: step(-1), "aria-label": "The tick before" }, "◀"), slider,
    make("button", { type: "button", onclick: step(1), "aria-label": "The tick after" }, "▶"), readout, make("button", { type: "button", onclick: () => go(film.at) }, `Back to tick ${film.at}`));
  slider.addEventListener("input", () => go(Number(slider.value)));

  // Values are told where they change: those of a tick are all that were told up to it.
  function valuesAt(level) {
    const values = new Map();
    for (let at = film.first; at <= tick; at += 1) {
      const told = film.ticks[at - film.first].levels.find((one) => one.level === level)?.values ?? {};
      for (const [name, text] of Object.entries(told)) values.set(name, { text, changed: at === tick && at > film.first });
    }
    return values;
  }

  function card(box) {
    const lines = [...box.before, ...(box.lines.length ? box.lines : ["-"]).map((line) => [box.table, line])];
    const values = make("details", { open: open.has(box.level) }, make("summary", {}, "Variables"));
    const fill = () => {
      if (!values.open || values.childElementCount > 1) return;
      values.append(make("table", {}, make("tbody", {}, [...valuesAt(box.level)].map(([name, { text, changed }]) => make("tr", { class: changed ? "changed" : "" }, make("td", { class: "code" }, name), make("td", { class: "code" }, text, changed ? " (changed)" : ""))))));
    };
    values.addEventListener("toggle", () => { if (values.open) open.add(box.level); else open.delete(box.level); fill(); });
    fill();
    return make("article", {}, make("h2", {}, box.level), ...lines.map(([table, line]) => make("p", {}, make("span", { class: "soft" }, "table "), table, make("span", { class: "soft" }, ", line "), make("strong", {}, line))),
      box.ran ? null : make("p", { class: "soft" }, "no cycle in this tick"), ...[box.fault, box.wrong].filter(Boolean).map((text) => make("p", { class: "bad" }, `✗ ${text}`)), ...exchanges(box), ...changes(box), values);
  }

  let drawn = null;
  function picture() {
    const before = film.pictures.filter((one) => one.tick <= tick).sort((a, b) => b.tick - a.tick)[0] ?? film.pictures[0];
    if (!before || before === drawn) return;
    drawn = before;
    const svg = new DOMParser().parseFromString(before.svg, "image/svg+xml").documentElement;
    figure.replaceChildren(document.adoptNode(svg), make("figcaption", {}, `drawn of tick ${before.tick}. ${before.caption.join(" ")}`));
  }

  function go(to) {
    tick = Math.max(film.first, Math.min(film.last, to));
    slider.value = tick;
    readout.textContent = `tick ${tick} of ${film.first} to ${film.last}, ${(tick * film.tick_ms / 1000).toFixed(2)} s`;
    place.replaceChildren(...film.ticks[tick - film.first].levels.map(card));
    place.dataset.tick = tick;
    picture();
  }
  go(film.at);
}

const part = (id) => document.getElementById(id);
play(JSON.parse(part("film").textContent), part("scrub"), part("moment"), part("cell"));
