// The same file as text: what is typed goes to the server as edits, one after the other; what others do comes in.

import { make, Refusal } from "../bus.js";

export class TextView {
  #desk; #bus; #area; #gutter; #sent = null; #sending = null; #lost = null; #version = 0; #base = "";

  constructor(root, bus, desk) {
    this.#desk = desk;
    this.#bus = bus;
    this.#gutter = make("div", { class: "gutter", "aria-hidden": "true" });
    this.#area = make("textarea", { class: "text-area", spellcheck: "false", autocomplete: "off", wrap: "off", "aria-label": "Text of the file" });
    root.classList.add("text-view");
    root.append(this.#gutter, this.#area);
    this.#area.addEventListener("input", () => { this.#lines(); this.#send(); });
    this.#area.addEventListener("scroll", () => { this.#gutter.scrollTop = this.#area.scrollTop; });
    this.#area.addEventListener("keydown", (event) => this.#key(event));
    this.#area.addEventListener("beforeinput", (event) => {
      if (!event.inputType.startsWith("history")) return;
      event.preventDefault();
      if (event.inputType === "historyUndo") desk.undo();
      else desk.redo();
    });
    desk.settled = () => this.#settled();
    addEventListener("beforeunload", (event) => { if (this.file && this.#area.value !== this.#base) event.preventDefault(); }); // typed, and not sent
    for (const kind of ["keyup", "click"]) this.#area.addEventListener(kind, () => this.#selects());
    desk.on(() => this.take());
    bus.on("selection", (now, changed) => { if (changed?.has("line")) this.#show(now); });
  }

  /** Take the server's text, unless something is typed that it has not. */
  take() {
    const { doc, file } = this.#desk;
    if (!doc) return;
    if (this.file !== file) {
      Object.assign(this, { file });
      this.#sent = this.#lost = null;
      this.#base = this.#area.value = doc.text;
      this.#version = doc.version;
    } else if (this.#sent === null && doc.version !== this.#version) {
      if (doc.text === this.#lost) this.#base = this.#lost; // it was taken before the connection went
      this.#lost = null;
      this.#put(this.#together(doc.text));
      this.#base = doc.text;
      this.#version = doc.version; // of the base: while an edit is under way neither is known
    }
    this.#lines();
    if (this.#sent === null && this.#area.value !== this.#base) this.#send();
  }

  /** What others made of the text, with what is typed here and not sent. */
  #together(theirs, base = this.#base) {
    const mine = this.#area.value;
    const both = mine === base ? theirs : merged(base, mine, theirs);
    if (both === theirs && mine !== base && mine !== theirs) this.#bus.say("others changed the same letters: what was typed here is not taken", { wrong: true });
    return both;
  }

  /** Another text, the cursor where it was in what did not change. */
  #put(text) {
    if (text === this.#area.value) return;
    const { selectionStart, selectionEnd, scrollTop, value } = this.#area;
    const { start, end, put } = change(value, text);
    const moved = (at) => (at <= start ? at : at >= end ? at + put.length - (end - start) : start + Math.min(put.length, at - start));
    this.#area.value = text;
    this.#area.setSelectionRange(moved(selectionStart), moved(selectionEnd));
    this.#area.scrollTop = scrollTop;
  }

  #send() {
    if (this.#sent === null && this.#area.value !== this.#base) this.#sending = this.#sends();
  }

  async #sends() {
    const text = this.#area.value;
    const { start, end, put } = change(this.#base, text);
    const [start_line, start_column] = place(this.#base, start), [end_line, end_column] = place(this.#base, end);
    let gone = false;
    this.#sent = text;
    performance.mark("studio.key");
    try {
      await this.#bus.ask("tables.edit", { file: this.file, version: this.#version, edits: [{ start_line, start_column, end_line, end_column, text: put }] });
      this.#base = text;
      this.#lost = null;
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      gone = error.lost;
      if (gone) this.#lost ??= text; // what is asked without a connection was never sent
      else if (!error.message.includes("meanwhile")) {
        this.#bus.say(error.message, { wrong: true, helps: error.helps });
        this.#put(this.#together(this.#base, text)); // what was typed after it stays
      }
    } finally {
      this.#sent = null;
    }
    if (!gone) this.take();
    else this.#bus.say("no connection to the studio: what is typed stays here, and is sent when it is back", { wrong: true });
  }

  /** Wait for what is under way: keys are quicker than answers. */
  async #settled() {
    while (this.#sent !== null) await this.#sending;
  }

  #key(event) {
    const ctrl = event.ctrlKey || event.metaKey;
    if (ctrl && event.key.toLowerCase() === "z") {
      event.preventDefault();
      if (event.shiftKey) this.#desk.redo();
      else this.#desk.undo();
    } else if (ctrl && event.key.toLowerCase() === "y") {
      event.preventDefault();
      this.#desk.redo();
    }
  }

  #lines() {
    const { doc } = this.#desk;
    const marks = new Map();
    if (doc?.known) for (const one of doc.findings) if (one.area) marks.set(one.area[0][0], [...(marks.get(one.area[0][0]) ?? []), one]);
    const many = this.#area.value.split("\n").length;
    const shape = `${many} ${[...marks.keys()].join()}`;
    if (this.#gutter.dataset.shape === shape) return;
    this.#gutter.dataset.shape = shape;
    this.#gutter.replaceChildren(...Array.from({ length: many }, (_, at) => {
      const found = marks.get(at);
      const worst = found?.some(({ severity }) => severity === "error") ? "error" : found ? "note" : "";
      return make("div", { class: worst, title: found?.map(({ message }) => message).join("\n") }, found ? `${worst === "error" ? "✗" : "•"} ${at + 1}` : String(at + 1));
    }), make("div", {}, " "));
    this.#gutter.scrollTop = this.#area.scrollTop;
  }

  /** The cursor in a line of a table selects that line everywhere. */
  #selects() {
    const [line] = place(this.#area.value, this.#area.selectionStart);
    for (const { name, rows } of this.#desk.doc?.tables ?? []) {
      const row = rows.find((one) => one.line <= line && line <= one.past);
      if (row) {
        if (name !== this.#desk.table) this.#desk.open(this.#desk.file, name);
        this.#bus.select({ table: name, line: row.name });
      }
    }
  }

  #show({ table, line }) {
    if (document.activeElement === this.#area || table !== this.#desk.table) return;
    const row = this.#desk.shown?.rows.find(({ name }) => name === line);
    if (!row) return;
    const high = parseFloat(getComputedStyle(this.#area).lineHeight) || 16;
    const top = row.line * high;
    if (top < this.#area.scrollTop || top > this.#area.scrollTop + this.#area.clientHeight - 2 * high) this.#area.scrollTop = Math.max(0, top - this.#area.clientHeight / 3);
  }
}

/** What makes one text of another: the least piece that differs. */
export function change(before, after) {
  let start = 0;
  const most = Math.min(before.length, after.length);
  while (start < most && before[start] === after[start]) start += 1;
  let same = 0;
  while (same < most - start && before[before.length - 1 - same] === after[after.length - 1 - same]) same += 1;
  return { start, end: before.length - same, put: after.slice(start, after.length - same) };
}

/** What was typed here, and what others did, together; where they touch the same letters what others did stays. */
export function merged(base, mine, theirs) {
  const own = change(base, mine), other = change(base, theirs);
  if (own.end <= other.start) return theirs.slice(0, own.start) + own.put + theirs.slice(own.end);
  const moved = other.put.length - (other.end - other.start);
  if (own.start >= other.end) return theirs.slice(0, own.start + moved) + own.put + theirs.slice(own.end + moved);
  return theirs;
}

/** Line and column of an offset. */
export function place(text, offset) {
  const before = text.slice(0, offset);
  const line = before.split("\n").length - 1;
  return [line, offset - (before.lastIndexOf("\n") + 1)];
}
