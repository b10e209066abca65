// The open file that grid, text and graph show: one for the page, so that they always show the same.

import { make, Refusal } from "../bus.js";
import { spoken } from "../make.js";

export const SIGNS = { proved: "✓", "proved, trusting": "◑", conditional: "◑", stale: "…", undecided: "✗", refuted: "✗", "has errors": "✗" }; // beside the words

const desks = new WeakMap();

/** The desk of this page. */
export function deskOf(bus) {
  if (!desks.has(bus)) desks.set(bus, new Desk(bus));
  return desks.get(bus);
}

export class Desk {
  files = []; // { file, tables, levels }
  file = "";
  doc = null; // as the server told it last
  conflict = ""; // how the file on disk and the text here differ, in words; empty where nothing has to be decided
  table = ""; // the name of the table that is shown
  condition = null; // { text, of, can, unknown, every } of the filter: names of lines, `of` which they are
  settled = async () => {}; // waits until all that is typed is sent, or cannot be; of the view of the text
  follows = ""; // the level whose table is shown as it runs; empty where one is chosen, or changed
  #bus;
  #heard = new Set();
  #stop = null;
  #last = null; // the answer to the last change of this file, which may be under way
  #decided = 0; // how often it was decided here whose text is on disk
  #sought = null; // { file, code, message } of the finding to go to
  #repairs = new Map(); // by file, version and finding
  #types = new Map(); // heading -> { type, unit }, of the last text that was looked at

  constructor(bus) {
    this.#bus = bus;
    bus.on("tables.state", ({ files }) => this.#greeted(files));
    bus.on("selection", (now, changed) => {
      if (changed?.has("table") && now.table !== this.table) this.#go(now);
      else if (changed?.has("level") && this.follows) this.follow(now.level);
    });
    bus.on("moment", () => this.#moved());
    let found = "";
    bus.on("time.state", ({ source, name, finding }) => { // a finding that is opened is seen at its table
      const now = source === "log" && finding?.level ? `${name} ${finding.level}` : "";
      if (now && now !== found) this.follow(finding.level);
      found = now;
    });
    addEventListener("focus", () => { if (this.file) this.open(this.file, this.table); });
  }

  /** Hear of every change of the file, of the table, and of the filter; at once, too. */
  on(handler) {
    this.#heard.add(handler);
    if (this.doc) handler(this);
    return () => this.#heard.delete(handler);
  }

  tell() {
    if (this.doc) for (const handler of this.#heard) handler(this);
  }

  /** Show at every tick the table that a level runs then; none, to stay at the one that is shown. */
  follow(level) {
    if (level === this.follows) return;
    this.follows = level;
    if (level) this.#bus.select({ level });
    this.#moved();
    this.tell();
  }

  /** The levels that run the table that is shown, at the tick that is shown. */
  get running() {
    return !this.doc ? [] : (this.#bus.latest("moment")?.levels ?? []).filter(({ level, table }) => table === this.table && this.#home(level, table)?.file === this.file);
  }

  get shown() {
    return this.doc?.tables.find(({ name }) => name === this.table) ?? null;
  }

  /** Findings of the table that is shown; and those of elsewhere. */
  findings(here = true) {
    return (this.doc?.findings ?? []).filter((one) => (one.table === this.table) === here);
  }

  /** Open a file, and go to one of its findings once they are known. */
  async seek(file, code, message) {
    this.follow("");
    this.#sought = { file, code, message };
    await this.open(file);
    this.#arrive();
  }

  #arrive() {
    const { file, code, message } = this.#sought ?? {};
    if (file !== this.file || !this.doc?.known) return;
    this.#sought = null;
    const one = this.doc.findings.find((each) => each.code === code && each.message === message);
    if (!one) return;
    if (one.table) this.open(file, one.table);
    this.#bus.tell("reveal", one.id);
  }

  async open(file, table = "") {
    if (!file) return;
    const changed = file !== this.file;
    try {
      if (changed) {
        this.#stop?.();
        this.#last = null; // its versions say nothing of another file
        Object.assign(this, { file, doc: null, table, condition: null });
        this.#types.clear();
        this.#stop = this.#bus.on(`tables.file/${file}`, (doc) => this.#take(doc));
      } else if (table && table !== this.table) {
        Object.assign(this, { table, condition: null });
        this.#selected();
        this.tell();
      }
      const decided = this.#decided;
      const { disk, dirty } = await this.#bus.ask("tables.open", { file });
      if (file !== this.file || decided !== this.#decided) return; // how the disk was before says nothing of how it is
      const before = this.conflict;
      this.conflict = disk === "same" ? "" : disk === "gone" ? `${file} is no longer on disk.` : dirty ? `${file} was changed on disk, and here.` : "";
      if (this.conflict !== before) this.tell();
    } catch (error) {
      this.#refused(error);
    }
  }

  /** Ask something about the text as it is here; what is changed stays in view, and is changed in turn. */
  async ask(kind, body = {}, options = {}) {
    if (!kind.startsWith("tables.") && kind !== "graph.draw") return this.#asked(kind, body, options);
    this.follow("");
    const answer = this.#inTurn(kind, { ...this.#place, ...body }, options);
    this.#last = answer.catch(() => {});
    return answer;
  }

  /** Change the text as the change before leaves it: keys are quicker than answers. What others changed meanwhile is not changed unseen. */
  async #inTurn(kind, body, options) {
    const left = await this.#last;
    return this.#bus.ask(kind, { ...body, version: Math.max(left?.version ?? 0, body.version) }, options);
  }

  #asked(kind, body, options) {
    return this.#bus.ask(kind, { ...this.#place, ...body }, options);
  }

  get #place() {
    return { file: this.file, version: this.doc?.version ?? 0, table: this.table };
  }

  /** The same; where it is refused it is said, and undefined returned. */
  async try(kind, body = {}, options = {}) {
    return this.#said(this.ask(kind, body, options));
  }

  async #said(answer) {
    try {
      return await answer;
    } catch (error) {
      this.#refused(error);
      return undefined;
    }
  }

  async undo() {
    const done = await this.#next("tables.undo");
    if (done) this.#bus.say(`undone: ${done.made}`);
  }

  async redo() {
    const done = await this.#next("tables.redo");
    if (done) this.#bus.say(`done again: ${done.made}`);
  }

  /** Ask about the text as what was asked before leaves it: keys are quicker than answers. */
  #next(kind) {
    this.follow("");
    const answer = this.#ready().then(() => this.#said(this.#asked(kind)));
    this.#last = answer.catch(() => {});
    return answer;
  }

  async #ready() {
    await this.#last;
    await this.settled();
  }

  async save(over = false) {
    await this.#ready(); // what was typed before it is written, too
    this.#decided += 1;
    try {
      const { made } = await this.ask("tables.save", { over });
      this.#bus.say(made ? `${this.file} is written, laid out` : `${this.file} is written as it is: a text that does not parse is not laid out`);
      this.conflict = "";
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      this.conflict = error.message.includes("on disk") ? error.message : "";
      this.#refused(error);
    }
    this.tell();
  }

  async take() {
    this.#decided += 1;
    this.conflict = "";
    await this.#next("tables.take");
    this.tell();
  }

  /** Show only lines that can match where a condition holds; all for an empty one. */
  async filter(text) {
    if (!text.trim()) {
      this.condition = null;
      this.tell();
      return;
    }
    const of = this.shown?.rows.map(({ name }) => name) ?? [];
    const answer = await this.try("proof.filter", { condition: text });
    this.condition = answer ? { text, of, ...answer } : null; // what is no condition hides nothing
    this.tell();
  }

  /** Offer the repairs of a finding in an element, as buttons that make them; each finding is asked about once. */
  async offer(one, place) {
    const { version } = this.doc;
    const key = `${this.file} ${version} ${one.id}`;
    place.replaceChildren(make("span", { class: "soft" }, "looking for repairs …"));
    if (!this.#repairs.has(key)) {
      if (this.#repairs.size > 200) this.#repairs.clear();
      this.#repairs.set(key, this.ask("proof.repairs", { finding: one.id, version }).catch(() => []));
    }
    const offered = await this.#repairs.get(key);
    place.replaceChildren(...offered.map((repair) => make("div", {},
      make("button", { type: "button", class: "repair", onclick: () => this.try("proof.repair", { finding: one.id, repair: repair.id, version }) }, ...spoken(repair.title)),
      make("span", { class: "soft" }, ...spoken(` ${repair.certain ? "Proved" : "Checked"}: ${[repair.proved, repair.clears ? "nothing is then wrong with the table" : ""].filter(Boolean).join("; ") || "the finding is gone, and no other comes"}.`)))));
    if (!offered.length) for (const help of one.help) place.append(make("div", { class: "help" }, "Help: ", ...spoken(help)));
  }

  type(heading) {
    return this.#types.get(`${this.table} ${heading}`) ?? { type: "", unit: "" };
  }

  #take(doc) {
    if (doc.version < (this.doc?.version ?? 0)) return;
    const stale = this.condition && this.doc && doc.version !== this.doc.version;
    this.doc = doc;
    for (const { name, columns } of doc.tables) {
      for (const { heading, type, unit } of columns) if (type) this.#types.set(`${name} ${heading}`, { type, unit });
    }
    if (!this.shown) this.table = doc.tables[0]?.name ?? "";
    this.#selected();
    this.tell();
    if (stale && doc.known) this.filter(this.condition.text);
    this.#arrive();
  }

  #selected() {
    if (this.#bus.selection.table !== this.table) this.#bus.select({ table: this.table, line: "" }); // a line is one of its table
  }

  #greeted(files) {
    this.files = files;
    if (!this.file) {
      const first = files.find((each) => each.first) ?? files.find(({ levels }) => levels.length) ?? files[0];
      if (first) this.open(first.file, first.tables[0]);
      if (first?.levels.length && !this.follows) this.follow(first.levels[0]); // the table that runs, until another is chosen
    } else {
      this.open(this.file, this.table); // the connection was lost meanwhile
    }
    this.tell();
  }

  /** The file in which a level has a table. */
  #home(level, table) {
    const named = this.files.filter(({ tables }) => tables.includes(table));
    return named.find(({ levels }) => levels.includes(level)) ?? named.find(({ levels }) => levels.length) ?? named[0];
  }

  #go({ level, table }) {
    const found = table && this.#home(level, table);
    if (!found) return;
    this.follow("");
    this.open(found.file, table);
  }

  #moved() {
    const ran = this.follows && this.#bus.latest("moment")?.levels.find(({ level }) => level === this.follows);
    if (!ran?.table) return;
    const found = this.#home(ran.level, ran.table);
    if (found && (found.file !== this.file || ran.table !== this.table)) this.open(found.file, ran.table);
  }

  #refused(error) {
    if (!(error instanceof Refusal)) throw error;
    this.#bus.say(error.message, { wrong: true, helps: error.helps });
  }
}

/** A heading that may be broken after `_` and `.`, as the text of the table breaks it. */
export function breakable(text) {
  return text.split(/(?<=[_.])(?=\w)/).flatMap((piece, at) => (at ? [make("wbr"), piece] : [piece]));
}

/** What a column is, as the style has it: a condition or an action, and the first of these. */
export function kindOf(columns, at) {
  const { kind } = columns[at];
  const first = kind !== "condition" && (at === 0 || columns[at - 1].kind === "condition");
  return `${kind === "condition" ? "condition" : "action"}${first ? " first" : ""}`;
}
