// The time line: which line each level ran, at every tick. Everybody looks at the tick that is chosen here.

import { controls } from "./controls.js";
import { atSecond, colour, make } from "./make.js";
import { followMoments, lookAt } from "./moments.js";
import { playing } from "./playing.js";

const [AXIS, ROW, LEAST] = [18, 20, 8]; // pixels, pixels, ticks

export function mount(root, bus) {
  followMoments(bus);
  const canvas = make("canvas");
  const names = make("div", { class: "names" });
  const slider = make("div", { class: "line", role: "slider", tabindex: "0", "aria-label": "Tick" }, canvas);
  const readout = make("output", { class: "grow readout" });
  const find = make("input", { "aria-label": "Find a tick by a condition", placeholder: "find a tick where …", spellcheck: "false", list: "run-words" });
  const finds = bus.answers("time.find");
  const bar = make("div", { class: "bar" });
  root.append(...(bus.answers("run.type") ? [controls(bus)] : []), bar, make("div", { class: "tracks scroll" }, names, slider));

  let tracks = { era: -1, to: -1, first: 0, last: 0, levels: new Map(), marks: [] };
  let key = "", asking = false, again = false, due = false;
  const still = make("canvas"); // what does not move with the tick, drawn once
  let stands = "", told = 0, across = 0;
  let view = { from: 0, to: 200, whole: true };

  // --- what the server knows ---

  async function fetchTracks() {
    const run = bus.latest("run");
    if (!run?.open) { tracks = { era: -1, to: -1, first: 0, last: 0, levels: new Map(), marks: [] }; key = ""; return soon(); }
    if (asking) { again = true; return undefined; }
    const source = run.source === "log" ? `log ${run.name}` : "live";
    if (source !== key) { key = source; tracks = { era: -1, to: -1, first: 0, last: 0, levels: new Map(), marks: [] }; view.whole = true; }
    asking = true;
    const answer = await bus.ask("time.tracks", { era: tracks.era, since: tracks.to }).catch(() => null);
    asking = false;
    if (answer && key === source) {
      if (answer.from < 0) tracks.levels = new Map();
      for (const [level, changes] of Object.entries(answer.levels)) {
        const held = tracks.levels.get(level) ?? [];
        held.push(...changes);
        tracks.levels.set(level, held);
      }
      told += 1;
      Object.assign(tracks, { era: answer.era, to: answer.to, first: answer.first, last: answer.last, marks: answer.marks });
      if (view.whole) fit(); // at once: what is pressed before the next frame is meant of these ticks
      if (answer.to < answer.last) again = true;
    }
    if (again) { again = false; fetchTracks(); }
    return soon();
  }
  bus.on("run", () => fetchTracks());

  /** The change that stands at a tick: [tick, table, line, fault]. */
  function standing(level, tick) {
    const held = tracks.levels.get(level) ?? [];
    let low = 0, high = held.length;
    while (low < high) { const middle = (low + high) >> 1; if (held[middle][0] <= tick) low = middle + 1; else high = middle; }
    return { at: low - 1, change: held[low - 1] };
  }

  // --- drawing ---

  function soon() { if (!due) { due = true; requestAnimationFrame(() => { due = false; draw(); }); } }
  const colours = () => Object.fromEntries(["ink", "soft", "paper", "panel", "edge", "strong-edge", "accent", "bad", "lit", "lit-ink", "warn"].map((name) => [name, colour(name)]));
  const dark = () => bus.latest("theme") === "dark";
  const tint = (text, at) => {
    let hash = 0;
    for (const letter of text) hash = (hash * 31 + letter.codePointAt(0)) % 360;
    return dark() ? `hsl(${hash} 28% ${at % 2 ? 27 : 22}%)` : `hsl(${hash} 55% ${at % 2 ? 88 : 82}%)`;
  };
  /** Show other ticks; the curves show the same. */
  function seen(change) {
    Object.assign(view, change);
    bus.tell("span", view.whole ? null : { from: view.from, to: view.to });
  }
  bus.on("span", (span) => { Object.assign(view, { whole: !span }, span ?? {}); soon(); });
  const shownTicks = () => (view.whole ? [tracks.first, tracks.last] : [Math.max(tracks.first, Math.ceil(view.from)), Math.min(tracks.last, Math.floor(view.to))]);
  const fit = () => Object.assign(view, { from: tracks.first, to: tracks.first + Math.max(LEAST, tracks.last - tracks.first) });
  const x = (tick) => (tick - view.from) / (view.to - view.from) * across;
  const tickAt = (pixel) => view.from + pixel / canvas.clientWidth * (view.to - view.from);

  function draw() {
    const run = bus.latest("run");
    const levels = run?.open ? run.levels.map(({ name }) => name) : [];
    if (names.dataset.levels !== levels.join()) {
      names.dataset.levels = levels.join();
      names.replaceChildren(make("div", { class: "axis" }, "tick"), ...levels.map((name) => make("button", { type: "button", class: "plain", title: `Level ${name}`, onclick: () => bus.select({ level: name }) }, name)));
    }
    for (const button of names.querySelectorAll("button")) button.toggleAttribute("data-chosen", button.textContent === bus.selection.level);
    const [wide, high] = [canvas.clientWidth || slider.clientWidth, AXIS + ROW * levels.length + 2];
    across = wide;
    const ratio = devicePixelRatio || 1;
    if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) {
      canvas.width = Math.round(wide * ratio);
      canvas.height = Math.round(high * ratio);
      canvas.style.height = `${high}px`;
    }
    if (view.whole) fit();
    else if (bus.selection.follow && bus.selection.tick !== null && bus.selection.tick > view.to) {
      const width = view.to - view.from;
      seen({ to: bus.selection.tick + width * 0.05, from: bus.selection.tick - width * 0.95 });
    }
    const say = colours();
    const now = JSON.stringify([key, told, view, wide, high, ratio, levels, run?.tick_ms, bus.selection.level, Object.values(say)]);
    if (now !== stands) {
      stands = now;
      Object.assign(still, { width: canvas.width, height: canvas.height });
      const on = begun(still, ratio);
      if (tracks.last > tracks.first) axis(on, wide, high, say, run?.tick_ms ?? 40); // before the first cycle there is no time to draw
      levels.forEach((level, row) => track(on, level, AXIS + ROW * row, wide, say));
      marks(on, high, say);
    }
    const on = begun(canvas, ratio);
    on.clearRect(0, 0, wide, high);
    if (still.width && still.height) on.drawImage(still, 0, 0, wide, high);
    head(on, high, say);
    spoken();
  }

  function begun(one, ratio) {
    const on = one.getContext("2d");
    on.setTransform(ratio, 0, 0, ratio, 0, 0);
    on.font = "12px system-ui, sans-serif";
    on.textBaseline = "middle";
    return on;
  }

  function axis(on, wide, high, say, tickMs) {
    const rough = (view.to - view.from) / Math.max(2, wide / 90);
    const power = 10 ** Math.floor(Math.log10(Math.max(1, rough)));
    const step = Math.max(1, [1, 2, 5, 10].map((times) => times * power).find((size) => size >= rough) ?? 10 * power);
    on.textAlign = "left";
    for (let tick = Math.ceil(view.from / step) * step; tick <= view.to; tick += step) {
      const at = Math.round(x(tick)) + 0.5;
      on.strokeStyle = say.edge;
      on.beginPath(); on.moveTo(at, AXIS - 5); on.lineTo(at, high); on.stroke();
      on.fillStyle = say.soft;
      on.fillText(`${tick}`, at + 3, AXIS / 2);
      const left = on.measureText(`${tick}`).width;
      if (x(step) - x(0) > 86) { on.globalAlpha = 0.75; on.fillText(` ${atSecond(tick, tickMs, step * tickMs)}`, at + 3 + left, AXIS / 2); on.globalAlpha = 1; }
    }
  }

  // A change at tick t stands from the cycle of tick t on: it is drawn from t - 1 to the next change's t - 1.
  function track(on, level, top, wide, say) {
    const held = tracks.levels.get(level) ?? [];
    const begin = Math.max(0, standing(level, view.from).at);
    let drawn = -1;
    for (let at = begin; at < held.length; at += 1) {
      const [tick, table, line, fault] = held[at];
      const left = Math.max(-1, x(tick - 1)), right = Math.min(wide + 1, x((held[at + 1]?.[0] ?? tracks.last + 1) - 1));
      if (left > wide) break;
      if (!table && !line && !fault) continue;
      if (right - drawn < 0.75 && !fault) continue; // many changes in one pixel: one of them stands for all
      on.fillStyle = fault ? say.bad : tint(table, at);
      on.fillRect(left, top + 1, Math.max(1, right - left), ROW - 2);
      drawn = right;
      if (right - left > 3) { on.fillStyle = say["strong-edge"]; on.fillRect(left, top + 1, 1, ROW - 2); }
      if (right - left > 16) {
        const room = right - Math.max(0, left) - 6;
        const text = [`${table} ${line || "-"}`, line || "-"].map((one) => fault ? `✗ ${one}` : one).find((one) => on.measureText(one).width <= room);
        if (text) { on.fillStyle = fault ? say.paper : say.ink; on.fillText(text, Math.max(0, left) + 4, top + ROW / 2); }
      }
    }
    on.fillStyle = say.edge;
    on.fillRect(0, top + ROW - 0.5, wide, 0.5);
    if (level === bus.selection.level) { on.strokeStyle = say.accent; on.strokeRect(0.5, top + 0.5, wide - 1, ROW - 1); }
  }

  function marks(on, high, say) {
    for (const { tick, kind } of tracks.marks) {
      const at = x(tick);
      if (at < -5 || at > across + 5) continue;
      on.fillStyle = kind === "finding" ? say.bad : kind === "stop" ? say.accent : say.warn;
      on.beginPath();
      if (kind === "hand") on.arc(at, AXIS - 4, 3, 0, 7);
      else { on.moveTo(at - 4, AXIS - 8); on.lineTo(at + 4, AXIS - 8); on.lineTo(at, AXIS - 1); }
      on.fill();
      if (kind === "finding") on.fillRect(at - 0.5, AXIS, 1, high);
    }
  }

  function head(on, high, say) {
    const { tick } = bus.selection;
    if (tick === null) return;
    const at = x(tick);
    const left = x(tick - 1);
    on.fillStyle = say.accent;
    on.globalAlpha = 0.18;
    on.fillRect(left, AXIS, Math.max(1, at - left), high);
    on.globalAlpha = 1;
    on.fillRect(Math.round(at) - 1, 0, 2, high);
    const text = `${tick}`;
    const room = on.measureText(text).width + 8;
    const place = Math.min(across - room, Math.max(0, at - room / 2));
    on.fillRect(place, 0, room, AXIS - 3);
    on.fillStyle = dark() ? "#0d1318" : "#ffffff";
    on.fillText(text, place + 4, (AXIS - 3) / 2);
  }

  function spoken() {
    const run = bus.latest("run"), { tick } = bus.selection;
    if (!run?.open || tick === null || tracks.era < 0) { readout.textContent = ""; return; }
    const lines = run.levels.map(({ name }) => { const stands = standing(name, tick).change; return stands ? `${name} ${stands[1]} ${stands[2] || "-"}` : name; });
    const here = tracks.marks.filter((mark) => mark.tick === tick).map(({ text }) => text);
    const text = `tick ${tick} of ${run.last}, ${atSecond(tick, run.tick_ms)}${here.length ? `; here: ${here.join("; ")}` : ""}${tracks.to < tracks.last ? `; reading which lines ran: tick ${Math.max(0, tracks.to)} of ${tracks.last}` : ""}`;
    if (readout.textContent !== text) { readout.textContent = text; readout.title = text; }
    slider.setAttribute("aria-valuemin", run.first);
    slider.setAttribute("aria-valuemax", run.last);
    slider.setAttribute("aria-valuenow", tick);
    slider.setAttribute("aria-valuetext", `${text}; ${lines.join(", ")}`);
  }

  // --- by mouse ---

  let dragging = null;
  slider.addEventListener("pointerdown", (event) => {
    if (tracks.era < 0) return; // nothing is drawn yet of this run that could be meant
    slider.setPointerCapture(event.pointerId);
    slider.focus({ preventScroll: true });
    dragging = event.shiftKey || event.button === 1 ? { from: view.from, to: view.to, x: event.offsetX } : "scrub";
    const row = Math.floor((event.offsetY - AXIS) / ROW);
    const level = bus.latest("run")?.levels?.[row]?.name;
    if (row >= 0 && level) bus.select({ level });
    move(event);
  });
  function move(event) {
    if (dragging === "scrub") lookAt(bus, Math.ceil(tickAt(event.clientX - canvas.getBoundingClientRect().left)));
    else if (dragging) {
      const by = (dragging.x - (event.clientX - canvas.getBoundingClientRect().left)) / canvas.clientWidth * (dragging.to - dragging.from);
      seen({ whole: false, from: dragging.from + by, to: dragging.to + by });
    }
  }
  slider.addEventListener("pointermove", (event) => { if (dragging) move(event); });
  for (const kind of ["pointerup", "pointercancel"]) slider.addEventListener(kind, () => { dragging = null; });
  slider.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) pan((event.deltaX || event.deltaY) / canvas.clientWidth);
    else zoom(event.deltaY > 0 ? 1.25 : 0.8, tickAt(event.offsetX));
  }, { passive: false });
  function zoom(times, around = bus.selection.tick ?? view.from) {
    const width = Math.min(Math.max(LEAST, (view.to - view.from) * times), Math.max(LEAST, tracks.last - tracks.first));
    const part = (around - view.from) / (view.to - view.from);
    seen({ whole: width >= tracks.last - tracks.first, from: around - width * part, to: around + width * (1 - part) });
  }
  function pan(by) {
    const width = view.to - view.from;
    seen({ whole: false, from: view.from + by * width, to: view.to + by * width });
  }

  // --- by keys ---

  const here = () => bus.selection.tick ?? 0;
  const go = (tick) => lookAt(bus, tick);
  function change(step) {
    const levels = bus.selection.level ? [bus.selection.level] : (bus.latest("run")?.levels ?? []).map(({ name }) => name);
    const ticks = levels.flatMap((level) => {
      const { at } = standing(level, step > 0 ? here() : here() - 1);
      return [(tracks.levels.get(level) ?? [])[step > 0 ? at + 1 : at]?.[0]].filter((tick) => tick !== undefined);
    });
    if (ticks.length) go(step > 0 ? Math.min(...ticks) : Math.max(...ticks));
    else bus.say(step > 0 ? "no later change" : "no earlier change");
  }
  function mark(step) {
    const ticks = tracks.marks.map(({ tick }) => tick).filter((tick) => step > 0 ? tick > here() : tick < here());
    if (ticks.length) go(step > 0 ? Math.min(...ticks) : Math.max(...ticks));
    else bus.say(step > 0 ? "no later mark" : "no earlier mark");
  }
  async function search(back) {
    const text = find.value.trim();
    if (!text) return find.focus();
    const stop = new AbortController(), cancel = () => stop.abort();
    const told = ({ done, of }) => bus.say(`looking for ${text}: ${Math.round(100 * done / Math.max(1, of))} %`, { cancel });
    const found = await bus.try("time.find", { text, tick: here(), back }, { signal: stop.signal, progress: told });
    if (found) { if (bus.latest("said")?.cancel === cancel) bus.say("");
      if (found.tick === null) bus.say(`no ${back ? "earlier" : "later"} tick in which ${text}`); else go(found.tick); }
    return undefined;
  }
  function toLine({ level, table, line, back }) {
    const held = tracks.levels.get(level) ?? [];
    const ticks = held.filter(([tick, of, name]) => of === table && name === line && (back ? tick < here() : tick > here())).map(([tick]) => tick);
    if (ticks.length) go(back ? ticks.at(-1) : ticks[0]);
    else bus.say(`line ${line} of ${table} did not begin to match ${back ? "before" : "after"} this tick`);
  }
  bus.on("to-line", (where) => { if (where.level) toLine(where); });
  slider.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1, PageUp: 100, PageDown: -100 }[event.key];
    if (by && event.shiftKey && Math.abs(by) === 1) change(by);
    else if (by) go(here() + by);
    else if (event.key === "Home") go(tracks.first);
    else if (event.key === "End") go(tracks.last);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  for (const [keys, what, run] of [
    ["[", "The tick before", () => go(here() - 1)], ["]", "The tick after", () => go(here() + 1)],
    ["{", "The change of line before, of the level chosen", () => change(-1)], ["}", "The change of line after", () => change(1)],
    ["+, =", "Closer", () => zoom(0.6)], ["-", "Farther", () => zoom(1.7)], ["0", "The whole run", () => seen({ whole: true })],
    ...(finds ? [["m", "The next mark: a finding, a stop, what was done by hand", () => mark(1)], ["M", "The mark before", () => mark(-1)],
      ["f", "Find a tick by a condition; Enter the next, Shift+Enter the one before", () => find.focus()],
      ["n", "The next tick found", () => search(false)], ["N", "The one before", () => search(true)]] : []),
    ["e", "To the end, and follow the run", () => go(tracks.last)],
    ["l", "To the time line itself: arrows, Page, Home, End", () => slider.focus()],
  ]) bus.key(keys, what, run, "Time line");

  find.addEventListener("keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); search(event.shiftKey); } if (event.key === "Escape") slider.focus(); });
  const button = (text, title, run) => make("button", { type: "button", title, onclick: run }, text);
  bar.append(readout, ...playing(bus, shownTicks), button("⇤ change", "The change of line before, of the level chosen: {", () => change(-1)), button("change ⇥", "The change of line after: }", () => change(1)),
    ...(finds ? [button("⇤ mark", "The mark before: M", () => mark(-1)), button("mark ⇥", "The next mark: m", () => mark(1))] : []),
    ...(finds ? [find, button("Before", "The tick before in which it holds: N", () => search(true)), button("Next", "The next tick in which it holds: n", () => search(false))] : []),
    button("−", "Farther", () => zoom(1.7)), button("+", "Closer", () => zoom(0.6)), button("All", "The whole run: 0", () => seen({ whole: true })));

  bus.on("selection", soon);
  bus.on("theme", soon);
  new ResizeObserver(soon).observe(slider);
}
