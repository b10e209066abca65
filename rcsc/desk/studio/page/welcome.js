// What this is, in three sentences, for who opens it the first time; until it is dismissed.

import { make, spoken } from "./make.js";

export function about(bus, place, store, show) {
  const gone = () => store.get("about", "") === "gone";
  function dismiss() {
    store.set("about", "gone");
    place.hidden = true;
  }

  function draw() {
    const build = bus.latest("build.state"), run = bus.latest("run.state");
    if (run?.open && run.last > 0) dismiss(); // who has run it knows
    if (!build || gone() || build.asks) { place.hidden = true; return; }
    if (build.system && !run?.open) { place.hidden = true; return; }
    if (place.dataset.of === String(build.system)) { place.hidden = false; return; }
    place.dataset.of = String(build.system);
    place.hidden = false;
    place.replaceChildren(make("p", {}, ...spoken(build.system ? system(run) : tables())),
      ...(build.system ? [make("button", { type: "button", class: "go", onclick: () => { dismiss(); bus.try("run.go"); } }, "Run the demo")] : []),
      make("button", { type: "button", onclick: () => show(build.system ? "run" : "graph") }, build.system ? "See the levels" : "See it as a graph"),
      make("button", { type: "button", class: "close", "aria-label": "Dismiss", onclick: dismiss }, "×"));
  }
  bus.on("build.state", draw);
  bus.on("run.state", draw);
}

function system({ title, levels }) {
  const names = levels.map(({ name }) => `\`${name}\``);
  const many = names.length === 1 ? `one level, ${names[0]}` : `${names.length} levels: ${names.slice(0, -1).join(", ")} and ${names.at(-1)}`;
  return `${title} is controlled by ${many}. In every cycle each level looks at what it is told and sees, and exactly one line of its state table matches: that line says what is done. That it is exactly one, whatever comes in, is proved before anything moves.`;
}

const tables = () => "A line of a table is what is done where its cells hold; of all lines exactly one must match, whatever comes in. What is wrong stands below its line: an input that shows it, and repairs that are proved. Change a cell, and it is proved anew while you look.";
