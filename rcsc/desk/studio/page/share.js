// Sharing: the moment that everybody looks at, or a finding of the open file, as one file that needs nothing else; and the run as a film.

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
    const options = { signal: stop.signal, progress: ({ text, done, of }) => { how.firstChild.textContent = ` ${text}: ${done}${of ? ` of ${of}` : ""} `; } };
    const file = await ask(options).catch((error) => { how.replaceChildren(" not shared: ", ...spoken([error.message, ...(error.helps ?? [])].join("; "))); });
    if (!file) return;
    const content = file.text ?? Uint8Array.from(atob(file.base64), (one) => one.charCodeAt(0));
    const address = URL.createObjectURL(new Blob([content], { type: file.type ?? "text/html" }));
    make("a", { href: address, download: file.name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 60_000);
    how.textContent = ` ${file.name} is handed to the browser, ${(content.length / 1024).toFixed(0)} kB`;
    bus.say(`${what} is shared as ${file.name}`);
  }

  function offer(what, ask, ...text) {
    const item = make("li", {}, make("button", { type: "button", onclick: () => write(item, what, ask) }, ...text), make("span", { role: "status", class: "soft" }));
    return item;
  }

  function offerFilm() {
    const choice = (label, of) => make("select", { "aria-label": label }, ...of.map(([value, text]) => make("option", { value }, text)));
    const form = choice("Form of the film", [["mp4", "MP4"], ["webp", "WebP"], ["gif", "GIF"]]);
    const speed = choice("Speed of the film", [[1, "as fast as the clock"], ...[2, 5, 10, 50].map((many) => [many, `${many} times as fast`])]);
    const view = choice("From where it is filmed", [["corner", "from a corner"], ["front", "from the front"], ["left", "from the left"], ["above", "from above"]]);
    const item = offer("the run", (options) => bus.ask("filmed.run", { form: form.value, speed: Number(speed.value), view: view.value }, options), "Film of the run so far, in space");
    item.firstChild.after(" ", form, " ", speed, " ", view);
    return item;
  }

  function offers() {
    const run = bus.latest("run"), { tick } = bus.selection;
    const found = (desk.doc?.known ? desk.doc.findings : []).filter(({ severity }) => severity === "error");
    const ofRun = run?.open && tick !== null ? [offer(`tick ${tick}`, (options) => bus.ask("share.moment", { tick, around: AROUND }, options),
      `Tick ${tick} of the run, with up to ${AROUND} ticks before and after it`)] : [];
    const ofTables = found.slice(0, 20).map((one) => offer("the finding", (options) => bus.ask("handed.finding", { file: desk.file, version: desk.doc.version, finding: one.id }, options),
      "Finding: ", ...spoken(one.message)));
    const film = run?.open && run.source !== "log" && bus.latest("cell.state")?.space ? [offerFilm()] : [];
    return [...ofRun, ...film, ...ofTables];
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
