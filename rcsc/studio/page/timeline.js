// The time line, below all views.

import { make } from "./bus.js";

export function mount(root, bus) {
  const tick = make("input", { type: "range", min: "0", max: "0", "aria-label": "Tick" });
  const said = make("output");
  root.append(tick, said);
  tick.addEventListener("input", () => bus.select({ tick: Number(tick.value), follow: false }));
  bus.on("run.state", (state) => {
    if (!state.open) return;
    Object.assign(tick, { min: state.first, max: state.last });
    if (bus.selection.follow) bus.select({ tick: state.last });
  });
  bus.on("selection", ({ tick: now }) => {
    if (now === null) return;
    tick.value = now;
    said.textContent = ` tick ${now}`;
  });
}
