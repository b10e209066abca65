// The graph of the table that is shown: states, composite states, and an arrow for each line; linked to the rows, and drawn in.

import { make, Refusal } from "../bus.js";
import { spoken } from "../make.js";
import { finder, overview } from "./about.js";
import { deskOf, SIGNS } from "./desk.js";
import { arranged, keepMoved, movedOf } from "./moved.js";

const SVG = "http://www.w3.org/2000/svg";
function put(kind, attributes = {}, ...inside) {
  const made = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) if (value !== undefined && value !== null) made.setAttribute(name, value);
  made.append(...inside.filter((one) => one !== null && one !== undefined));
  return made;
}
const TEXT = 16, LEFT = 8, LEAST = 0.05;

export function mount(root, bus) {
  const desk = deskOf(bus);
  const words = make("span", { class: "graph-words" }), proof = make("span", { class: "graph-proof standing" });
  const state = make("input", { class: "filter", size: "14", "aria-label": "Variable whose values are the states", placeholder: "state variable", spellcheck: "false" });
  const zooms = [["−", "Smaller", 1 / 1.25], ["+", "Larger", 1.25]].map(([text, what, by]) => make("button", { type: "button", title: what, "aria-label": what, onclick: () => zoom(by) }, text));
  const fit = make("button", { type: "button", title: "The whole graph in the view: f", onclick: () => fitted() }, "Fit");
  const all = make("button", { type: "button", title: "Shut or open every composite state", onclick: () => shutAll() }, "Shut all");
  const back = make("button", { type: "button", hidden: true, title: "Every state where it stood before it was moved", onclick: () => putBack() }, "Put back");
  const place = make("div", { class: "graph-place", "data-keys": "own", tabindex: "-1" });
  const whole = make("div", { class: "graph-whole", role: "status", "aria-live": "polite" });
  const map = overview(place), find = finder(place, (text) => say(text), () => map.draw());
  root.append(make("div", { class: "bar" }, find.field, make("form", { onsubmit: (event) => { event.preventDefault(); chosen.set(named, state.value.trim()); ask(true); } }, state), all, back, ...zooms, fit, proof, words), make("div", { class: "graph-room" }, place, map.canvas), whole);

  let laid = null, moved = {}, left = null; // the sheet as it came, how far its states were moved, and where its left end stays meanwhile
  let shown = null, key = "", scale = 1, asking = null, from = null, hint = "", said = [], drawn = null;
  const shut = new Map(); // by file and table: a set
  const chosen = new Map(); // by file and table: the state variable that was named

  let named = "";
  const hidden = () => { const name = `${desk.file} ${desk.table}`; if (!shut.has(name)) shut.set(name, new Set()); return shut.get(name); };

  function tellBeside(...several) {
    words.textContent = several.join(" · ");
    words.title = several.join("\n");
  }

  async function ask(force = false) {
    if (!root.isConnected || !desk.doc?.known || !desk.table) return;
    if (named !== `${desk.file} ${desk.table}`) {
      named = `${desk.file} ${desk.table}`;
      state.value = chosen.get(named) ?? "";
    }
    const now = JSON.stringify([desk.file, desk.doc.version, desk.table, [...hidden()], state.value]);
    if (now === key && !force) return;
    key = now;
    asking?.abort();
    asking = new AbortController();
    if (shown && (shown.file !== desk.file || shown.table !== desk.table)) { shown = null; place.replaceChildren(); }
    if (!shown) tellBeside("deriving the graph …");
    const { signal } = asking;
    place.classList.add("stale");
    try {
      const answer = await desk.ask("graph.show", { shut: [...hidden()].map((name) => ({ name })), state: state.value.trim() }, { signal });
      if (signal.aborted || answer.table !== desk.table) return;
      const other = !shown;
      place.classList.remove("stale");
      laid = { ...answer, file: desk.file };
      moved = movedOf(named);
      left = null;
      draw();
      if (other) begun();
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      if (signal.aborted || error.message.includes("meanwhile")) return;
      if (!desk.doc.whole && shown?.table === desk.table) { tellBeside("The graph is of the last text that was in order."); return; }
      shown = null;
      place.classList.remove("stale");
      place.replaceChildren(make("p", { class: "soft no-graph" }, "No graph: ", ...spoken(error.message), ".", ...error.helps.map((help) => make("span", {}, " Help: ", ...spoken(help.replace("`--state`", "the field above")), "."))));
      tellBeside("");
    }
  }

  // --- drawing ---

  function draw() {
    shown = arranged(laid, moved);
    back.hidden = shown === laid;
    const held = document.activeElement?.closest?.(".graph-place [data-focus]")?.dataset.focus;
    const svg = put("svg", { viewBox: `0 0 ${shown.width} ${shown.height}`, width: shown.width * scale, height: shown.height * scale, role: "group", "aria-label": `Graph of table ${shown.table}` });
    if (left !== null) svg.style.marginLeft = `${left}px`; // what grows to the right does not slip from under the hand
    const over = put("g", {});
    for (const frame of shown.frames) svg.append(framed(frame));
    for (const [at, arrow] of shown.arrows.entries()) {
      svg.append(curve(arrow, at));
      if (arrow.label) over.append(labelled(arrow, at));
    }
    for (const box of shown.boxes) svg.append(boxed(box));
    svg.append(over);
    place.replaceChildren(svg);
    said = [`states: values of ${shown.state}`, shown.everywhere && `on every arrow from a state also: ${shown.everywhere}`, ...shown.notes].filter(Boolean);
    all.disabled = !shown.composites.length;
    all.textContent = hidden().size ? "Open all" : "Shut all";
    if (held) place.querySelector(`[data-focus="${CSS.escape(held)}"]`)?.focus({ preventScroll: true });
    marks();
    find.again();
  }

  function rowsOf(parent, box, arrow = null) {
    const [x, y] = box.corner;
    box.rows.forEach((row, number) => {
      const top = y + row.top_px;
      const group = put("g", { class: row.line ? "row" : "words", "data-line": row.line || null });
      if (row.line) {
        Object.entries({ tabindex: "0", role: "button", "data-focus": `${arrow ?? box.name} ${row.line} ${number}`, "aria-label": row.whole }).forEach(([name, value]) => group.setAttribute(name, value));
        group.append(put("rect", { class: "back", x: x + 2, y: top, width: box.size[0] - 4, height: row.height_px, rx: 4 }));
        group.append(put("rect", { class: "badge", x: x + LEFT, y: top, width: row.badge_px - 4, height: 16, rx: 8 }), put("text", { class: "number", x: x + LEFT + (row.badge_px - 4) / 2, y: top + 12 }, row.line));
        group.addEventListener("click", () => { bus.select({ table: desk.table, line: row.line }); say(row.whole); });
      }
      row.texts.forEach(([kind, text], at) => group.append(put("text", { class: kind, x: x + LEFT + row.badge_px, y: top + 12 + at * TEXT }, text)));
      group.append(put("title", {}, row.whole));
      group.addEventListener("focusin", () => say(row.whole));
      group.addEventListener("pointerenter", () => say(row.whole));
      parent.append(group);
    });
  }

  function framed(frame) {
    const [x, y] = frame.corner, [width, height] = frame.size;
    const group = put("g", { class: "frame", "data-name": frame.name }, put("rect", { class: "body", x, y, width, height, rx: 10 }));
    const { heading } = frame;
    const [left, top] = heading.corner;
    const head = put("g", { class: "row head", tabindex: "0", role: "button", "aria-expanded": "true", "data-focus": `frame ${frame.name}`, "aria-label": `Composite state of ${frame.states.join(", ")}: shut it` },
      put("rect", { class: "back", x: left, y: top, width: heading.size[0], height: 20, rx: 4 }));
    head.addEventListener("click", () => toggle(frame.name));
    head.append(put("text", { class: "name", x: left + LEFT, y: top + 15 }, `▾ ${heading.rows[0].texts[0][1]}`), put("title", {}, `${heading.rows[0].whole}\nshut it: click, or Enter`));
    head.addEventListener("focusin", () => say(heading.rows[0].whole));
    group.append(head);
    rowsOf(group, { ...heading, rows: heading.rows.slice(1) }, `frame ${frame.name}`);
    return group;
  }

  function boxed(box) {
    const [x, y] = box.corner, [width, height] = box.size;
    if (box.kind === "begin") return put("g", { class: "begin" }, put("circle", { class: "tip", cx: x + width / 2, cy: y + height / 2, r: width / 2 }, put("title", {}, "here the table begins")));
    const group = put("g", { class: `box ${box.kind}`, "data-name": box.name });
    const words_ = box.kind === "shut" ? `shut composite state of ${box.states.join(", ")}: open it` : `state ${box.name}`;
    const head = put("g", { tabindex: "0", role: "button", class: "state", "data-focus": `state ${box.name}`, "data-state": box.kind === "state" ? box.name : null, "aria-label": box.kind === "any" ? "any state" : words_ },
      put("rect", { x, y, width, height, rx: 7 }));
    head.addEventListener("focusin", () => say(box.rows.map(({ whole: text }) => text).join("\n")));
    if (box.kind === "shut") head.addEventListener("click", () => toggle(box.name));
    if (box.kind === "state" || box.kind === "shut") head.addEventListener("pointerdown", (event) => { if (event.shiftKey) pull(event, box); else if (box.kind === "state") drag(event, box); });
    group.append(head);
    rowsOf(group, box);
    for (const text of group.querySelectorAll(".words")) text.setAttribute("pointer-events", "none");
    return group;
  }

  function curve(arrow, at) {
    const group = put("g", { class: `arrow${arrow.dashed ? " dashed" : ""}`, "data-arrow": at, "data-lines": arrow.label?.rows.map(({ line }) => line).join(" ") ?? "" });
    for (const [first, ...rest] of arrow.curves) group.append(put("path", { class: "line", d: `M ${first} C ${rest.join(" ")}` }));
    const end = arrow.curves.at(-1).at(-1), [x, y] = end, [a, b] = arrow.tip;
    const far = Math.max(1e-6, Math.hypot(a - x, b - y)), across = [(-(b - y) / far) * 4, ((a - x) / far) * 4];
    group.append(put("path", { class: "tip", d: `M ${x + across[0]} ${y + across[1]} L ${x - across[0]} ${y - across[1]} L ${a} ${b} Z` }));
    return group;
  }

  function labelled(arrow, at) {
    const group = put("g", { class: "label" });
    rowsOf(group, arrow.label, `arrow ${at}`);
    return group;
  }

  function say(text) {
    whole.textContent = hint ? `${hint}\n${text}` : text;
  }

  // --- what is selected, and what runs ---

  function marks() {
    const { line, table } = bus.selection;
    const levels = desk.running;
    const now = new Set(levels.flatMap((level) => level.lines ?? []));
    const chosen = table === desk.table ? line : "";
    for (const row of place.querySelectorAll(".row[data-line]")) {
      row.classList.toggle("selected", row.dataset.line === chosen && Boolean(chosen));
      row.classList.toggle("now", now.has(row.dataset.line));
    }
    for (const arrow of place.querySelectorAll(".arrow")) {
      const lines = arrow.dataset.lines.split(" ");
      arrow.classList.toggle("selected", Boolean(chosen) && lines.includes(chosen));
      arrow.classList.toggle("now", lines.some((name) => now.has(name)));
    }
    const states = new Set(levels.map((level) => level.now?.[shown?.state]).filter(Boolean));
    for (const box of shown?.boxes ?? []) {
      const one = place.querySelector(`.box[data-name="${CSS.escape(box.name)}"]`), is = box.kind !== "any" && box.states.some((each) => states.has(each));
      if (is && desk.follows && !one?.classList.contains("here") && !place.contains(document.activeElement)) one?.scrollIntoView({ block: "nearest", inline: "nearest" });
      one?.classList.toggle("here", is);
    }
    const runs = levels.map((level) => `${level.level} is in ${level.now?.[shown?.state] ?? "?"}, line ${(level.lines ?? []).join(" and ") || "none"}`);
    if (shown) tellBeside(...runs, ...said);
    map.draw();
  }
  bus.on("selection", (_, changed) => {
    marks();
    if (changed?.has("line") && !place.contains(document.activeElement)) place.querySelector(".row.selected")?.scrollIntoView({ block: "nearest", inline: "nearest" });
  });
  bus.on("moment", marks);

  // --- composite states, and size ---

  function toggle(name) {
    if (!hidden().delete(name)) hidden().add(name);
    ask();
  }
  function shutAll() {
    const names = shown?.composites ?? [];
    const was = hidden().size;
    hidden().clear();
    if (!was) for (const name of names) hidden().add(name);
    ask();
  }
  function sized() {
    const svg = place.querySelector("svg");
    if (!svg || !shown) return;
    svg.setAttribute("width", shown.width * scale);
    svg.setAttribute("height", shown.height * scale);
    map.draw();
  }
  /** Larger or smaller; what stands at a point of the page stays there: what has the focus, or the middle. */
  function zoom(by, at = null) {
    const svg = place.querySelector("svg");
    if (!svg) return;
    const middle = (one) => { const { left, top, width, height } = one.getBoundingClientRect(); return [left + width / 2, top + height / 2]; };
    const held = document.activeElement?.closest?.(".graph-place [data-focus]");
    const [x, y] = at ?? middle(held && seen(held) ? held : place);
    const [left, top] = corner(svg), before = scale;
    scale = Math.max(LEAST, Math.min(3, scale * by));
    sized();
    const [newLeft, newTop] = corner(svg);
    place.scrollLeft += newLeft + ((x - left) / before) * scale - x;
    place.scrollTop += newTop + ((y - top) / before) * scale - y;
  }
  const corner = (one) => { const { left, top } = one.getBoundingClientRect(); return [left, top]; };
  function seen(one) {
    const box = one.getBoundingClientRect(), view = place.getBoundingClientRect();
    return box.right > view.left && box.left < view.right && box.bottom > view.top && box.top < view.bottom;
  }
  /** The whole graph in the view. */
  function fitted() {
    if (!shown || !place.clientWidth) return;
    scale = Math.max(LEAST, Math.min(1.2, (place.clientWidth - 4) / shown.width, (place.clientHeight - 4) / shown.height));
    sized();
  }

  /** Show where the table begins, in letters that can be read. */
  function begun() {
    if (!place.clientWidth) return;
    scale = Math.max(1, Math.min(1.2, (place.clientWidth - 4) / shown.width));
    sized();
    const box = shown.boxes.find(({ kind }) => kind === "begin") ?? shown.boxes[0];
    if (box) place.scrollTo({ left: Math.max(0, (box.corner[0] + box.size[0] / 2) * scale - place.clientWidth / 2), top: Math.max(0, (box.corner[1] - 24) * scale) });
  }

  place.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // without it the graph is scrolled
    event.preventDefault();
    zoom(event.deltaY < 0 ? 1.15 : 1 / 1.15, [event.clientX, event.clientY]);
  }, { passive: false });
  place.addEventListener("pointerdown", (event) => { // the ground is dragged
    if (event.button !== 0 || event.pointerType !== "mouse" || event.target.closest("[data-focus]")) return;
    const [left, top] = [place.scrollLeft + event.clientX, place.scrollTop + event.clientY];
    const move = ({ clientX, clientY }) => place.scrollTo(left - clientX, top - clientY);
    place.classList.add("dragged");
    addEventListener("pointermove", move);
    addEventListener("pointerup", () => { removeEventListener("pointermove", move); place.classList.remove("dragged"); }, { once: true });
  });

  // --- states that are moved ---

  function shift(name, right, down) {
    const [x, y] = moved[name] ?? [0, 0], [left, top] = laid.boxes.find((box) => box.name === name).corner;
    moved = { ...moved, [name]: [Math.max(-left, x + right), Math.max(-top, y + down)] };
    draw();
  }
  function putBack() {
    moved = {};
    left = null;
    keepMoved(named, moved);
    if (laid) draw();
    place.focus({ preventScroll: true });
  }
  /** Move a state by the pointer; it stays where it is let go, also when the page is loaded anew. */
  function pull(event, box) {
    if (event.button !== 0) return;
    left = corner(place.querySelector("svg"))[0] - corner(place)[0] + place.scrollLeft;
    let [x, y] = point(event);
    const move = (at) => {
      const [a, b] = point(at);
      shift(box.name, a - x, b - y);
      [x, y] = [a, b];
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", () => { removeEventListener("pointermove", move); keepMoved(named, moved); }, { once: true });
    event.preventDefault();
    event.currentTarget.focus({ preventScroll: true });
  }

  // --- drawing an arrow ---

  function begin(name) {
    desk.follow(""); // the table stays while an arrow of it is drawn
    from = name;
    hint = `An arrow from ${name}: go to the state where it ends, and press Enter; Escape leaves it.`;
    place.classList.add("choosing");
    say("");
  }
  function leave() {
    from = null;
    hint = "";
    place.querySelector(".drawing")?.remove();
    place.querySelectorAll(".target").forEach((one) => one.classList.remove("target"));
    place.classList.remove("choosing");
  }
  async function finish(target) {
    const source = from;
    leave();
    say(`drawing an arrow from ${source} to ${target} …`);
    const done = await desk.try("graph.draw", { source, target });
    say(done ? `line ${done.line}: from ${source} to ${target}` : "no arrow was drawn");
    if (!done) return;
    drawn = { text: `line ${done.line}: from ${source} to ${target}`, version: done.version };
    proved();
    bus.select({ table: desk.table, line: done.line });
    bus.say(`line ${done.line} leads from ${source} to ${target}`);
  }
  function point(event) {
    const svg = place.querySelector("svg"), box = svg.getBoundingClientRect();
    return [(event.clientX - box.left) / scale, (event.clientY - box.top) / scale];
  }
  const stateAt = (event) => document.elementFromPoint(event.clientX, event.clientY)?.closest?.("[data-state]");
  function drag(event, box) {
    if (event.button !== 0) return;
    const start = [event.clientX, event.clientY];
    let line = null;
    const move = (at) => {
      if (!line && Math.hypot(at.clientX - start[0], at.clientY - start[1]) < 8) return;
      if (!line) {
        begin(box.name);
        line = put("path", { class: "drawing" });
        place.querySelector("svg").append(line);
      }
      const [x, y] = point(at);
      line.setAttribute("d", `M ${box.corner[0] + box.size[0] / 2} ${box.corner[1] + box.size[1] / 2} L ${x} ${y}`);
      place.querySelectorAll(".target").forEach((one) => one.classList.remove("target"));
      stateAt(at)?.closest(".box").classList.add("target");
    };
    const up = (at) => {
      removeEventListener("pointermove", move);
      const target = line && stateAt(at)?.dataset.state;
      if (line && target && target !== box.name) finish(target);
      else if (line) leave();
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", up, { once: true });
    event.preventDefault();
    event.currentTarget.focus({ preventScroll: true });
  }

  place.addEventListener("keydown", (event) => {
    const focus = event.target.closest?.("[data-focus]");
    const done = () => { event.preventDefault(); event.stopPropagation(); };
    if (event.key === "Escape" && from) { done(); leave(); say("no arrow was drawn"); } else if (event.key === "a" && focus?.dataset.state && !from && !event.ctrlKey) { done(); begin(focus.dataset.state); } else if ((event.key === "Enter" || event.key === " ") && focus) {
      done();
      if (from && focus.dataset.state) finish(focus.dataset.state);
      else focus.dispatchEvent(new MouseEvent("click", { bubbles: true }));
    } else if (/^Arrow/.test(event.key) && focus && event.shiftKey && focus.classList.contains("state") && !event.ctrlKey) {
      done();
      const [right, down] = { ArrowRight: [12, 0], ArrowLeft: [-12, 0], ArrowDown: [0, 12], ArrowUp: [0, -12] }[event.key];
      if (laid.boxes.some(({ name, kind }) => name === focus.closest(".box").dataset.name && kind !== "any")) shift(focus.closest(".box").dataset.name, right, down);
      keepMoved(named, moved);
    } else if (/^Arrow/.test(event.key) && focus && !event.ctrlKey) { done(); near(focus, event.key); } else if (event.ctrlKey && event.key.toLowerCase() === "z") { done(); if (event.shiftKey) desk.redo(); else desk.undo(); } else if (event.key === "+" || event.key === "-") { done(); zoom(event.key === "+" ? 1.25 : 0.8); } else if (event.key === "f" && !event.ctrlKey) { done(); fitted(); } else if (event.key === "/") { done(); find.field.focus(); }
  });

  /** Go to what is next in a direction; only to states while an arrow is drawn. */
  function near(focus, key_) {
    const middle = (one) => { const box = one.getBoundingClientRect(); return [box.left + box.width / 2, box.top + box.height / 2]; };
    const [x, y] = middle(focus);
    const [right, down] = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] }[key_];
    let best = null, least = Infinity;
    for (const one of place.querySelectorAll(from ? "[data-state]" : "[data-focus]")) {
      const [a, b] = middle(one);
      const ahead = (a - x) * right + (b - y) * down, aside = Math.abs((a - x) * down + (b - y) * right);
      if (one !== focus && ahead > 2 && ahead + 2 * aside < least) { best = one; least = ahead + 2 * aside; }
    }
    best?.focus();
    best?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  /** What is proved of the table; and, once, with the arrow that was drawn. */
  function proved() {
    const { state: now, why } = desk.shown?.standing ?? { state: "", why: "" };
    proof.className = `graph-proof standing ${now.replaceAll(/\W+/g, "-")}`;
    proof.replaceChildren(make("strong", {}, now && `${SIGNS[now] ?? ""} ${now}`));
    proof.title = why;
    if (!drawn || !desk.doc?.known || desk.doc.version < drawn.version) return;
    say(`${drawn.text}\n${now}: ${why}`);
    drawn = null;
  }

  desk.on(() => { proved(); ask(); });
  for (const [keys, what] of [["a", "Draw an arrow from the state, then choose where it ends"], ["arrows", "Go to what is next"], ["shift and arrows, or shift and drag", "Move the state; it stays there, Put back undoes that"], ["enter", "Select the line; shut or open a composite state"], ["+ and -, or ctrl and the wheel", "Larger and smaller"], ["f", "The whole graph in the view"], ["/", "Find a state or a line: Enter the next, Shift+Enter the one before"]]) {
    bus.keys.push({ keys: `In the graph: ${keys}`, what, run: () => {}, where: "Graph" });
  }
  return { shown: () => { ask(); marks(); } };
}
