// A table as a grid that is edited in place. Cells are told by line and column from 0; column -1 is the line's name, line -1 the heading.

import { make } from "../bus.js";
import { spoken } from "../make.js";
import { cellsOf, filling, textOf } from "./clip.js";
import { breakable, kindOf } from "./desk.js";

/** The lines that a row of the grid stands for: of a turned table one a cell. */
const linesOf = (row) => JSON.parse(row.dataset.lines ?? "[]");

export class SheetGrid {
  #desk; #bus; #root; #table; #cells = []; #shape = ""; #at = { line: 0, column: -1 }; #anchor = null; #editing = null; #shownWitness = null;
  #wanted = null;
  #named = "";

  constructor(root, bus, desk) {
    this.#bus = bus;
    this.#desk = desk;
    this.#root = root;
    root.classList.add("sheet-scroll");
    this.#table = make("table", { class: "sheet", role: "grid", "aria-multiselectable": "true", "data-keys": "own" });
    root.append(this.#table);
    this.#table.addEventListener("keydown", (event) => this.#key(event));
    this.#table.addEventListener("pointerdown", (event) => this.#press(event));
    this.#table.addEventListener("pointerover", (event) => this.#drag(event));
    this.#table.addEventListener("dblclick", (event) => { const at = this.#place(event.target); if (at) this.edit(at); });
    for (const kind of ["copy", "cut", "paste"]) this.#table.addEventListener(kind, (event) => this.#clip(kind, event));
    desk.on(() => this.draw());
    bus.on("selection", ({ line }, changed) => { if (!changed || changed.has("line") || changed.has("table")) this.#mark(line, changed?.has("line")); });
    bus.on("moment", () => this.#lit());
    bus.on("reveal", (id) => this.reveal(id));
  }

  get at() {
    return this.#at;
  }

  // --- drawing ---

  draw() {
    const { shown, doc } = this.#desk;
    if (!doc) return;
    if (!shown) {
      this.#shape = "";
      this.#table.replaceChildren(make("caption", { class: "soft" }, "This file has no table."));
      return;
    }
    if (this.#named !== `${this.#desk.file} ${shown.name}`) { this.#named = `${this.#desk.file} ${shown.name}`; this.#shownWitness = null; this.#at = { line: 0, column: -1 }; }
    const shape = JSON.stringify([this.#named, shown.name, shown.columns.map(({ kind }) => kind), shown.rows.length, shown.first]);
    const held = this.#table.contains(document.activeElement);
    if (shape !== this.#shape) {
      if (this.#editing && !this.#wanted) this.#drop();
      this.#build(shown);
      this.#shape = shape;
    }
    this.#fill(shown);
    this.#findings(shown);
    if (this.#wanted) {
      this.go(this.#wanted, held);
      this.#wanted = null;
    } else if (held && !this.#table.contains(document.activeElement)) this.go(this.#at);
    this.#mark(this.#bus.selection.line);
    this.#lit();
  }

  #build({ columns, rows, first }) {
    const head = make("tr", { role: "row", class: "head" });
    head.append(make("th", { role: "columnheader", class: "stub corner", scope: "col", "data-line": "-1", "data-column": "-1", tabindex: "-1" }, first),
      make("th", { role: "columnheader", class: "share", scope: "col", title: "Share of the inputs in the declared ranges that the line matches, be they assumed away or not" }, "share"),
      make("th", { role: "columnheader", class: "tells", scope: "col" }));
    this.#cells = [[head.cells[0]]];
    columns.forEach((column, at) => {
      const cell = make("th", { role: "columnheader", scope: "col", tabindex: "-1", "data-line": "-1", "data-column": at, class: kindOf(columns, at) });
      this.#cells[0].push(cell);
      head.append(cell);
    });
    const witness = make("tr", { role: "row", class: "witness" });
    const body = make("tbody", {});
    rows.forEach((_, line) => {
      const stub = make("th", { role: "rowheader", scope: "row", class: "stub", tabindex: "-1", "data-line": line, "data-column": "-1" });
      const cells = columns.map((column, at) => make("td", { role: "gridcell", tabindex: "-1", "data-line": line, "data-column": at, class: kindOf(columns, at) }));
      this.#cells.push([stub, ...cells]);
      body.append(make("tr", { role: "row", "data-row": line }, stub, make("td", { class: "share" }), make("td", { class: "tells" }), ...cells));
    });
    this.#table.replaceChildren(make("thead", {}, head, witness), body);
    this.#table.setAttribute("aria-rowcount", rows.length + 1);
    this.#at = { line: Math.min(this.#at.line, rows.length - 1), column: Math.min(this.#at.column, columns.length - 1) };
    this.#anchor = null;
  }

  #fill({ name, columns, rows }) {
    this.#table.setAttribute("aria-label", `Table ${name}`);
    columns.forEach(({ heading, type, unit }, at) => {
      const known = type ? { type, unit } : this.#desk.type(heading);
      this.#put(this.#cells[0][at + 1], heading, `${heading}${known.type ? `: ${known.type}` : ""}${known.unit ? ` [${known.unit}]` : ""}`, known);
    });
    const filter = this.#desk.condition;
    this.#table.classList.toggle("no-shares", this.#desk.doc.known && !rows.some(({ share }) => share));
    rows.forEach((row, line) => {
      const cells = this.#cells[line + 1];
      this.#put(cells[0], row.stub, `line ${row.name}`);
      row.cells.forEach((text, at) => this.#put(cells[at + 1], text, text.length > 40 ? text : ""));
      const line_ = cells[0].parentElement;
      line_.dataset.name = row.name;
      const share = line_.querySelector(".share");
      share.textContent = row.share?.text ?? "";
      share.title = row.share?.of ?? "";
      line_.dataset.lines = JSON.stringify(row.lines);
      const out = filter && row.lines.some((name) => filter.of.includes(name)) && !row.lines.some((name) => filter.can.includes(name) || filter.unknown.includes(name));
      line_.hidden = Boolean(out);
      line_.classList.toggle("unknown", Boolean(row.lines.some((name) => filter?.unknown.includes(name))));
    });
    this.#cells.flat().forEach((cell) => { cell.tabIndex = -1; });
    const here = this.#cell(this.#at);
    if (here) here.tabIndex = 0;
  }

  #put(cell, text, title, known = null) {
    if (this.#editing?.cell === cell) return;
    if (cell.dataset.text !== text || (known && cell.dataset.type !== known.type)) {
      cell.dataset.text = text;
      cell.replaceChildren(make("span", { class: "text" }, ...(known ? breakable(text) : [text])));
      if (known) {
        cell.dataset.type = known.type;
        if (known.type) cell.append(make("span", { class: "type" }, `${known.type}${known.unit ? ` [${known.unit}]` : ""}`));
      }
    }
    if (title) cell.title = title;
    else cell.removeAttribute("title");
  }

  // --- findings ---

  /** Findings stand below their line, in words; the witness of one of them is a column and a row. */
  #findings(shown) {
    const first = this.#desk.findings().find((one) => one.severity === "error" && one.witnesses.length);
    if (this.#shownWitness === null && first) this.#shownWitness = `${first.id} 0`;
    for (const old of this.#table.querySelectorAll("tr.finding")) old.remove();
    for (const cell of this.#table.querySelectorAll(".wrong-cell, .wrong-line, .region, .fails")) cell.classList.remove("wrong-cell", "wrong-line", "region", "fails");
    const found = this.#desk.findings();
    const rows = new Map([...this.#table.tBodies[0].rows].flatMap((row) => [row.dataset.name, ...linesOf(row)].map((name) => [name, row])));
    const span = shown.columns.length + 3;
    for (const one of found) {
      const row = rows.get(one.line);
      const note = make("tr", { class: `finding ${one.severity}`, "data-finding": one.id }, make("td", { colspan: span }, this.#told(one)));
      for (const name of one.lines) rows.get(name)?.classList.add("wrong-line");
      if (row && one.column !== null) row.querySelector(`[data-column="${one.column}"]`)?.classList.add("wrong-cell");
      let after = row;
      while (after?.nextElementSibling?.classList.contains("finding")) after = after.nextElementSibling;
      if (after) after.after(note);
      else this.#table.tBodies[0].prepend(note);
    }
    this.#witness(shown, found);
  }

  /** Bring a finding of the table into sight; what it tells, and where it is. */
  reveal(id) {
    const note = this.#table.querySelector(`[data-finding="${CSS.escape(id)}"]`);
    note?.scrollIntoView({ block: "center" });
    note?.querySelector("button")?.focus({ preventScroll: true });
  }

  #told(one) {
    const words = { error: "Wrong", warning: "Perhaps wrong", note: "Note" }[one.severity] ?? one.severity;
    const box = make("div", { class: "told" }, make("strong", {}, `${words}: `), ...spoken(one.message), one.meanwhile ? " (found with what is broken left out)" : "", " ",
      make("span", { class: "soft" }, `[${one.code}]`));
    const more = [];
    one.witnesses.forEach((witness, at) => {
      const key = `${one.id} ${at}`;
      const pressed = key === this.#shownWitness;
      const region = witness.region.length ? `Region: ${witness.region.join(", ")}${witness.inputs === null ? "" : `; ${witness.inputs}`}; what is not named is free.` : "";
      box.append(" ", make("button", { type: "button", class: "small", "aria-pressed": pressed, onclick: () => { this.#shownWitness = pressed ? "" : key; this.draw(); } },
        `${pressed ? "Hide" : "Show"} ${one.witnesses.length > 1 ? `input ${at + 1}` : "the input"}`));
      if (pressed) {
        more.push(make("div", { class: "witness-more code" }, `Input: ${witness.values.map(([name, text]) => `${name} = ${text}`).join(", ")}`));
        if (region) more.push(make("div", { class: "region-words" }, region));
        const run = make("div", { class: "witness-run" });
        more.push(make("button", { type: "button", class: "small", title: "What the table does at this input: each line, and why it does not match", onclick: () => this.#run(one, at, run) }, "Run the table at it"), run);
      }
    });
    const notes = one.notes.map((note) => make("div", { class: "soft" }, ...spoken(note)));
    if (notes.length > 2) box.append(make("details", { class: "soft" }, make("summary", {}, `${notes.length} notes`), ...notes));
    else box.append(...notes);
    box.append(...more);
    if (one.mendable) {
      const place = make("div", { class: "repairs" });
      box.append(place);
      this.#desk.offer(one, place);
    } else for (const help of one.help) box.append(make("div", { class: "help" }, "Help: ", ...spoken(help)));
    return box;
  }

  /** One look of the table, as the interpreter runs it; no cycle of the level is said to come to it. */
  async #run(one, at, place) {
    const ran = await this.#desk.try("proof.run", { finding: one.id, input: at, version: this.#desk.doc.version });
    if (!ran) return;
    place.replaceChildren(make("p", {}, make("strong", {}, ...spoken(ran.comes)), make("span", { class: "soft" },
      ". The interpreter ran the table for one look at this input; what that does not name is as a run begins. Whether a run comes to it is for `rcsc prove` to find.")),
    make("ul", {}, ...ran.lines.map((line) => make("li", {}, ...spoken(line)))));
  }

  #witness(shown, found) {
    const shows = found.flatMap((one) => one.witnesses.map((witness, at) => ({ key: `${one.id} ${at}`, witness, one })));
    const now = shows.find(({ key }) => key === this.#shownWitness) ?? (this.#shownWitness === "" ? null : undefined);
    if (now === undefined && this.#desk.doc.known) this.#shownWitness = null; // the finding is gone: the first that is left
    const line = this.#table.tHead.querySelector("tr.witness");
    this.#table.classList.toggle("with-witness", Boolean(now));
    line.replaceChildren();
    this.#table.tHead.querySelector("th.tells").textContent = now ? "this input" : "";
    if (!now) {
      for (const cell of this.#table.querySelectorAll("td.tells")) cell.textContent = "";
      return;
    }
    const { witness } = now;
    const named = new Set(shown.columns.map(({ heading }) => heading));
    const rest = witness.values.filter(([name]) => !named.has(name)).map(([name, text]) => `${name} = ${text}`);
    line.append(make("th", { class: "stub", scope: "row" }, "this input"), make("td", { class: "share" }), make("td", { class: "tells", title: rest.join(", ") }, rest.length ? `and ${rest.length} more` : ""),
      ...shown.columns.map((column, at) => {
        const value = witness.columns[at] ?? "", region = witness.regions[at] ?? "";
        return make("td", { class: `${kindOf(shown.columns, at)}${region ? " region" : ""}`, title: region ? `region: ${region}` : "" },
          value, region && region !== `${column.heading} = ${value}` ? make("span", { class: "type" }, `region: ${region.slice(column.heading.length + 1)}`) : "");
      }));
    shown.rows.forEach((row, at) => {
      const told = witness.rows[row.name];
      const tells = this.#cells[at + 1][0].parentElement.querySelector("td.tells");
      if (!told) { tells.textContent = ""; return; }
      const failed = told.failed.map((column) => shown.columns[column]?.heading).filter(Boolean);
      tells.textContent = told.holds === true ? "matches" : told.holds === false ? (failed.length ? `no: ${failed[0]}${failed.length > 1 ? ` +${failed.length - 1}` : ""}` : "no") : "not known";
      tells.title = failed.length ? `does not hold: ${failed.join(", ")}` : "";
      tells.classList.toggle("matches", told.holds === true);
      for (const column of told.failed) this.#cells[at + 1][column + 1]?.classList.add("fails");
      if (told.holds) shown.columns.forEach(({ kind }, column) => { if (kind === "condition" && (witness.regions[column] || !row.cells[column])) this.#cells[at + 1][column + 1].classList.add("region"); });
    });
  }

  // --- marks of others ---

  #mark(name, scroll = false) {
    for (const row of this.#table.tBodies[0]?.rows ?? []) {
      const is = Boolean(name) && (row.dataset.name === name || linesOf(row).includes(name)) && this.#bus.selection.table === this.#desk.table;
      row.classList.toggle("selected", is);
      if (is && scroll && !this.#table.contains(document.activeElement)) row.scrollIntoView({ block: "nearest" });
    }
  }

  #lit() {
    const lines = new Set(this.#desk.running.flatMap((level) => level.lines ?? []));
    for (const row of this.#table.tBodies[0]?.rows ?? []) {
      const is = linesOf(row).some((name) => lines.has(name));
      if (is && this.#desk.follows && !row.classList.contains("now")) row.scrollIntoView({ block: "nearest" });
      row.classList.toggle("now", is);
      const stub = row.querySelector("th.stub");
      if (stub) stub.dataset.now = is ? "runs" : "";
    }
  }

  // --- going about ---

  #cell({ line, column }) {
    return this.#cells[line + 1]?.[column + 1] ?? null;
  }

  #place(target) {
    const cell = target.closest?.("[data-line][data-column]");
    return cell ? { line: Number(cell.dataset.line), column: Number(cell.dataset.column) } : null;
  }

  go(at, focus = true, extend = false) {
    const cell = this.#cell(at);
    if (!cell) return;
    const before = this.#cell(this.#at);
    if (before) before.tabIndex = -1;
    if (extend) this.#anchor ??= this.#at;
    else this.#anchor = null;
    this.#at = at;
    cell.tabIndex = 0;
    if (focus) cell.focus({ preventScroll: true });
    cell.scrollIntoView({ block: "nearest", inline: "nearest" });
    this.#ranged();
    if (at.line >= 0) this.#bus.select({ table: this.#desk.table, line: this.#desk.shown?.rows[at.line]?.name ?? "" });
  }

  #range() {
    const from = this.#anchor ?? this.#at;
    return { top: Math.min(from.line, this.#at.line), low: Math.max(from.line, this.#at.line), left: Math.min(from.column, this.#at.column), right: Math.max(from.column, this.#at.column) };
  }

  #ranged() {
    const { top, low, left, right } = this.#range();
    const many = this.#anchor !== null;
    this.#cells.forEach((row, line) => row.forEach((cell, column) => {
      const is = many && line - 1 >= top && line - 1 <= low && column - 1 >= left && column - 1 <= right;
      cell.classList.toggle("in-range", is);
      if (is) cell.setAttribute("aria-selected", "true");
      else cell.removeAttribute("aria-selected");
    }));
  }

  /** The lines that are selected. */
  get lines() {
    const { top, low } = this.#range();
    return Array.from({ length: low - Math.max(0, top) + 1 }, (_, at) => Math.max(0, top) + at).filter((line) => !this.#hidden(line));
  }

  #hidden(line) {
    return line >= 0 && Boolean(this.#cells[line + 1]?.[0].parentElement.hidden);
  }

  #step(down, right, { extend = false, far = false } = {}) {
    const { rows, columns } = this.#desk.shown;
    let { line, column } = this.#at;
    do line += far ? Math.sign(down) * rows.length : down; while (!far && down && line >= 0 && line < rows.length && this.#hidden(line));
    column += far ? Math.sign(right) * columns.length : right;
    line = Math.max(-1, Math.min(rows.length - 1, line));
    if (far && down) for (; line >= 0 && line < rows.length && this.#hidden(line);) line -= Math.sign(down);
    if (this.#hidden(line)) return;
    this.go({ line, column: Math.max(-1, Math.min(columns.length - 1, column)) }, true, extend);
  }

  #key(event) {
    if (this.#editing || !this.#desk.shown || !this.#place(event.target)) return;
    const { key, shiftKey: extend, altKey } = event;
    const ctrl = event.ctrlKey || event.metaKey;
    const done = () => { event.preventDefault(); event.stopPropagation(); };
    const { columns, rows } = this.#desk.shown;
    const moves = { ArrowDown: [1, 0], ArrowUp: [-1, 0], ArrowRight: [0, 1], ArrowLeft: [0, -1] };
    if (altKey && key === "Enter") { done(); this.insertLine(); } else if (altKey) return;
    else if (moves[key]) { done(); this.#step(...moves[key], { extend, far: ctrl }); } else if (key === "Home") { done(); this.go({ line: ctrl ? 0 : this.#at.line, column: -1 }, true, extend); } else if (key === "End") { done(); this.go({ line: ctrl ? rows.length - 1 : this.#at.line, column: columns.length - 1 }, true, extend); } else if (key === "PageDown" || key === "PageUp") { done(); this.#step(key === "PageDown" ? Math.min(10, rows.length - 1 - this.#at.line) : -Math.min(10, this.#at.line), 0, { extend }); } else if (key === "Tab") {
      const next = this.#at.column + (extend ? -1 : 1);
      if (next >= -1 && next < columns.length) { done(); this.go({ line: this.#at.line, column: next }); }
    } else if (key === "Enter" || key === "F2") { done(); this.edit(this.#at); } else if (key === "Escape") { if (this.#anchor) { done(); this.go(this.#at); } } else if (ctrl && key === "Delete") { done(); this.deleteLines(); } else if (key === "Delete" || key === "Backspace") { done(); this.#clear(); } else if (ctrl && key.toLowerCase() === "z") { done(); if (extend) this.#desk.redo(); else this.#desk.undo(); } else if (ctrl && key.toLowerCase() === "y") { done(); this.#desk.redo(); } else if (ctrl && key.toLowerCase() === "a") { done(); this.go({ line: 0, column: -1 }); this.go({ line: rows.length - 1, column: columns.length - 1 }, true, true); } else if (!ctrl && key.length === 1) { done(); if (key === " ") this.#bus.keys.find(({ keys }) => keys === "space")?.run(); else this.edit(this.#at, key); } // no value begins with a space: it runs and pauses, here too
  }

  #press(event) {
    const at = this.#place(event.target);
    if (!at || this.#editing?.cell.contains(event.target)) return;
    if (this.#editing) this.#commit();
    this.go(at, true, event.shiftKey);
    if (!event.shiftKey) this.#pressed = at;
    addEventListener("pointerup", () => { this.#pressed = null; }, { once: true });
  }

  #pressed = null;

  #drag(event) {
    const at = this.#pressed && this.#place(event.target);
    if (at && (at.line !== this.#at.line || at.column !== this.#at.column)) {
      this.#anchor ??= this.#pressed;
      this.go(at, true, true);
    }
  }

  // --- changing ---

  /** Let a cell be typed into; `typed` is what begins it, in place of what it says. */
  edit(at, typed = null) {
    const cell = this.#cell(at);
    if (!cell || (at.line < 0 && at.column < 0)) return;
    this.go(at, false);
    const before = cell.dataset.text ?? "";
    const input = make("input", { class: "cell-input", "aria-label": `${this.#name(at)}, edited`, spellcheck: "false", autocomplete: "off" });
    input.value = typed ?? before;
    input.size = Math.max(6, input.value.length + 1);
    this.#editing = { cell, input, at, before };
    cell.classList.add("editing");
    cell.replaceChildren(input);
    input.focus();
    input.setSelectionRange(input.value.length, input.value.length);
    input.addEventListener("input", () => { input.size = Math.max(6, input.value.length + 1); });
    input.addEventListener("keydown", (event) => this.#typing(event));
    input.addEventListener("blur", () => { if (this.#editing?.input === input) this.#commit(null, false); });
  }

  #name({ line, column }) {
    const { columns, rows } = this.#desk.shown;
    return `line ${line < 0 ? "heading" : rows[line]?.name}, ${column < 0 ? "name" : columns[column]?.heading}`;
  }

  #typing(event) {
    const { line, column } = this.#editing.at;
    const { columns, rows } = this.#desk.shown;
    const next = { Enter: { line: event.shiftKey ? line - 1 : line + 1, column }, Tab: { line, column: column + (event.shiftKey ? -1 : 1) } }[event.key];
    event.stopPropagation();
    if (event.key === "Escape") { event.preventDefault(); this.#drop(); this.go({ line, column }); } else if (next) {
      event.preventDefault();
      const inside = next.line >= -1 && next.line < rows.length && next.column >= -1 && next.column < columns.length;
      this.#commit(inside ? next : { line, column });
    } else if (event.ctrlKey && event.key === "s") { event.preventDefault(); this.#commit({ line, column }); this.#desk.save(); }
  }

  #drop() {
    const { cell, before } = this.#editing;
    this.#editing = null;
    cell.classList.remove("editing");
    delete cell.dataset.text;
    delete cell.dataset.type;
    this.#put(cell, before, "");
    this.draw();
  }

  /** Write what was typed; then go on to another cell, if one is named. */
  async #commit(next = null, focus = true) {
    const { input, at, before } = this.#editing;
    const text = input.value;
    this.#drop();
    if (next) this.go(next, focus);
    if (text.trim() === before) return;
    const cell = this.#cell(at);
    cell.dataset.text = text.trim();
    cell.replaceChildren(make("span", { class: "text waits" }, text.trim()));
    const done = await this.write(at, [[text]]);
    cell.querySelector(".waits")?.classList.remove("waits");
    if (!done) {
      delete cell.dataset.text;
      this.draw();
      if (focus && !this.#editing) this.edit(at, text); // who types elsewhere by now goes on there
    }
  }

  /** Write cells from a corner on; undefined leaves a cell as it is. */
  async write({ line, column }, rows) {
    performance.mark("studio.key");
    return this.#desk.try("tables.cells", { line, column, rows: rows.map((cells) => ({ cells: cells.map((text) => ({ text })) })) });
  }

  #clear() {
    const { top, low, left, right } = this.#range();
    const from = Math.max(0, left), down = Math.max(0, top);
    if (right < 0 || low < 0) return;
    this.write({ line: down, column: from }, this.#seen(down, this.lines.map(() => Array(right - from + 1).fill(""))));
  }

  /** The rows, with one that changes nothing for each line that the filter hides. */
  #seen(top, rows) {
    const every = [], waiting = [...rows];
    for (let line = top; waiting.length; line += 1) every.push(this.#hidden(line) ? rows[0].map(() => undefined) : waiting.shift());
    return every;
  }

  insertLine() {
    if (!this.#desk.shown) return;
    const at = this.#at.line + 1;
    const { rows } = this.#desk.shown;
    const place = rows[at - 1]?.default ? at - 1 : at;
    this.#wanted = { line: place, column: 0 };
    this.#desk.try("tables.line", { at: place }).then((done) => { if (!done) this.#wanted = null; });
  }

  deleteLines() {
    const lines = this.lines;
    if (lines.length) this.#desk.try("tables.delete", { lines: lines.map((line) => ({ line })) });
  }

  insertColumn(heading, action) {
    const { columns } = this.#desk.shown;
    const conditions = columns.filter(({ kind }) => kind === "condition").length;
    const here = this.#at.column + 1;
    const at = action ? Math.max(conditions, Math.min(columns.length, here)) : Math.max(0, Math.min(conditions, here));
    this.#wanted = { line: Math.max(0, this.#at.line), column: at };
    return this.#desk.try("tables.column", { at, heading, action }).then((done) => { if (!done) this.#wanted = null; return done; });
  }

  deleteColumn() {
    if (this.#at.column >= 0) this.#desk.try("tables.delete", { column: this.#at.column });
    else this.#bus.say("go to a cell of the column that is to go", { wrong: true });
  }

  #clip(kind, event) {
    if (this.#editing || !this.#desk.shown) return;
    const { top, low, left, right } = this.#range();
    event.preventDefault();
    if (kind === "paste") { this.#paste(event.clipboardData.getData("text/plain")); return; }
    const rows = [];
    for (let line = top; line <= low; line += 1) if (!this.#hidden(line)) rows.push(this.#cells[line + 1].slice(left + 1, right + 2).map((cell) => cell.dataset.text ?? ""));
    event.clipboardData.setData("text/plain", textOf(rows));
    if (kind === "cut") this.#clear();
  }

  /** Write what was copied from the upper left corner of what is selected on, as often as that has room for it; then it is selected. */
  async #paste(text) {
    const { top, low, left, right } = this.#range();
    const rows = filling(cellsOf(text), this.lines.length + (top < 0), right - left + 1);
    const most = Math.max(...rows.map((row) => row.length));
    if (most + left > this.#desk.shown.columns.length) {
      this.#bus.say(`what was copied is ${most} columns wide: there is no room for it here`, { wrong: true });
      return;
    }
    const every = this.#seen(top, rows), at = this.#at;
    if (!await this.write({ line: top, column: left }, every) || this.#editing || at.line !== this.#at.line || at.column !== this.#at.column) return;
    this.go({ line: top, column: left }, this.#table.contains(document.activeElement));
    this.#anchor = { line: Math.min(top + every.length, this.#desk.shown.rows.length) - 1, column: left + most - 1 };
    this.#ranged();
  }
}
