// The live page: shows what the server tells it, and tells the server which variables it draws.
//
// A graph is a variable, over time, or `a over b`, one over the other. What the user chose and what the tables ask for are kept apart.

const SVG = "http://www.w3.org/2000/svg";
const [WIDE, HIGH, LEFT, TOP, RIGHT, BELOW] = [480, 130, 62, 8, 10, 20];
const page = (id) => document.getElementById(id);

const known = new Set();
const series = new Map(); // by variable: [[tick, value], ...]
let values = {};
let displays = {};
let secondsATick = 0.04;
const cards = { plots: new Map(), "asked-plots": new Map() };

// --- what the server says ---

const socket = new WebSocket(`ws://${location.host}${location.pathname}socket`);
socket.addEventListener("open", () => { page("state").textContent = "running"; });
socket.addEventListener("close", () => {
  if (page("state").textContent !== "the run has ended") page("state").textContent = "no connection";
});
socket.addEventListener("message", (event) => {
  const news = JSON.parse(event.data);
  if (news.hello) greet(news.hello);
  if (news.display !== undefined) shownByTables(news.display);
  if (news.rows) showRows(news.rows);
  for (const [kind, svg] of Object.entries(news.frames ?? {})) showPicture(kind, svg);
  if (news.tick !== undefined) showMoment(news);
  if (news.over) page("state").textContent = "the run has ended";
});

function greet(hello) {
  document.title = page("title").textContent = hello.title;
  secondsATick = hello.tick_s;
  displays = hello.displays;
  const options = document.createDocumentFragment();
  for (const name of hello.names) {
    known.add(name);
    const option = document.createElement("option");
    option.value = name;
    options.append(option);
  }
  page("names").replaceChildren(options);
}

function showMoment(news) {
  values = news.values;
  page("clock").textContent = `${(news.tick * secondsATick).toFixed(2)} s, tick ${news.tick}`;
  for (const [name, { whole, points }] of Object.entries(news.series)) {
    if (whole || !series.has(name)) series.set(name, points);
    else series.get(name).push(...points);
  }
  drawAll();
}

function showPicture(kind, svg) {
  let figure = document.querySelector(`figure[data-kind="${CSS.escape(kind)}"]`);
  if (!figure) {
    figure = document.createElement("figure");
    figure.dataset.kind = kind;
    const caption = document.createElement("figcaption");
    caption.textContent = kind;
    figure.append(document.createElement("div"), caption);
    page("pictures").append(figure);
  }
  const drawn = new DOMParser().parseFromString(svg, "image/svg+xml").documentElement;
  if (drawn.namespaceURI === SVG) figure.firstChild.replaceChildren(document.importNode(drawn, true));
}

function showRows(rows) {
  const list = page("rows").parentElement, before = list.scrollTop;
  page("rows").replaceChildren(...rows.map(([number, text, state]) => {
    const row = document.createElement("tr");
    for (const said of [number, text, state]) row.insertCell().textContent = said;
    row.lastChild.className = state.split(" ")[0];
    return row;
  }));
  list.scrollTop = before;
  follow(list, rows.findLastIndex(([, , state]) => state));
}

// Scrolls the list, and never the page, to the row that is under way or ended last; whoever scrolled it is left alone until another one is.
let present = -1;
function follow(list, at) {
  if (at === present) return;
  present = at;
  const row = page("rows").rows[at];
  if (row) list.scrollTop += row.getBoundingClientRect().top - list.getBoundingClientRect().top - (list.clientHeight - row.offsetHeight) / 2;
}

function shownByTables(display) {
  page("asked").hidden = !display || !page("follow").checked;
  page("asker").textContent = display ? `${display.value} (${display.by})` : "";
  page("asker").dataset.value = display ? display.value : "";
  keep("asked-plots", display ? displays[display.value] : []);
}

// --- what the user chooses ---

page("choose").addEventListener("submit", (event) => {
  event.preventDefault();
  const said = page("name").value.trim().replace(/\s+over\s+/, " over ");
  const missing = said.split(" over ").filter((name) => !known.has(name));
  page("wrong").textContent = missing.length ? `there is no variable ${missing[0]}` : "";
  if (missing.length) return;
  page("name").value = "";
  keep("plots", [...cards.plots.keys(), said]);
});
page("follow").addEventListener("change", () => {
  page("asked").hidden = !page("follow").checked || !page("asker").dataset.value;
});

// The graphs of a section; those that stay keep their place.
function keep(section, graphs) {
  const shown = cards[section];
  for (const [graph, card] of shown) {
    if (!graphs.includes(graph)) { card.remove(); shown.delete(graph); }
  }
  for (const graph of graphs) {
    if (!shown.has(graph)) { shown.set(graph, newCard(section, graph)); page(section).append(shown.get(graph)); }
  }
  const wanted = new Set([...cards.plots.keys(), ...cards["asked-plots"].keys()].flatMap((graph) => graph.split(" over ")));
  for (const name of [...series.keys()]) if (!wanted.has(name)) series.delete(name);
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ watch: [...wanted] }));
  drawAll();
}

function newCard(section, graph) {
  const card = document.createElement("div");
  card.className = "plot";
  card.dataset.name = graph;
  const head = document.createElement("div");
  for (const kind of ["name", "value"]) {
    const said = document.createElement("span");
    said.className = kind;
    head.append(said);
  }
  head.firstChild.textContent = graph;
  if (section === "plots") {
    const away = document.createElement("button");
    away.type = "button";
    away.textContent = "×";
    away.ariaLabel = `Hide ${graph}`;
    away.addEventListener("click", () => keep("plots", [...cards.plots.keys()].filter((one) => one !== graph)));
    head.append(away);
  }
  card.append(head, drawing("svg", { viewBox: `0 0 ${WIDE} ${HIGH}` }));
  return card;
}

// --- drawing ---

function drawing(kind, attributes, text) {
  const made = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

let waiting = false;
function drawAll() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    for (const section of Object.values(cards)) for (const [graph, card] of section) draw(graph, card);
  });
}

function draw(graph, card) {
  const [name, over] = graph.split(" over ");
  const said = values[name];
  card.querySelector(".value").textContent = typeof said === "number" ? Number(said.toPrecision(6)) : said ?? "";
  const up = axis(series.get(name) ?? []);
  const across = over === undefined
    ? { points: up.points.map(([tick]) => [tick, tick * secondsATick]), members: null }
    : axis(series.get(over) ?? []);
  const where = new Map(across.points);
  const points = up.points.map(([tick, y]) => [where.get(tick) ?? null, y]);
  const finite = points.filter(([x, y]) => x !== null && y !== null);
  const svg = card.querySelector("svg");
  if (!finite.length) { svg.replaceChildren(); return; }
  const x = scale(finite.map((point) => point[0]), LEFT, WIDE - RIGHT, across.members, 6, over === undefined);
  const y = scale(finite.map((point) => point[1]), HIGH - BELOW, TOP, up.members, 4, false);
  const unit = over === undefined ? " s" : "";
  svg.replaceChildren(
    drawing("path", { class: "rule", d: [
      ...x.marks.map(([at]) => `M${x.of(at)} ${TOP}V${HIGH - BELOW}`), ...y.marks.map(([at]) => `M${LEFT} ${y.of(at)}H${WIDE - RIGHT}`),
    ].join("") }),
    drawing("path", { class: "curve", d: line(points, x, y, over === undefined) }),
    ...x.marks.map(([at, text]) => drawing("text", { x: x.of(at), y: HIGH - 6, "text-anchor": "middle" }, text + unit)),
    ...y.marks.map(([at, text]) => drawing("text", { x: LEFT - 6, y: Number(y.of(at)) + 3, "text-anchor": "end" }, text)),
  );
}

// Numbers as they are; words by the order in which they came.
function axis(points) {
  if (!points.some(([, value]) => typeof value === "string")) return { points, members: null };
  const members = [];
  const numbered = points.map(([tick, value]) => {
    const said = String(value ?? "");
    if (!members.includes(said)) members.push(said);
    return [tick, members.indexOf(said)];
  });
  return { points: numbered, members };
}

// Pixels of numbers, and where the marks are; `held` leaves no room beside them.
function scale(numbers, from, to, members, most, held) {
  let low = Infinity, high = -Infinity;
  for (const number of numbers) { low = Math.min(low, number); high = Math.max(high, number); }
  if (!(high - low > 1e-9 * Math.max(1, Math.abs(low), Math.abs(high)))) { low -= 0.5; high += 0.5; }
  const beside = held ? 0 : 0.04 * (high - low);
  low -= beside; high += beside;
  const of = (value) => (from + (value - low) / (high - low) * (to - from)).toFixed(1);
  if (members) return { of, marks: members.map((name, at) => [at, name.slice(0, 11)]).filter(([at]) => at >= low && at <= high) };
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((times) => times * power).find((size) => size >= rough * (1 - 1e-9));
  const marks = [];
  for (let at = Math.ceil(low / step - 1e-9); at <= high / step + 1e-9; at += 1) marks.push([at * step, String(Number((at * step).toPrecision(6)))]);
  return { of, marks };
}

// Values hold until the next; one variable over another goes straight.
function line(points, x, y, held) {
  let path = "", pen = false;
  for (const [across, up] of points) {
    if (across === null || up === null) { pen = false; continue; }
    const [right, down] = [x.of(across), y.of(up)];
    path += !pen ? `M${right} ${down}h.1` : held ? `H${right}V${down}` : `L${right} ${down}`;
    pen = true;
  }
  return path;
}
