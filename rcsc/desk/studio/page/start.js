// The start page: my tables, a new project, what is found in published tables. What is chosen is opened at the same address.

import { make, Refusal } from "./bus.js";
import { Connected } from "./socket.js";
import { followStart } from "./started.js";

const bus = new Connected();
const page = (id) => document.getElementById(id);
try { document.documentElement.dataset.theme = localStorage.getItem("studio.theme") ?? "system"; } catch { /* a private window keeps nothing */ }

/** Ask for what is opened next; the page goes there once the studio is there. */
async function open(kind, body, what) {
  say(`opening ${what} …`);
  document.body.inert = true;
  try {
    await bus.ask(kind, body);
  } catch (error) {
    if (error instanceof Refusal && error.lost) return; // it ended quicker than it answered: the connection comes back with the other
    document.body.inert = false;
    say([error.message, ...error.helps ?? []].join("; "), true);
  }
}
function say(text, wrong = false) {
  page("said").textContent = text;
  page("said").className = wrong ? "wrong" : "soft";
}

/** A text of a page in Markdown: *stressed*, and \`code\`; new findings stand out. */
const spoken = (text) => text.split(/(\*[^*]+\*|`[^`]+`)/).map((piece) => {
  if (piece.startsWith("`")) return make("code", {}, piece.slice(1, -1));
  if (!piece.startsWith("*")) return piece;
  return make("em", { class: piece === "*new*" || piece === "*New*" ? "new" : "" }, piece.slice(1, -1));
});

const place = ({ path, name, kind, files }) => make("li", {},
  make("button", { type: "button", title: path, onclick: () => open("start.open", { path }, name) }, name === "." ? "this folder" : name),
  make("span", { class: "kind" }, kind === "system" ? "system" : files || "tables"));

function mine({ recent, found }) {
  const several = (title, some) => (some.length ? [make("h3", {}, title), make("div", {}, make("ul", {}, ...some.map(place)))] : []);
  page("tables").replaceChildren(...several("Opened before", recent), ...several("Here", found),
    ...(recent.length || found.length ? [] : [make("p", { class: "soft" }, "None here yet: make a project, or look at what others published.")]));
}

function templates({ templates: every, here }) {
  page("templates").replaceChildren(...every.map(({ name, text }, at) => make("label", {},
    make("input", { type: "radio", name: "template", value: name, checked: at === 0 }), " ", make("strong", {}, name), ` ${text}`)));
  page("here").textContent = `Folders are meant from ${here}.`;
}

const stem = (file) => file.replace(/\.\w+$/, "");
function entry({ name, title, rows, systems }) {
  const files = [...new Set(rows.map(({ file }) => file))];
  const look = (file, text) => make("button", { type: "button", onclick: () => open("start.look", { entry: name, file }, `${name}/${file}`) }, text);
  return make("article", { class: "card" }, make("h3", {}, title),
    ...rows.map(({ source, finding }) => make("p", {}, make("span", { class: "soft" }, ...spoken(source)), ": ", ...spoken(finding))),
    make("div", { class: "buttons" }, ...files.map((file) => look(file, files.length > 1 ? `As published: ${stem(file)}` : "As published")),
      ...systems.map((file) => look(file, `Prove and run ${stem(file)}`))));
}

page("open").addEventListener("submit", (event) => {
  event.preventDefault();
  const { path } = event.target.elements;
  open("start.open", { path: path.value }, path.value);
});
page("make").addEventListener("submit", (event) => {
  event.preventDefault();
  const { folder, template } = event.target.elements;
  open("start.make", { folder: folder.value, template: template.value }, folder.value);
});

followStart(bus, ({ opened }) => {
  page("back").hidden = !opened;
  page("back").textContent = `Back to ${opened}`;
});
bus.connect();
const over = bus.on("connection", async (there) => {
  if (!there) return;
  over();
  const every = await bus.ask("start.list");
  mine(every);
  templates(every);
  page("gallery").replaceChildren(...every.gallery.map(entry));
  document.documentElement.dataset.ready = "yes";
});
