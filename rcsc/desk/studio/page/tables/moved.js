// States that somebody moved: where they stand instead, what that does to their arrows, and what the browser keeps of it.

const PAD = 10;

const key = (name) => `studio.graph ${name}`;
/** How far each state of a graph was moved, by name: [right, down] in pixels of the drawing. */
export function movedOf(name) {
  try { return JSON.parse(localStorage.getItem(key(name))) ?? {}; } catch { return {}; }
}
export function keepMoved(name, moved) {
  try {
    if (Object.keys(moved).length) localStorage.setItem(key(name), JSON.stringify(moved));
    else localStorage.removeItem(key(name));
  } catch { /* a private window keeps nothing */ }
}

const middle = ({ corner: [x, y], size: [width, height] }) => [x + width / 2, y + height / 2];

/** Where a line from the middle of a box to a point leaves it. */
function border(box, [a, b]) {
  const [x, y] = middle(box), [right, down] = [a - x, b - y];
  const share = Math.min(box.size[0] / 2 / Math.max(Math.abs(right), 1e-6), box.size[1] / 2 / Math.max(Math.abs(down), 1e-6), 1);
  return [x + right * share, y + down * share];
}

/** A straight piece, as the curves of a sheet are: its end is short of the tip where it has one. */
function straight(from, to, tip = 0) {
  const far = Math.max(1e-6, Math.hypot(to[0] - from[0], to[1] - from[1])), share = Math.max(0, (far - tip) / far);
  const end = [from[0] + (to[0] - from[0]) * share, from[1] + (to[1] - from[1]) * share];
  return [from, from, end, end];
}

/** A sheet with some of its states moved: arrows from and to them go straight, by their labels; frames grow with their states. */
export function arranged(sheet, moved) {
  if (!sheet.boxes.some(({ name }) => moved[name])) return sheet;
  const by = ({ corner: [x, y], ...box }, [right, down]) => ({ ...box, corner: [Math.max(0, x + right), Math.max(0, y + down)] });
  const boxes = sheet.boxes.map((box) => (moved[box.name] ? by(box, moved[box.name]) : box));
  const frames = sheet.frames.map((frame) => {
    const inside = boxes.filter(({ name, states }) => moved[name] && states.length && states.every((one) => frame.states.includes(one)));
    const left = Math.min(frame.corner[0], ...inside.map(({ corner }) => corner[0] - PAD)), top = Math.min(frame.corner[1], ...inside.map(({ corner }) => corner[1] - PAD));
    const right = Math.max(frame.corner[0] + frame.size[0], ...inside.map(({ corner, size }) => corner[0] + size[0] + PAD)), low = Math.max(frame.corner[1] + frame.size[1], ...inside.map(({ corner, size }) => corner[1] + size[1] + PAD));
    return { ...frame, corner: [left, top], size: [right - left, low - top] };
  });
  const at = (name) => boxes.find((box) => box.name === name) ?? frames.find((frame) => frame.name === name);
  const arrows = sheet.arrows.map((arrow) => {
    const [from, to] = [moved[arrow.source], moved[arrow.target]];
    if (!from && !to) return arrow;
    const alike = from && to && from[0] === to[0] && from[1] === to[1];
    const label = arrow.label && alike ? by(arrow.label, from) : arrow.label;
    const [source, target] = [at(arrow.source), at(arrow.target)], by_ = label ? middle(label) : null;
    const end = border(target, by_ ?? middle(source)), begin = border(source, by_ ?? middle(target));
    const curves = label ? [straight(begin, border(label, begin)), straight(border(label, end), end, 9)] : [straight(begin, end, 9)];
    return { ...arrow, label, curves, tip: end };
  });
  const all = [...boxes, ...frames];
  const width = Math.max(sheet.width, ...all.map(({ corner, size }) => corner[0] + size[0] + 16)), height = Math.max(sheet.height, ...all.map(({ corner, size }) => corner[1] + size[1] + 16));
  return { ...sheet, boxes, frames, arrows, width, height };
}
