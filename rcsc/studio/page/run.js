// The run: every level side by side, and what is done to it.

import { make } from "./bus.js";

export function mount(root, bus) {
  const shown = make("pre", { class: "scroll" });
  const line = make("input", { "aria-label": "A command of the shell", size: "60", spellcheck: "false" });
  const levels = make("div");
  root.append(
    make("form", { onsubmit: async (event) => {
      event.preventDefault();
      const answer = await bus.try("run.type", { line: line.value });
      if (answer) shown.textContent = answer.shown.join("\n");
      line.select();
    } }, line, make("button", {}, "Do")),
    make("div", {},
      make("button", { type: "button", onclick: () => bus.try("run.open") }, "Open"),
      make("button", { type: "button", onclick: () => bus.try("run.go") }, "Run"),
      make("button", { type: "button", onclick: () => bus.try("run.pause") }, "Pause")),
    levels, shown);
  let asking = false;
  bus.on("run.state", async (state) => {
    if (!state.open || asking) return;
    asking = true;
    const moment = await bus.try("run.moment", { tick: state.tick });
    asking = false;
    levels.replaceChildren(...(moment?.levels ?? []).map((level) => make("div", {}, `${level.level}: ${level.table}, line ${level.lines.join(" and ")}`)));
  });
}
