// The same file as text: what is typed goes to the server as edits, one after the other; what others do comes in.

import { make, Refusal } from "../bus.js";
import { spoken } from "../make.js";
import { Editor } from "./editor.js";

export class TextView {
  #desk; #bus; #root; #editor; #sent = null; #sending = null; #lost = null; #version = 0; #base = ""; #told = ""; #coloured = ""; #wanted = null;

  constructor(root, bus, desk) {
    this.#desk = desk;
    this.#bus = bus;
    this.#root = root;
    root.classList.add("text-view");
    this.#editor = new Editor(root, {
      typed: (bar) => { desk.follow(""); this.#send(); if (bar) this.#key("align"); },
      moved: () => this.#selects(),
      undo: () => desk.undo(), redo: () => desk.redo(),
      offers: (place) => this.#asked("text.offers", place), about: (place) => this.#asked("text.about", place),
      declared: () => this.#declared(), key: (key) => this.#key(key),
    });
    desk.settled = () => this.#editor.done().then(() => this.#settled());
    addEventListener("beforeunload", (event) => { if (this.file && this.#editor.text !== this.#base) event.preventDefault(); }); // typed, and not sent
    desk.on(() => this.take());
    bus.on("selection", (now, changed) => { if (changed?.has("line") || changed?.has("table")) this.#show(now); });
  }

  /** Take the server's text, unless something is typed that it has not. */
  take() {
    const { doc, file } = this.#desk;
    if (!doc) return;
    if (this.file !== file) {
      Object.assign(this, { file });
      this.#sent = this.#lost = null;
      this.#base = doc.text;
      this.#editor.begin(doc.text);
      this.#version = doc.version;
      this.#arrive();
    } else if (this.#sent === null && doc.version !== this.#version) {
      if (doc.text === this.#lost) this.#base = this.#lost; // it was taken before the connection went
      this.#lost = null;
      this.#put(this.#together(doc.text));
      this.#base = doc.text;
      this.#version = doc.version; // of the base: while an edit is under way neither is known
    }
    this.marks();
    if (this.#sent === null && this.#editor.text !== this.#base) this.#send();
  }

  /** What others made of the text, with what is typed here and not sent. */
  #together(theirs, base = this.#base) {
    const mine = this.#editor.text;
    const both = mine === base ? theirs : merged(base, mine, theirs);
    if (both === theirs && mine !== base && mine !== theirs) this.#bus.say("others changed the same letters: what was typed here is not taken", { wrong: true });
    return both;
  }

  #put(text) {
    const { text: now } = this.#editor;
    if (text !== now) this.#editor.replace(change(now, text));
  }

  #send() {
    if (this.#sent === null && this.#editor.text !== this.#base) this.#sending = this.#sends();
  }

  async #sends() {
    const { text } = this.#editor;
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

  // --- what is asked about places ---

  /** Ask about a place of the text as it is here, once the server has that; nothing where it has another by then. */
  async #asked(kind, [line, column], more = {}) {
    const { text } = this.#editor, { file } = this;
    await this.#settled();
    if (file !== this.file || this.#editor.text !== text || this.#base !== text) return null;
    try {
      return await this.#bus.ask(kind, { file, version: this.#version, line, column, ...more });
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      return null; // another text by now: whoever asked asks again
    }
  }

  /** Do in a table what a key does there, and go where the cursor is then. */
  async #key(key) {
    const { text } = this.#editor;
    const done = await this.#asked("tables.key", this.#editor.place, { key });
    if (done?.cursor && this.#version === done.version && this.#editor.text === this.#base) this.#editor.go(done.cursor);
    else if (key !== "align" && !done && this.#editor.text === text) this.#bus.say("the text was changed meanwhile: press the key again");
  }

  async #declared() {
    const found = await this.#asked("text.declared", this.#editor.place);
    if (!found) return this.#bus.say("nothing here is a name that is declared");
    this.#desk.follow("");
    this.#wanted = found;
    if (found.file === this.file) this.#arrive();
    else await this.#desk.open(found.file);
    return undefined;
  }

  /** Go to the declaration that is wanted, once its file is here. */
  #arrive() {
    if (this.#wanted?.file !== this.file) return;
    this.#editor.go(this.#wanted.start, this.#wanted.end);
    this.#editor.focus();
    this.#wanted = null;
  }

  // --- what is known of the text ---

  /** Show findings and colours of the text as it is; of an older one nothing is shown. */
  marks() {
    const { doc, file } = this.#desk;
    const here = doc?.known && doc.version === this.#version && this.#editor.text === this.#base;
    const key = here ? `${file} ${doc.version} ${JSON.stringify(doc.findings.map(({ id, message }) => [id, message]))}` : "";
    this.#root.dataset.known = here ? "yes" : "no";
    if (key !== this.#told) {
      this.#told = key;
      this.#editor.found(here ? doc.findings.filter(({ area }) => area).map((one) => ({ ...one, tell: () => this.#words(one) })) : []);
    }
    if (here && this.#root.checkVisibility() && this.#coloured !== `${file} ${doc.version}`) this.#colours(`${file} ${doc.version}`);
  }

  async #colours(key) {
    this.#coloured = key;
    const found = await this.#asked("text.colours", [0, 0]);
    if (found && `${this.file} ${this.#version}` === key && this.#editor.text === this.#base) this.#editor.coloured(found);
    else if (this.#coloured === key) this.#coloured = "";
  }

  /** A finding in words, with the input that shows it and the repairs that are proved, or checked. */
  #words(one) {
    const box = make("div", { class: "told" }, ...spoken(one.message), " ", make("span", { class: "soft" }, `[${one.code}]`));
    const [witness] = one.witnesses;
    if (witness) {
      box.append(make("div", { class: "code" }, `for instance ${witness.values.map(([name, text]) => `${name} = ${text}`).join(", ")}`));
      if (witness.region.length) box.append(make("div", { class: "soft" }, `region: ${witness.region.join(", ")}`));
    }
    const place = make("div", { class: "repairs" });
    box.append(place);
    box.addEventListener("keydown", (event) => { if (event.target.matches("button") && /^( |Enter)$/.test(event.key)) event.stopPropagation(); }); // they press it
    if (one.mendable) this.#desk.offer(one, place);
    else for (const help of one.help) place.append(make("div", { class: "help" }, "Help: ", ...spoken(help)));
    return box;
  }

  /** The cursor in a line of a table selects that line everywhere. */
  #selects() {
    const [line] = this.#editor.place;
    for (const { name, rows } of this.#desk.doc?.tables ?? []) {
      const row = rows.find((one) => one.line <= line && line <= one.past);
      if (row) {
        if (name !== this.#desk.table) this.#desk.open(this.#desk.file, name);
        this.#bus.select({ table: name, line: row.name });
      }
    }
  }

  #show({ table, line }) {
    if (this.#editor.focused || table !== this.#desk.table) return;
    const { rows } = this.#desk.shown ?? { rows: [] };
    const row = line ? rows.find(({ name }) => name === line) : rows[0];
    if (row && this.#desk.file === this.file) this.#editor.show(row.line);
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
