// Tables: a grid and the text of one file, with what is proved of it.

import { make } from "../bus.js";
import { spoken } from "../make.js";
import { deskOf, SIGNS } from "./desk.js";
import { SheetGrid } from "./sheet.js";
import { TextView } from "./text.js";

export function mount(root, bus) {
  const desk = deskOf(bus);
  const choice = make("select", { class: "table-choice", "aria-label": "Table" });
  const standing = make("div", { class: "standing", role: "status" });
  const button = (text, what, run, extra = {}) => make("button", { type: "button", title: what, onclick: run, ...extra }, text);
  const undo = button("Undo", "Undo (ctrl+z)", () => desk.undo()), redo = button("Redo", "Redo (ctrl+y)", () => desk.redo());
  const save = button("Save", "Write the file, laid out (ctrl+s)", () => desk.save());
  const conflict = make("div", { class: "conflict", role: "alert" });
  const sheetPlace = make("div", { class: "grid-place" }), textPlace = make("div", { class: "text-place" });
  const elsewhere = make("div", { class: "elsewhere" });
  const modes = ["Grid", "Text", "Both"].map((name) => button(name, `Show ${name.toLowerCase()}`, () => mode(name), { "data-mode": name }));
  const filter = make("input", { class: "filter", "aria-label": "Lines that can match where this condition holds", placeholder: "lines that can match where …", spellcheck: "false" });
  const filtered = make("span", { class: "soft", role: "status" });
  const adding = columnForm(() => sheet);
  const more = make("details", { class: "more" }, make("summary", {}, "Table"), make("div", { class: "menu" },
    button("Insert line", "Insert a line below (alt+enter)", () => sheet.insertLine()),
    button("Delete lines", "Delete the selected lines (ctrl+delete)", () => sheet.deleteLines()),
    button("Insert column …", "Insert a column after this one", () => { more.open = false; adding.showModal(); adding.querySelector("input").focus(); }),
    button("Delete column", "Delete this column", () => sheet.deleteColumn())));
  more.addEventListener("click", (event) => { if (event.target.closest("button")) more.open = false; });
  more.addEventListener("keydown", (event) => { if (event.key === "Escape") { more.open = false; more.querySelector("summary").focus(); } });
  root.append(
    make("div", { class: "bar" }, choice, undo, redo, save, more, make("span", { class: "modes", role: "group", "aria-label": "Shown as" }, ...modes)),
    make("div", { class: "bar" }, standing, make("form", { class: "filter-form", onsubmit: (event) => { event.preventDefault(); desk.filter(filter.value); } }, filter, filtered)),
    conflict, sheetPlace, textPlace, elsewhere, adding);

  choice.addEventListener("change", () => {
    const [file, table] = choice.value.split(" ");
    desk.follow(file ? "" : table);
    if (file) desk.open(file, table);
  });
  for (const place of [sheetPlace, textPlace]) place.addEventListener("focusin", ({ target }) => { if (target.matches("input, [contenteditable]")) desk.follow(""); });
  filter.addEventListener("keydown", (event) => { if (event.key === "Escape") { filter.value = ""; desk.filter(""); } });
  const sheet = new SheetGrid(sheetPlace, bus, desk);
  const text = new TextView(textPlace, bus, desk);

  function mode(name) {
    root.dataset.mode = name;
    for (const one of modes) one.setAttribute("aria-pressed", one.dataset.mode === name);
    text.marks();
    try { localStorage.setItem("studio.tables", name); } catch { /* a private window keeps nothing */ }
  }
  let kept = "Grid";
  try { kept = localStorage.getItem("studio.tables") ?? kept; } catch { /* as above */ }
  mode(["Grid", "Text", "Both"].includes(kept) ? kept : "Grid");

  let listed = "", filters = "";
  desk.on(() => {
    const { doc, shown, files } = desk;
    const key = JSON.stringify([files, doc?.tables.map(({ name }) => name)]);
    if (key !== listed) { listed = key; choose(choice, desk); }
    for (const one of choice.querySelectorAll("[data-level]")) one.textContent = `▶ ${one.dataset.level} runs${desk.follows === one.dataset.level ? ` ${desk.table}` : " …"}`;
    choice.value = desk.follows ? ` ${desk.follows}` : `${desk.file} ${desk.table}`;
    undo.disabled = !doc.undo;
    redo.disabled = !doc.redo;
    undo.title = doc.undo ? `Undo: ${doc.undo} (ctrl+z)` : "Nothing is left to undo";
    redo.title = doc.redo ? `Do again: ${doc.redo} (ctrl+y)` : "Nothing was undone";
    save.classList.toggle("dirty", doc.dirty);
    save.textContent = doc.dirty ? "Save *" : "Save";
    save.setAttribute("aria-label", doc.dirty ? "Save: there are changes" : "Save: nothing changed");
    const now = shown?.standing ?? { state: "stale", why: "the file has no table" };
    standing.className = `standing ${now.state.replaceAll(/\W+/g, "-")}`;
    standing.replaceChildren(make("strong", {}, `${SIGNS[now.state] ?? ""} ${now.state}`), ": ", ...spoken(now.why));
    standing.title = `${now.state}: ${now.why}`;
    if (doc.known) {
      const [mark] = performance.getEntriesByName("studio.key").slice(-1);
      if (mark) { performance.measure("studio.key to finding", { start: mark.startTime }); performance.clearMarks("studio.key"); }
    }
    told();
    const condition = desk.condition;
    const of = `${desk.file} ${desk.table}`;
    if (!condition && (of !== filters || document.activeElement !== filter)) filter.value = ""; // it says what is hidden, or is being typed
    filters = of;
    filtered.textContent = condition ? `${condition.can.length} of ${shown?.rows.length ?? 0} lines can match${condition.unknown.length ? `, ${condition.unknown.length} not known` : ""}` : "";
    if (conflict.dataset.of !== desk.conflict) conflict.replaceChildren(...(desk.conflict ? [desk.conflict, " ", button("Take what is on disk", "It can be undone", () => desk.take()), " ",
      button("Write over it", "What others wrote is lost", () => desk.save(true))] : []));
    conflict.dataset.of = desk.conflict; // the same buttons stay: one that is replaced while it is pressed is never clicked
  });

  function told() {
    const found = desk.findings(false);
    elsewhere.hidden = !found.length;
    elsewhere.replaceChildren(...found.slice(0, 50).map((one) => make("div", { class: one.severity },
      make("strong", {}, { error: "Wrong", warning: "Perhaps wrong", note: "Note" }[one.severity] ?? one.severity),
      ` ${one.table ? `in table ${one.table}` : one.file ? `in ${one.file.split("/").pop()}` : `in line ${(one.area?.[0][0] ?? 0) + 1} of the text`}: `, ...spoken(one.message), " ",
      one.table && !one.file ? button("Show", "Show it at its table", () => { desk.open(desk.file, one.table); sheet.reveal(one.id); }, { class: "small" }) : "",
      ...one.help.map((help) => make("div", { class: "help" }, "Help: ", ...spoken(help))))));
  }

  bus.key("ctrl+s", "Write the file, laid out", () => desk.save(), "Tables");
  bus.key("ctrl+z", "Undo the last change of the file", () => desk.undo(), "Tables");
  bus.key("ctrl+y", "Do again what was undone", () => desk.redo(), "Tables");
  bus.key("w", "Watch the level chosen: its table as it runs; or stay at this one", () => desk.follow(desk.follows ? "" : bus.selection.level || (bus.latest("moment")?.levels[0]?.level ?? "")), "Tables");
  bus.key("/", "Filter lines by a condition", () => { filter.focus(); filter.select(); }, "Tables");
  const none = () => {};
  for (const [keys, what] of [["enter", "Edit the cell; when edited write it, and go down"], ["tab", "Write the cell, and go right"], ["escape", "Leave the cell as it was"],
    ["f2", "Edit the cell"], ["alt+enter", "Insert a line below"], ["ctrl+delete", "Delete the selected lines"], ["delete", "Empty the selected cells"]]) {
    bus.keys.push({ keys: `In the grid: ${keys}`, what, run: none, where: "Tables" });
  }
  for (const [keys, what] of [["tab", "In a row: the next cell, shift the one before; a line after the last"], ["ctrl+space", "What could stand here"], ["f8", "The next finding"],
    ["ctrl+.", "All findings, with their repairs"], ["f12", "Where the name is declared"], ["ctrl+alt+enter", "In a row: insert a line below"], ["ctrl+alt+i", "In a row: insert a column"], ["ctrl+f", "Find and replace"]]) {
    bus.keys.push({ keys: `In the text: ${keys}`, what, run: none, where: "Tables" });
  }
  return { shown: () => { sheet.draw(); text.marks(); } };
}

function choose(choice, desk) {
  const groups = new Map();
  for (const { file, tables, levels } of desk.files) {
    const name = levels.length ? `Level ${levels.join(", ").toUpperCase()}` : "Other files of the project";
    groups.set(name, [...(groups.get(name) ?? []), ...tables.map((table) => ({ file, table }))]);
  }
  const own = desk.doc?.tables.map(({ name }) => name) ?? [];
  const known = new Set([...groups.values()].flat().map(({ file, table }) => `${file} ${table}`));
  const fresh = own.filter((table) => !known.has(`${desk.file} ${table}`)).map((table) => ({ file: desk.file, table }));
  if (fresh.length) groups.set("New", fresh);
  const levels = [...new Set(desk.files.flatMap((one) => one.levels))];
  const running = levels.length ? [make("optgroup", { label: "As it runs" }, levels.map((level) => make("option", { value: ` ${level}`, "data-level": level })))] : [];
  choice.replaceChildren(...running, ...[...groups].map(([name, every]) => make("optgroup", { label: name },
    every.map(({ file, table }) => make("option", { value: `${file} ${table}` }, `${table} (${file})`)))));
}

function columnForm(sheet) {
  const heading = make("input", { "aria-label": "Heading", placeholder: "a variable, an expression, when, procedures", size: "36", spellcheck: "false" });
  const action = make("input", { type: "checkbox", id: "new-column-action" });
  const dialog = make("dialog", { "aria-label": "Insert a column", class: "new-column" },
    make("form", { method: "dialog", onsubmit: async (event) => {
      event.preventDefault();
      if (await sheet().insertColumn(heading.value, action.checked)) { heading.value = ""; dialog.close(); }
    } },
    make("h2", {}, "Insert a column"), make("p", {}, heading), make("p", {}, action, make("label", { for: "new-column-action" }, " after ||: what the lines do")),
    make("button", {}, "Insert"), " ", make("button", { type: "button", onclick: () => dialog.close() }, "Cancel")));
  return dialog;
}
