// Plays what was recorded: from the tick that is looked at, at a speed, again and again where that is asked for.

import { make } from "./make.js";
import { lookAt } from "./moments.js";

const SPEEDS = [["1 ×", 1], ["0.5 ×", 0.5], ["0.1 ×", 0.1], ["0.01 ×", 0.01], ["2 ×", 2], ["5 ×", 5], ["20 ×", 20]];

/** The buttons of a player; `span` gives the first and the last tick of what it plays. */
export function playing(bus, span) {
  let frame = 0, before = 0, at = 0, shown = null;
  const play = make("button", { type: "button", "aria-pressed": "false", onclick: () => (frame ? stop() : begin()) });
  const speed = make("select", { "aria-label": "How fast it plays, of the clock", title: "How fast it plays, of the clock" }, SPEEDS.map(([text, value]) => make("option", { value }, text)));
  const loop = make("input", { type: "checkbox" });
  const can = () => { const run = bus.latest("run"); return Boolean(run?.open) && !run.going && run.last > run.first; };

  function drawn() {
    play.replaceChildren(frame ? "Stop " : "Play ", make("kbd", {}, "k"));
    play.setAttribute("aria-pressed", Boolean(frame));
    play.disabled = !can();
    play.title = frame ? "Stop playing: k" : bus.latest("run")?.going ? "While it runs nothing is played: pause it first" : "Play what the time line shows, from the tick that is looked at: k";
  }
  function begin() {
    if (!can()) return;
    const [first, last] = span(), { tick } = bus.selection;
    at = tick === null || tick >= last || tick < first ? first : tick;
    shown = null;
    before = performance.now();
    frame = requestAnimationFrame(step);
    drawn();
  }
  function stop() {
    cancelAnimationFrame(frame);
    frame = 0;
    drawn();
  }
  function step(now) {
    if (!can() || (shown !== null && bus.selection.tick !== shown)) return stop(); // it runs, or somebody looks elsewhere
    const [first, last] = span();
    at += Math.max(0, now - before) * Number(speed.value) / bus.latest("run").tick_ms;
    before = now;
    if (at >= last + 1 && loop.checked) at = first;
    lookAt(bus, Math.min(last, Math.floor(at)));
    shown = bus.selection.tick;
    if (at >= last && !loop.checked) return stop();
    frame = requestAnimationFrame(step);
    return undefined;
  }

  bus.on("run", drawn);
  bus.key("k", "Play what the time line shows, or stop", () => play.click(), "Time line");
  drawn();
  return [play, speed, make("label", { title: "Begin again at the end of what the time line shows" }, loop, " loop")];
}
