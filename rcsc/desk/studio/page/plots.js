// Graphs of any variables: several curves each, against time or against another variable; a value that nobody has set is a gap.

import { doLine, Refusal } from "./bus.js";
import { colour, make } from "./make.js";
import { lookAt } from "./moments.js";
import uPlot from "./vendor/uplot/uPlot.js";

const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [4, 2], [1, 4]];
const COLOURS = ["accent", "bad", "good", "plum", "warn", "steel"];
const EVERY_MS = 250;

/** The variable of a curve: of `d(a)`, how fast a changes, it is a. */
const of = (name) => /^d\((.+)\)$/.exec(name)?.[1] ?? name;

/** How fast a curve changes, a second: the slope from each change to the next, and none after the last. */
function slope({ name, unit, members, changes, ...rest }, tick_s) {
  const slopes = members.length ? [] : changes.map(([tick, value], at) => { // names change at no speed
    const [after, next] = changes[at + 1] ?? [];
    return [tick, after === undefined ? 0 : value === null || next === null ? null : (next - value) / ((after - tick) * tick_s)];
  });
  return { ...rest, name: `d(${name})`, unit: `${unit || "1"}/s`, members: [], changes: slopes };
}

export function mount(root, bus) {
  const words = make("datalist", { id: "plot-words" });
  const what = make("input", { list: "plot-words", class: "grow", "aria-label": "A variable, or one over another: a over b", placeholder: "a variable, or  a over b", spellcheck: "false" });
  const shows = make("select", { "aria-label": "Graphs that the system shows", hidden: true });
  const trigger = make("input", { class: "grow", "aria-label": "A condition: the curves show when it comes to hold", placeholder: "a condition", spellcheck: "false", list: "run-words" });
  const list = make("div", { class: "graphs scroll" });
  const empty = make("p", { class: "closed soft" }, "No graph yet: name a variable above.");
  root.append(make("form", { class: "bar", onsubmit: (event) => { event.preventDefault(); add(what.value.trim()); } },
    what, make("button", { type: "submit" }, "New graph"), shows),
    ...(bus.answers("time.find") ? [make("form", { class: "bar", onsubmit: (event) => { event.preventDefault(); triggered(trigger.value.trim()); } },
      make("span", {}, "Trigger"), trigger, make("button", { type: "submit", title: "Show the next tick in which it holds, with some time before it; a run that has not come so far is run until it does" }, "Show"))] : []),
    words, empty, list);

  let graphs = []; // { names, over, element, plot, curves }
  let known = [], displays = {}, named = "", asked = null, shown = true, asking = false, again = false, last = 0;
  let span = null, pointed = null; // the ticks that are shown, null for all; the tick below the pointer
  let choosers = [], follows = false, chosen = ""; // variables called `display` name the set that is looked at, while nobody else has chosen

  // --- which there are ---

  const keeps = bus.answers("run.type"); // a file shows what it was made with
  const store = () => `studio.plots.${bus.latest("run.state")?.title ?? ""}`;
  function keep() {
    if (!keeps) return;
    try { localStorage.setItem(store(), JSON.stringify(graphs.filter(({ followed }) => !followed).map(({ names, over }) => ({ names, over })))); } catch { /* a private window keeps nothing */ }
  }

  async function add(text, quietly = false, followed = false) {
    const [drawn, over = ""] = text.split(/\s+over\s+/);
    const several = drawn.split(/[\s,]+/).filter(Boolean);
    if (!quietly) await names(); // who is quick types before it is known which there are
    const wrong = [...several, over].filter(Boolean).map(of).find((name) => !known.includes(name));
    if (!several.length) return undefined;
    if (wrong) return bus.say(`there is no variable \`${wrong}\``, { wrong: true, helps: near(wrong) });
    const graph = { names: several, over, followed, curves: [] };
    graph.element = frame(graph);
    graphs.push(graph);
    list.append(graph.element);
    what.value = "";
    if (!quietly) { keep(); graph.element.scrollIntoView({ block: "nearest" }); }
    empty.hidden = true;
    return soon();
  }

  /** Draw one more curve in a graph. */
  function join(graph, name) {
    if (!known.includes(of(name))) return bus.say(`there is no variable \`${of(name)}\``, { wrong: true, helps: near(of(name)) });
    if (!graph.names.includes(name)) graph.names.push(name);
    keep();
    soon();
    return true;
  }

  /** Show when a condition comes to hold, with some time before it; a run that has not come so far is run until then. */
  async function triggered(text) {
    const run = bus.latest("run");
    if (!text || !run?.open) return;
    const { tick } = bus.selection, after = tick === null || tick === run.last ? run.first : tick; // from the end on there is nothing: all of it is looked at
    let found = await bus.try("time.find", { text, tick: after, back: false });
    if (!found) return;
    if (found.tick === null && run.source === "live") {
      if (!(await doLine(bus, `run until ${text}`))) return;
      found = { tick: bus.latest("run").last };
    }
    if (found.tick === null) { bus.say(`no later tick in which ${text}`); return; }
    const { first, last } = bus.latest("run"), many = span ? span.to - span.from : Math.min(200, last - first);
    const from = Math.max(first, Math.min(last - many, found.tick - many * 0.2));
    bus.tell("span", { from, to: from + many });
    lookAt(bus, found.tick);
  }

  const near = (text) => {
    const found = known.filter((name) => name.includes(text.split(".").at(-1))).slice(0, 3);
    return found.length ? [`perhaps ${found.join(", ")}`] : [];
  };

  function remove(graph, byHand = false) {
    if (byHand && graph.followed) rests();
    graph.plot?.destroy();
    graph.element.remove();
    graphs = graphs.filter((one) => one !== graph);
    empty.hidden = graphs.length > 0;
    keep();
  }

  function frame(graph) {
    const more = make("input", { list: "plot-words", "aria-label": `Another curve beside ${graph.names.join(", ")}`, placeholder: "one more curve", spellcheck: "false" });
    const legend = make("ul", { class: "legend" });
    const place = make("div", { class: "plot" });
    const element = make("section", { class: "graph", "aria-label": `Graph of ${graph.names.join(", ")}` },
      make("div", { class: "bar small" }, legend,
        make("form", { onsubmit: (event) => {
          event.preventDefault();
          if (join(graph, more.value.trim())) more.value = "";
        } }, more),
        make("button", { type: "button", "aria-label": `Remove the graph of ${graph.names.join(", ")}`, onclick: () => remove(graph, true) }, "Remove")),
      place);
    Object.assign(graph, { legend, place });
    return element;
  }

  function names() {
    const run = bus.latest("run");
    if (!run?.open) return undefined;
    const key = `${run.source} ${run.name ?? ""} ${run.levels.map((one) => one.name ?? one).join()}`;
    if (key === named) return asked;
    named = key;
    return asked = learn();
  }

  async function learn() {
    try {
      const answer = await bus.ask("plot.names");
      known = answer.names.map(({ name }) => name);
      displays = answer.displays;
      words.replaceChildren(...answer.names.map(({ name, unit }) => make("option", { value: name }, unit)));
      const sets = Object.keys(displays);
      shows.hidden = !sets.length;
      empty.textContent = `No graph yet: name a variable above${sets.length ? ", or choose what the system shows" : ""}.`;
      choosers = sets.length ? known.filter((name) => name.endsWith(".display")) : [];
      shows.replaceChildren(make("option", { value: "" }, "the system shows"), ...choosers.length ? [make("option", { value: "*" }, "what the tables choose")] : [], ...sets.map((name) => make("option", { value: name }, name)));
      for (const graph of [...graphs]) if (![...graph.names, graph.over].filter(Boolean).map(of).every((name) => known.includes(name))) remove(graph);
      if (!graphs.length) remembered(sets);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      named = "";
    }
  }

  function remembered(sets) {
    let kept = null;
    try { kept = keeps ? JSON.parse(localStorage.getItem(store())) : null; } catch { /* none */ }
    for (const { names: several, over } of kept ?? []) if (several.map(of).every((name) => known.includes(name))) add(over ? `${several.join(" ")} over ${over}` : several.join(" "), true);
    follows = !kept && choosers.length > 0;
    if (!kept && sets.length && !follows) for (const text of displays[sets[0]]) add(text, true);
  }
  shows.addEventListener("change", () => {
    if (shows.value === "*") { follows = true; chosen = ""; soon(); }
    for (const text of displays[shows.value] ?? []) add(text);
    shows.value = "";
  });

  /** What was followed stays as it is. */
  function rests() {
    follows = false;
    for (const graph of graphs) graph.followed = false;
    keep();
  }

  /** Show the set that the variable `display` that changed last names. */
  async function follow() {
    const { curves } = await bus.ask("plot.curves", { names: choosers });
    const said = curves.map(({ members, changes }) => ({ at: changes.at(-1)?.[0] ?? -1, set: members[changes.at(-1)?.[1]] })).filter(({ set }) => displays[set]);
    const { set } = said.sort((one, other) => other.at - one.at)[0] ?? {};
    if (!set || set === chosen) return;
    chosen = set;
    for (const graph of graphs.filter(({ followed }) => followed)) remove(graph);
    for (const text of displays[set]) await add(text, true, true);
  }

  // --- curves ---

  function soon() {
    if (!shown) return;
    const wait = Math.max(0, last + EVERY_MS - performance.now());
    if (again) return;
    again = true;
    setTimeout(() => { again = false; draw(); }, wait);
  }

  async function draw() {
    if (asking || !bus.latest("run")?.open) return;
    asking = true;
    last = performance.now();
    try {
      await names();
      if (follows) await follow();
      for (const graph of [...graphs]) {
        const wanted = [...new Set([...graph.names, graph.over].filter(Boolean))];
        const answer = await bus.ask("plot.curves", { names: [...new Set(wanted.map(of))] });
        const told = new Map(answer.curves.map((curve) => [curve.name, curve]));
        answer.curves = wanted.map((name) => (name === of(name) ? told.get(name) : slope(told.get(of(name)), seconds())));
        if (graphs.includes(graph)) (answer.last > answer.first ? chart : bare)(graph, answer);
      }
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      bus.say(error.message, { wrong: true, helps: error.helps });
    } finally {
      asking = false;
    }
  }

  const seconds = () => (bus.latest("run")?.tick_ms ?? 40) / 1000;

  /** Every curve at every tick at which one of them changes: held in between, for nothing happens between cycles. */
  function together(answer) {
    const ends = span ? [Math.ceil(span.from), Math.floor(span.to)].filter((tick) => tick > answer.first && tick < answer.last) : []; // what is shown begins and ends there
    const ticks = [...new Set([...answer.curves.flatMap(({ changes }) => changes.map(([tick]) => tick)), ...ends, answer.last])].sort((a, b) => a - b);
    const values = answer.curves.map(({ changes }) => {
      let at = 0, held = null;
      return ticks.map((tick) => {
        while (at < changes.length && changes[at][0] <= tick) held = changes[at++][1];
        return held;
      });
    });
    return { ticks, values };
  }

  function chart(graph, answer) {
    const { ticks, values } = together(answer);
    graph.curves = answer.curves;
    graph.ticks = ticks;
    graph.values = values;
    const data = graph.over ? across(graph) : [ticks.map((tick) => tick * seconds()), ...values];
    const shape = `${bus.latest("theme")} ${graph.names.join()} ${graph.over} ${answer.curves.map(({ members }) => members.join()).join(";")}`;
    if (graph.plot && graph.shape === shape) graph.plot.setData(data);
    else {
      graph.plot?.destroy();
      graph.place.replaceChildren();
      graph.plot = new uPlot(options(graph), data, graph.place);
      graph.shape = shape;
      graph.plot.over.addEventListener("click", () => choose(graph));
      graph.plot.over.addEventListener("dblclick", () => bus.tell("span", null));
    }
    legends();
  }

  /** Before the first cycle there is no time to draw: no axis says that there was. */
  function bare(graph) {
    graph.plot?.destroy();
    Object.assign(graph, { plot: null, shape: "", ticks: null });
    graph.place.replaceChildren(make("p", { class: "soft" }, "No cycle yet: the curves begin with the first one."));
    graph.legend.replaceChildren(...[...graph.names, graph.over].filter(Boolean).map((name) => make("li", {}, name)));
  }

  function across(graph) {
    const xs = graph.values[graph.curves.findIndex(({ name }) => name === graph.over)].filter((one) => one !== null);
    const ys = graph.values.flatMap((one, at) => graph.curves[at].name === graph.over ? [] : one.filter((value) => value !== null));
    const range = (all) => all.length ? [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))] : [0, 1];
    return [range(xs), ...graph.curves.filter(({ name }) => name !== graph.over).map(() => range(ys))];
  }

  function options(graph) {
    const [ink, edge] = [colour("soft"), colour("edge")];
    const drawn = graph.curves.filter(({ name }) => name !== graph.over);
    const x = graph.curves.find(({ name }) => name === graph.over);
    const axis = (curves, label) => {
      const members = curves.length && curves.every((one) => one.members.join() === curves[0].members.join()) ? curves[0].members : [];
      return { stroke: ink, grid: { stroke: edge, width: 1 }, ticks: { stroke: edge, width: 1 }, label, labelSize: 18, size: members.length ? 96 : 62,
        ...(members.length ? { incrs: [1, 2, 5, 10, 20, 50], space: members.length > 1 ? 15 : 40, values: (_, splits) => splits.map((at) => Number.isInteger(at) ? members[at] ?? "" : "") } : {}) };
    };
    const units = [...new Set(drawn.map(({ unit }) => unit).filter(Boolean))].join(", ");
    return {
      width: Math.max(240, graph.place.clientWidth), height: 190, legend: { show: false },
      cursor: { drag: { x: !graph.over, y: false, setScale: false }, ...(graph.over ? {} : { sync: { key: "studio" } }) },
      scales: { x: { time: false, ...(graph.over ? {} : { range: (_, min, max) => (span ? [span.from * seconds(), span.to * seconds()] : [min, max]) }) } },
      axes: [{ ...axis(x ? [x] : [], x ? `${x.name}${x.unit ? ` (${x.unit})` : ""}` : "time (s)"), size: 34 }, axis(drawn, units)],
      series: [{}, ...drawn.map((one, at) => ({ label: one.name, scale: "y", stroke: stroke(at), dash: DASHES[at % DASHES.length], width: 1.6, spanGaps: false,
        points: { show: false }, paths: graph.over ? () => null : uPlot.paths.stepped({ align: 1 }) }))],
      hooks: { setSelect: [selected], setCursor: graph.over ? [] : [point], draw: [(plot) => { if (graph.over) path(plot, graph); now(plot, graph); }] },
    };
  }

  /** What was dragged over is shown, in all graphs and the time line. */
  function selected(plot) {
    const { left, width } = plot.select;
    if (width < 4) return;
    const [from, to] = [left, left + width].map((at) => plot.posToVal(at, "x") / seconds());
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    bus.tell("span", { from, to: Math.max(to, from + 2) });
  }

  /** The values below the pointer stand in all legends. */
  function point(plot) {
    const now = plot.cursor.left >= 0 ? Math.floor(plot.posToVal(plot.cursor.left, "x") / seconds() + 1e-6) : null;
    if (now === pointed) return;
    pointed = now;
    legends();
  }

  const stroke = (at) => colour(COLOURS[at % 6]);

  /** A curve over another variable: from each tick to the next, with nothing where either was not set. */
  function path(plot, graph) {
    const across = graph.curves.findIndex(({ name }) => name === graph.over);
    const { ctx } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
    ctx.clip();
    graph.curves.filter((_, at) => at !== across).forEach((curve, at) => {
      const ys = graph.values[graph.curves.indexOf(curve)];
      ctx.strokeStyle = stroke(at);
      ctx.lineWidth = 1.6 * devicePixelRatio;
      ctx.setLineDash(DASHES[at % DASHES.length].map((one) => one * devicePixelRatio));
      ctx.beginPath();
      let on = false;
      graph.values[across].forEach((x, place) => {
        if (x === null || ys[place] === null) { on = false; return; }
        const point = [plot.valToPos(x, "x", true), plot.valToPos(ys[place], "y", true)];
        if (on) ctx.lineTo(...point); else ctx.moveTo(...point);
        on = true;
      });
      ctx.stroke();
    });
    ctx.restore();
  }

  const at = (graph, tick) => { let low = 0, high = graph.ticks.length; while (low < high) { const middle = (low + high) >> 1; if (graph.ticks[middle] <= tick) low = middle + 1; else high = middle; } return low - 1; };

  /** Where everybody looks: a line at the time, or a ring on the curve. */
  function now(plot, graph) {
    const { tick } = bus.selection;
    if (!graph.over) graph.element.dataset.shown = [plot.scales.x.min, plot.scales.x.max].map((at) => Math.round(at / seconds())).join(" ");
    if (tick === null) return;
    const { ctx } = plot;
    ctx.save();
    ctx.setLineDash([]); // the last curve's is still set
    ctx.strokeStyle = colour("ink");
    ctx.lineWidth = devicePixelRatio;
    ctx.beginPath();
    if (!graph.over) {
      const x = plot.valToPos(tick * seconds(), "x", true);
      if (x >= plot.bbox.left && x <= plot.bbox.left + plot.bbox.width) { ctx.moveTo(x, plot.bbox.top); ctx.lineTo(x, plot.bbox.top + plot.bbox.height); }
    } else {
      const place = at(graph, tick), x = graph.values[graph.curves.findIndex(({ name }) => name === graph.over)][place];
      graph.curves.forEach(({ name }, curve) => {
        const y = graph.values[curve][place];
        if (name === graph.over || x === null || y === null || place < 0) return;
        ctx.moveTo(plot.valToPos(x, "x", true) + 5 * devicePixelRatio, plot.valToPos(y, "y", true));
        ctx.arc(plot.valToPos(x, "x", true), plot.valToPos(y, "y", true), 5 * devicePixelRatio, 0, 7);
      });
    }
    ctx.stroke();
    ctx.restore();
  }

  function choose(graph) {
    if (graph.over || graph.plot.cursor.left < 0) return;
    lookAt(bus, graph.plot.posToVal(graph.plot.cursor.left, "x") / seconds());
  }

  /** Names, and each one's value at the tick, in words. */
  function legends() {
    const tick = pointed ?? bus.selection.tick;
    for (const graph of graphs) {
      if (!graph.ticks) continue;
      graph.legend.classList.toggle("pointed", pointed !== null);
      const place = at(graph, tick ?? 0);
      let drawn = 0;
      graph.legend.replaceChildren(...graph.curves.map(({ name, unit, members }, curve) => {
        const value = place < 0 ? null : graph.values[curve][place];
        const never = graph.values[curve].every((one) => one === null);
        const text = value === null || value === undefined ? (never ? "never set" : "not set") : members[value] ?? `${Number.isInteger(value) ? value : Number(value).toPrecision(6)}${unit ? ` ${unit}` : ""}`;
        const key = name === graph.over ? "across" : "";
        const mark = make("span", { class: `mark mark-${key ? "across" : drawn++ % 6}`, "aria-hidden": "true" });
        const drop = graph.names.length > 1 && !key ? make("button", { type: "button", class: "plain", "aria-label": `Remove ${name}`, onclick: () => { graph.names = graph.names.filter((one) => one !== name); keep(); soon(); } }, "×") : null;
        const number = !members.length && !key && name === of(name) && !graph.names.includes(`d(${name})`) && !graph.over;
        const rate = number && keeps ? make("button", { type: "button", class: "plain", title: `How fast ${name} changes, a second`, "aria-label": `Add how fast ${name} changes`, onclick: () => join(graph, `d(${name})`) }, "d/dt") : null;
        return make("li", {}, mark, `${key ? "over " : ""}${name} = `, make("strong", {}, text), rate, drop);
      }), ...(pointed === null ? [] : [make("li", { class: "soft" }, `at tick ${pointed}`)]));
    }
  }

  // --- following ---

  bus.on("run", (run) => { if (run.open) soon(); });
  bus.on("selection", (_, changed) => {
    if (!changed?.has("tick") || !shown) return;
    legends();
    for (const { plot } of graphs) plot?.redraw(false, false);
  });
  bus.on("theme", () => soon());
  bus.on("span", (shownNow) => { span = shownNow; soon(); });
  root.addEventListener("dragover", (event) => { if (keeps) event.preventDefault(); });
  root.addEventListener("drop", (event) => {
    event.preventDefault();
    const name = event.dataTransfer.getData("text/plain"), graph = graphs.find(({ element }) => element.contains(event.target));
    if (graph) join(graph, name); else add(name);
  });
  new ResizeObserver(() => { for (const { plot, place } of graphs) if (place.clientWidth > 240) plot?.setSize({ width: place.clientWidth, height: 190 }); }).observe(list);
  return { shown() { shown = true; soon(); }, hidden() { shown = false; } };
}
