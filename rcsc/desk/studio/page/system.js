// The system as a picture: levels one below the other, who stands outside beside them, and every buffer as an arrow, with what it holds now.
//
// A buffer that is clicked is told, broken and mended; one that is broken is red.

import { doLine } from "./bus.js";
import { make, spoken } from "./make.js";

const [WIDE, HIGH, GAP, SIDE, OUTSIDE, APART] = [210, 58, 92, 250, 130, 16]; // of levels: width, height, gap; of who stands outside: distance, width; between wires
const SVG = "http://www.w3.org/2000/svg";

const draw = (kind, attributes, ...inside) => {
  const made = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...inside);
  return made;
};

export function mount(root, bus) {
  const place = make("div", { class: "system scroll", tabindex: "0" }), told = make("div", { class: "bar told-wire", role: "status" });
  root.append(place, told);
  let chosen = "", known = "", wires = new Map(), boxes = new Map();

  function build(run) {
    const now = JSON.stringify([run.levels.map(({ name }) => name), run.buffers.map(({ name, to }) => [name, to])]);
    if (now === known) return;
    known = now;
    const plan = laidOut(run.levels.map(({ name }) => name), run.buffers);
    wires = new Map();
    boxes = new Map();
    const svg = draw("svg", { viewBox: `0 0 ${plan.wide} ${plan.high}`, width: plan.wide, height: plan.high, role: "group", "aria-label": "Levels, who stands outside, and the buffers between them" },
      draw("defs", {}, ...["edge", "bad", "accent"].map((name) => draw("marker", { id: `to-${name}`, viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 8, markerHeight: 8, orient: "auto-start-reverse", class: `tip-${name}` }, draw("path", { d: "M0,0L8,4L0,8z" })))));
    for (const wire of plan.wires) svg.append(arrow(wire));
    for (const box of plan.boxes) svg.append(boxOf(box, run));
    place.replaceChildren(svg);
  }

  function boxOf({ name, level, x, y, wide, high }, run) {
    const says = draw("text", { x: x + wide / 2, y: y + high - 14, "text-anchor": "middle", class: "runs" });
    const box = draw("g", level ? { class: "level", tabindex: "0", role: "button", "aria-label": `Level ${name}` } : { class: "party" },
      draw("rect", { x, y, width: wide, height: high, rx: 6 }), draw("text", { x: x + wide / 2, y: level ? y + 24 : y + high / 2 + 4, "text-anchor": "middle", class: "name" }, name), says);
    if (level) {
      const choose = () => bus.select({ level: name });
      box.addEventListener("click", choose);
      box.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); event.stopPropagation(); choose(); } });
      boxes.set(name, { box, says });
    }
    return box;
  }

  function arrow({ name, to, path, at, anchor }) {
    const says = draw("text", { x: at[0], y: at[1], "text-anchor": anchor, class: "holds" });
    const line = draw("g", { class: "wire", tabindex: "0", role: "button", "aria-label": `Buffer ${name} to ${to}` },
      draw("path", { d: path, class: "reach" }), draw("path", { d: path, class: "line" }), says);
    const choose = () => { chosen = chosen === name ? "" : name; show(); };
    line.addEventListener("click", choose);
    line.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); event.stopPropagation(); choose(); } });
    wires.set(name, [...(wires.get(name) ?? []), { line, says, to }]);
    return line;
  }

  function show() {
    const run = bus.latest("run"), moment = bus.latest("moment");
    root.classList.toggle("none", !run?.open);
    if (!run?.open || !run.buffers) {
      known = "";
      const why = run?.open ? "A log is looked at: what lay between its levels stands at each level." : bus.latest("run.state")?.why ?? "Connecting …";
      place.replaceChildren(make("p", { class: "closed soft" }, ...spoken(why)));
      told.replaceChildren();
      return;
    }
    build(run);
    const levels = new Map((moment?.levels ?? []).map((box) => [box.level, box]));
    for (const [name, { box, says }] of boxes) {
      const now = levels.get(name), line = now?.lines.join(" and ") || "-";
      says.textContent = now?.table ? `${now.table} ${line}` : "";
      box.classList.toggle("chosen", bus.selection.level === name);
      box.classList.toggle("wrong", Boolean(now?.fault || now?.wrong));
    }
    for (const { name, frozen } of run.buffers) {
      for (const wire of wires.get(name) ?? []) {
        const held = holds(levels, name, wire.to);
        wire.says.textContent = frozen ? "✗ broken" : held?.text ?? name.split(".").slice(1).join(".");
        wire.line.classList.toggle("broken", frozen);
        wire.line.classList.toggle("fresh", Boolean(held?.fresh) && !frozen);
        wire.line.classList.toggle("chosen", chosen === name);
        wire.line.setAttribute("aria-pressed", chosen === name);
      }
    }
    tell(run, levels);
  }

  function tell(run, levels) {
    const one = run.buffers.find(({ name }) => name === chosen);
    if (!one) return told.replaceChildren(make("span", { class: "soft" }, "Click a buffer to see what it holds, and to break or mend it."));
    const held = one.to.split(", ").map((to) => holds(levels, one.name, to)).find(Boolean), live = run.source === "live";
    return told.replaceChildren(make("span", { class: one.frozen ? "wrong grow" : "grow" }, make("code", {}, one.name), " → ", make("code", {}, one.to), one.frozen ? " is broken: what is written to it is lost" : held ? ` holds ${held.text}${held.fields ? `; ${held.fields}` : ""}` : ""),
      make("button", { type: "button", disabled: !live, onclick: () => doLine(bus, `${one.frozen ? "thaw" : "freeze"} ${one.name}`) }, one.frozen ? "Mend it" : "Break it"));
  }

  let due = false;
  const soon = () => { if (!due) { due = true; requestAnimationFrame(() => { due = false; show(); }); } };
  bus.on("run", soon);
  bus.on("run.state", soon);
  bus.on("moment", soon);
  bus.on("selection", (_, changed) => { if (!changed || changed.has("level")) soon(); });
  return { shown: soon };
}

/** What a buffer holds, by what the levels at its ends took and gave: { text, fields, fresh }; undefined where none of them says. */
function holds(levels, name, to) {
  const ends = [name, to].map((end) => { const [level, ...rest] = end.split("."); return { box: levels.get(level), own: rest.join(".") }; });
  for (const { box, own } of ends) {
    for (const { order, report } of [...(box?.above ?? []), ...(box?.below ?? [])]) {
      const fields = (one) => one.fields.map(({ name: field, value }) => `${field} ${value}`).join(", ");
      if (order?.buffer === own) return { text: `${order.number === null ? "" : `${order.number} `}${order.command}`, fields: fields(order), fresh: order.new };
      if (report?.buffer === own) return { text: `${report.echo === null ? "" : `${report.echo} `}${report.status}`, fields: fields(report), fresh: false };
    }
    const came = box?.inputs.find(({ name: input }) => input === own);
    if (came) return { text: String(came.value).replace(/(\.\d{3})\d+/, "$1"), fields: "", fresh: false };
  }
  return undefined;
}

/** Where everything stands: levels from the top down, who is outside on the side with more room, wires beside one another. */
function laidOut(levels, buffers) {
  const ends = buffers.flatMap(({ name, to }) => to.split(", ").map((end) => ({ name, to: end, from: name.split(".")[0], into: end.split(".")[0] })));
  const outside = [...new Set(ends.flatMap(({ from, into }) => [from, into]))].filter((one) => !levels.includes(one));
  const left = SIDE + OUTSIDE, middle = left + WIDE / 2;
  const top = (at) => 24 + at * (HIGH + GAP);
  const boxes = levels.map((name, at) => ({ name, level: true, x: left, y: top(at), wide: WIDE, high: HIGH }));
  const sides = [[], []]; // what stands left and right, from the top down
  const meets = (one) => ends.find(({ from, into }) => from === one || into === one);
  const many = (one) => ends.filter(({ from, into }) => from === one || into === one).length;
  for (const one of outside) {
    const { from, into } = meets(one), at = levels.indexOf(from === one ? into : from);
    const high = Math.max(HIGH, APART * (many(one) + 1));
    const want = top(Math.max(0, at)), side = bottom(sides[0]) <= bottom(sides[1]) ? 0 : 1;
    sides[side].push({ name: one, level: false, x: side ? left + WIDE + SIDE : 0, y: Math.max(want, bottom(sides[side]) + 18), wide: OUTSIDE, high });
  }
  const every = [...boxes, ...sides[0], ...sides[1]], by = new Map(every.map((box) => [box.name, box]));
  const used = new Map(); // by where wires leave or come: how many there are
  const next = (key) => { used.set(key, (used.get(key) ?? 0) + 1); return used.get(key); };
  const wires = ends.map((wire) => ({ ...wire, ...routed(by.get(wire.from), by.get(wire.into), levels, next) }));
  return { boxes: every, wires, wide: 2 * (SIDE + OUTSIDE) + WIDE, high: Math.max(...every.map(({ y, high }) => y + high)) + 24 };
}

const bottom = (boxes) => (boxes.length ? boxes.at(-1).y + boxes.at(-1).high : 0);

function routed(from, into, levels, next) {
  if (from.level && into.level) {
    const down = levels.indexOf(into.name) - levels.indexOf(from.name);
    const [upper, lower] = down > 0 ? [from, into] : [into, from];
    if (Math.abs(down) === 1) { // orders go down on the left half, reports up on the right
      const at = next(`${upper.name} ${down > 0}`), x = upper.x + WIDE / 2 + (down > 0 ? -1 : 1) * (10 + (at - 1) * APART);
      const [y1, y2] = [upper.y + HIGH, lower.y];
      return { path: down > 0 ? `M${x},${y1}L${x},${y2}` : `M${x},${y2}L${x},${y1}`, at: [x + (down > 0 ? -6 : 6), y1 + 20 + (at - 1) * 15], anchor: down > 0 ? "end" : "start" };
    }
    const at = next(`beside ${down > 0}`), out = (down > 0 ? upper.x - 24 - at * APART : upper.x + WIDE + 24 + at * APART), edge = down > 0 ? upper.x : upper.x + WIDE;
    const [y1, y2] = [from.y + HIGH / 2 + 8, into.y + HIGH / 2 - 8];
    return { path: `M${edge},${y1}H${out}V${y2}H${edge}`, at: [out + (down > 0 ? -4 : 4), (y1 + y2) / 2], anchor: down > 0 ? "end" : "start" };
  }
  const level = from.level ? from : into, party = from.level ? into : from, onLeft = party.x < level.x;
  const at = next(`${party.name}`), y = party.y + at * APART, edge = onLeft ? level.x : level.x + WIDE, other = onLeft ? party.x + party.wide : party.x;
  const into_ = Math.min(level.y + HIGH - 8, Math.max(level.y + 8, y)), turn = edge + (onLeft ? -1 : 1) * (12 + 6 * (at % 6));
  const points = [[other, y], [turn, y], [turn, into_], [edge, into_]];
  if (from.level) points.reverse();
  return { path: `M${points.map((point) => point.join(",")).join("L")}`, at: [other + (onLeft ? 8 : -8), y - 3], anchor: onLeft ? "start" : "end" };
}
