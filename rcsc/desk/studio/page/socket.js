// The server answers: over one socket, that is opened again where it is lost.

import { Bus, Refusal } from "./bus.js";

export class Connected extends Bus {
  #socket = null;
  #number = 0;
  #open = new Map(); // by number: { resolve, reject, progress }
  #retry = 500;

  connect() {
    const socket = new WebSocket(new URL("socket", location.href.replace(/^http/, "ws")));
    this.#socket = socket;
    socket.addEventListener("open", () => {
      this.#retry = 500;
      this.tell("connection", true);
    });
    socket.addEventListener("message", (event) => this.#take(JSON.parse(event.data)));
    socket.addEventListener("close", () => {
      for (const [, asked] of this.#open) asked.reject(new Refusal({ text: "no connection to the studio", lost: true }));
      this.#open.clear();
      this.tell("connection", false);
      setTimeout(() => this.connect(), this.#retry);
      this.#retry = Math.min(5000, this.#retry * 2);
    });
  }

  #take(said) {
    if (said.event !== undefined) return this.tell(said.event, said.body);
    const asked = this.#open.get(said.id);
    if (!asked) return undefined;
    if (said.progress) return asked.progress?.(said.progress);
    this.#open.delete(said.id);
    if (said.refused) return asked.reject(new Refusal(said.refused));
    if (said.cancelled) return asked.reject(new Refusal({ text: "cancelled" }));
    return asked.resolve(said.answer);
  }

  /** Ask the server; the promise is refused with a `Refusal`. `signal` cancels. */
  ask(kind, body = {}, { progress, signal } = {}) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return Promise.reject(new Refusal({ text: "no connection to the studio", lost: true }));
    const id = ++this.#number;
    const answer = new Promise((resolve, reject) => this.#open.set(id, { resolve, reject, progress }));
    this.#socket.send(JSON.stringify({ id, kind, body }));
    signal?.addEventListener("abort", () => {
      if (this.#open.has(id)) this.#socket.send(JSON.stringify({ id, cancel: true }));
    });
    return answer;
  }
}
