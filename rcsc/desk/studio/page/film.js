// Who answers in a file that shows a run: the same questions as the studio's server, of the data that stands in the file.

import { Bus, Refusal } from "./bus.js";

/** The place in `changes`, sorted pairs that begin with a tick, of what stands at a tick; -1 for nothing yet. */
export function standing(changes, tick) {
  let low = 0, high = changes.length;
  while (low < high) { const middle = (low + high) >> 1; if (changes[middle][0] <= tick) low = middle + 1; else high = middle; }
  return low - 1;
}

export class FilmBus extends Bus {
  #film;

  constructor(film) {
    super();
    this.#film = film;
  }

  #answers = {
    "time.tracks": () => ({ era: 0, from: -1, to: this.#film.last, first: this.#film.first, last: this.#film.last, levels: this.#film.tracks, marks: this.#film.marks ?? [] }),
    "time.moment": ({ tick }) => ({ tick, levels: this.#film.levels.map(({ name }) => { const held = this.#film.boxes[name] ?? []; return held[standing(held, tick)]?.[1]; }).filter(Boolean) }),
    "plot.names": () => ({ names: this.variables().map(([name, { unit }]) => ({ name, unit })), displays: this.#film.shown.length ? { "shown first": this.#film.shown } : {} }),
    "plot.curves": ({ names }) => ({ era: 0, first: this.#film.first, last: this.#film.last, curves: names.map((name) => this.#curve(name)) }),
  };

  answers(kind) {
    return kind in this.#answers;
  }

  /** Every variable by its whole name. */
  variables() {
    return Object.entries(this.#film.variables).flatMap(([level, several]) => Object.entries(several).map(([name, one]) => [`${level}.${name}`, one]));
  }

  async ask(kind, body = {}) {
    if (!this.answers(kind)) throw new Refusal({ text: "a file does not do that: `rcsc studio` does" });
    return this.#answers[kind](body);
  }

  #curve(name) {
    const [level, ...rest] = name.split(".");
    const { unit, members, unset, changes } = this.#film.variables[level][rest.join(".")];
    const ends = unset.flatMap(([from, to]) => [from, to + 1]);
    const isUnset = (tick) => unset.some(([from, to]) => from <= tick && tick <= to);
    const number = (text) => (members.length ? members.indexOf(text) : Number(text));
    const ticks = [...new Set([...changes.map(([tick]) => tick), ...ends])].filter((tick) => tick >= this.#film.first && tick <= this.#film.last).sort((a, b) => a - b);
    const values = ticks.map((tick) => { const at = standing(changes, tick), value = at < 0 || isUnset(tick) ? null : number(changes[at][1]); return [tick, Number.isFinite(value) ? value : null]; });
    return { name, unit, members, from: this.#film.first, changes: values };
  }
}

/** What stands in an element: JSON, packed as `rcsc.views.pages.frame.packed` does it. */
export async function unpacked(element) {
  const bytes = Uint8Array.from(atob(element.textContent.trim()), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json();
}
