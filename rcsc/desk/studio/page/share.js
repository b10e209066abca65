// Sharing: the moment that everybody looks at, or a finding of the open file, as one file that needs nothing else.

import { make, spoken } from "./make.js";
import { deskOf } from "./tables/desk.js";

const AROUND = 200; // ticks before the moment and after it

export function sharing(bus, button, dialog) {
  const desk = deskOf(bus);
  const list = dialog.querySelector("ul");
  let stop = null;

  async function write(item, what, ask) {
    stop?.abort();
    stop = new AbortController();
    const how = item.querySelector("[role=status]");
    const cancel = make("button", { type: "button", onclick: () => stop.abort() }, "Cancel");
    how.replaceChildren("being made ", cancel);
    const options = { signal: stop.signal, progress: ({ text, done }) => { how.firstChild.textContent = ` ${text}: ${done} `; } };
    const file = await ask(options).catch((error) => { how.textContent = ` not shared: ${error.message}`; });
    if (!file) return;
    const address = URL.createObjectURL(new Blob([file.text], { type: "text/html" }));
    make("a", { href: address, download: file.name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 60_000);
    how.textContent = ` ${file.name} is handed to the browser, ${(file.text.length / 1024).toFixed(0)} kB`;
    bus.say(`${what} is shared as ${file.name}`);
  }

  function offer(what, ask, ...text) {
    const item = make("li", {}, make("button", { type: "button", onclick: () => write(item, what, ask) }, ...text), make("span", { role: "status", class: "soft" }));
    return item;
  }

  function offers() {
    const run = bus.latest("run"), { tick } = bus.selection;
    const found = (desk.doc?.known ? desk.doc.findings : []).filter(({ severity }) => severity === "error");
    const ofRun = run?.open && tick !== null ? [offer(`tick ${tick}`, (options) => bus.ask("share.moment", { tick, around: AROUND }, options),
      `Tick ${tick} of the run, with up to ${AROUND} ticks before and after it`)] : [];
    const ofTables = found.slice(0, 20).map((one) => offer("the finding", (options) => bus.ask("handed.finding", { file: desk.file, version: desk.doc.version, finding: one.id }, options),
      "Finding: ", ...spoken(one.message)));
    return [...ofRun, ...ofTables];
  }

  function show() {
    const offered = offers();
    list.replaceChildren(...(offered.length ? offered : [make("li", { class: "soft" }, "No run is open, and the open file has no finding: there is nothing to be shared.")]));
    dialog.showModal();
  }
  dialog.addEventListener("close", () => stop?.abort());
  button.addEventListener("click", show);
  bus.key("x", "Share a moment of the run, or a finding, as one file", show);
}
