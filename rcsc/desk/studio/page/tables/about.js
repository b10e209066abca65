// Ways about a large graph: a small picture of the whole, in which the view is dragged, and a search for states and lines.

import { colour, make } from "../make.js";

const WIDE = 190, HIGH = 130;

/** A picture of the whole graph for the corner of its place; shown where that is larger than the view. */
export function overview(place) {
  const canvas = make("canvas", { class: "minimap", hidden: true, title: "The whole graph: drag to go elsewhere in it", "aria-hidden": "true" });
  const svgOf = () => place.querySelector("svg");
  const sizeOf = (svg) => svg.viewBox.baseVal;

  /** The part of the graph that is seen, in its own lengths: left, top, width, height. */
  function seen(svg) {
    const [view, whole] = [place.getBoundingClientRect(), svg.getBoundingClientRect()], scale = whole.width / sizeOf(svg).width;
    return [(view.left - whole.left) / scale, (view.top - whole.top) / scale, place.clientWidth / scale, place.clientHeight / scale];
  }

  function draw() {
    const svg = svgOf();
    canvas.hidden = !svg || (place.scrollWidth <= place.clientWidth + 4 && place.scrollHeight <= place.clientHeight + 4);
    if (canvas.hidden) return;
    const { width, height } = sizeOf(svg), times = Math.min(WIDE / width, HIGH / height), ratio = devicePixelRatio || 1;
    Object.assign(canvas, { width: Math.ceil(width * times * ratio), height: Math.ceil(height * times * ratio) });
    Object.assign(canvas.style, { width: `${width * times}px`, height: `${height * times}px` });
    const on = canvas.getContext("2d");
    on.setTransform(times * ratio, 0, 0, times * ratio, 0, 0);
    const rect = (one) => ["x", "y", "width", "height"].map((name) => Number(one.getAttribute(name)));
    on.fillStyle = colour("edge");
    for (const one of svg.querySelectorAll(".frame > rect.body, .label .back")) on.fillRect(...rect(one));
    for (const one of svg.querySelectorAll(".box .state > rect")) {
      on.fillStyle = colour(one.closest(".here") ? "lit" : one.closest(".found") ? "good" : "accent");
      on.fillRect(...rect(one));
    }
    on.strokeStyle = colour("ink");
    on.lineWidth = 1.5 / times;
    on.strokeRect(...seen(svg));
  }

  function go({ offsetX, offsetY }) {
    const svg = svgOf(), [left, top, width, height] = seen(svg), { width: whole } = sizeOf(svg);
    const times = canvas.clientWidth / whole, scale = svg.getBoundingClientRect().width / whole;
    place.scrollBy((offsetX / times - left - width / 2) * scale, (offsetY / times - top - height / 2) * scale);
  }
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); go(event); });
  canvas.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
  place.addEventListener("scroll", draw);
  new ResizeObserver(draw).observe(place);
  return { canvas, draw };
}

/** A field that finds states and lines by name, then lines by what they say; `say` tells which is shown. */
export function finder(place, say, drawn) {
  let found = [], at = 0;
  const field = make("input", { class: "filter", size: "11", type: "search", "aria-label": "Find a state or a line: Enter the next, Shift+Enter the one before", placeholder: "find …  /", spellcheck: "false" });
  const nameOf = (one) => one.dataset.state ?? one.dataset.line ?? "";
  function look() {
    const text = field.value.trim().toLowerCase(), every = [...place.querySelectorAll("[data-focus]")];
    const named = every.filter((one) => nameOf(one).toLowerCase().includes(text));
    found = text ? [...named, ...every.filter((one) => !named.includes(one) && one.getAttribute("aria-label").toLowerCase().includes(text))] : [];
    at = 0;
    mark();
  }
  function mark() {
    for (const one of place.querySelectorAll(".found")) one.classList.remove("found");
    const one = found[at];
    one?.classList.add("found");
    drawn();
    if (one) say(`${at + 1} of ${found.length}: ${one.getAttribute("aria-label")}`);
    else if (field.value.trim()) say(`no state or line of this graph has ${field.value.trim()}`);
  }
  function show() {
    mark();
    found[at]?.scrollIntoView({ block: "center", inline: "center" });
  }
  field.addEventListener("input", () => { look(); show(); });
  field.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && found.length) { event.preventDefault(); at = (at + (event.shiftKey ? found.length - 1 : 1)) % found.length; show(); }
    if (event.key === "Escape") { field.value = ""; look(); place.focus(); }
  });
  return { field, again: () => { if (field.value.trim()) look(); } };
}
