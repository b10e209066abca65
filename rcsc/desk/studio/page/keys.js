// The keys of a page.

const spoken = (event) => [event.ctrlKey && "ctrl", event.altKey && "alt", event.metaKey && "meta",
  event.shiftKey && event.key.length > 1 && "shift", event.key === " " ? "space" : event.key.length === 1 && !event.ctrlKey ? event.key : event.key.toLowerCase()]
  .filter(Boolean).join("+");
const typed = (target) => target.closest?.("input:not([type=checkbox]):not([type=range]), textarea, select, [contenteditable], dialog[open], [data-keys=own]");
/** Do what keys mean, wherever on the page they are pressed. */
export function followKeys(bus) {
  let before = "";
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented) return;
    if (event.key === "Escape" && typed(event.target) && !event.target.closest("dialog")) event.target.blur(); // the keys are free again
    if (["Control", "Shift", "Alt", "Meta"].includes(event.key)) return;
    const now = spoken(event);
    const free = !typed(event.target);
    const wanted = [before && `${before} ${now}`, now].filter(Boolean);
    const pressable = event.target.closest?.("button, a, summary, [role=button]") && (now === "space" || now === "enter");
    const found = bus.keys.findLast(({ keys }) => keys.split(", ").some((one) => wanted.includes(one)) && (free || /^(ctrl|alt|f\d)/.test(keys)) && !pressable);
    before = !found && free && bus.keys.some(({ keys }) => keys.startsWith(`${now} `)) ? now : "";
    if (!found) return;
    event.preventDefault();
    found.run(event);
  });
}
