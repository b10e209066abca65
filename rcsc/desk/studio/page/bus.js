// What views share: questions, events, what is selected, and the keys.
//
//   await bus.ask("run.type", { line: "step 5" }, { progress: (how) => ..., signal })
//   bus.on("run.state", (state) => ...)          at once with the latest, where there is one
//   bus.select({ level: "task", line: "5" })     every view follows: bus.on("selection", (now, changed) => ...)
//   bus.key("ctrl+s", "Write the file", () => ..., "Tables")

export { make } from "./make.js";

/** The server, or the page, did not do what was asked; `code` is what `rcsc explain` knows, `helps` are sentences; `lost` where nobody knows whether it was done. */
export class Refusal extends Error {
  constructor({ code = "", text, helps = [], lost = false }) {
    super(text);
    Object.assign(this, { code, helps, lost });
  }
}

/** Events, selection and keys of a page; who answers its questions is a matter of who extends it, with `ask`. */
export class Bus {
  #handlers = new Map(); // by kind: a set
  #latest = new Map(); // by kind of event
  #selection = Object.freeze({ system: "", level: "", table: "", line: "", tick: null, follow: true });
  keys = []; // { keys, what, run, where }

  /** Whether somebody answers questions of a kind; in a file that was shared not all are. */
  answers() {
    return true;
  }

  /** Hear events of a kind, the server's and the page's; returns what ends it. */
  on(kind, handler) {
    if (!this.#handlers.has(kind)) this.#handlers.set(kind, new Set());
    this.#handlers.get(kind).add(handler);
    if (this.#latest.has(kind)) handler(...this.#latest.get(kind));
    return () => this.#handlers.get(kind).delete(handler);
  }

  /** Tell everybody on this page. */
  tell(kind, ...said) {
    this.#latest.set(kind, said);
    for (const handler of this.#handlers.get(kind) ?? []) {
      try { handler(...said); } catch (error) { reportError(error); } // the other views must hear of it all the same
    }
  }

  latest(kind) {
    return this.#latest.get(kind)?.[0];
  }

  /** What everybody looks at: system, level, table, line, and the tick; `follow` means the last tick, whatever it is. */
  get selection() {
    return this.#selection;
  }

  select(change) {
    const before = this.#selection;
    const changed = Object.keys(change).filter((key) => change[key] !== before[key]);
    if (!changed.length) return;
    this.#selection = Object.freeze({ ...before, ...change });
    this.tell("selection", this.#selection, new Set(changed));
  }

  /** Have keys do something everywhere: `?`, `ctrl+enter`, `g r` (one after the other). */
  key(keys, what, run, where = "Studio") {
    const taken = this.keys.find((one) => one.keys.split(", ").some((key) => keys.split(", ").includes(key)));
    if (taken) throw new Error(`${keys} means already: ${taken.what}`);
    this.keys.push({ keys, what, run, where });
  }

  /** Say something in the line below; `wrong` where it went wrong, `cancel` where it is under way, `then` what may be done next, by the word of its button. */
  say(text, { wrong = false, helps = [], cancel = null, then = {} } = {}) {
    this.tell("said", { text, wrong, helps, cancel, then });
  }

  /** Ask, and say it where it is refused; undefined then. */
  try(kind, body, options) {
    return this.told(this.ask(kind, body, options));
  }

  /** The answer; undefined where it is refused, which is said. */
  async told(answer) {
    try {
      return await answer;
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      this.say(error.message, { wrong: true, helps: error.helps });
      return undefined;
    }
  }
}

/** Do a line as the shell does it; what takes long says so, and can be cancelled. The promise is refused as `ask` is. */
export async function typeLine(bus, line) {
  let last = "";
  const stop = new AbortController(), cancel = () => stop.abort();
  const tell = (how) => bus.say((last = `${line}: ${how}`), { cancel });
  const late = setTimeout(() => tell("under way"), 500);
  try {
    const answer = await bus.ask("run.type", { line }, { signal: stop.signal, progress: ({ text }) => { clearTimeout(late); tell(text); } });
    if (last) bus.say(answer.shown.join("\n") || `${line}: done`);
    return answer;
  } finally {
    clearTimeout(late);
    if (last && bus.latest("said").text === last) bus.say("");
  }
}

/** The same; undefined where it is refused, which is said. */
export const doLine = (bus, line) => bus.told(typeLine(bus, line));
