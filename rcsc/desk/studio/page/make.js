// Elements of a page, and nothing that a page needs a server for.

/** Make an element: `make("button", { type: "button", class: "x", onclick: f }, "text", child)`. */
export function make(kind, attributes = {}, ...inside) {
  const made = document.createElement(kind);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (typeof value === "boolean") made.toggleAttribute(name, value);
    else if (value !== undefined && value !== null) made.setAttribute(name, value);
  }
  made.append(...inside.flat().filter((one) => one !== undefined && one !== null && one !== false));
  return made;
}

/** A text in which names stand in backticks, with the names set apart. */
export function spoken(text) {
  return text.split(/`([^`]*)`/).map((piece, at) => (at % 2 ? make("code", {}, piece) : piece));
}

/** When a tick is, as `1.04 s`; with as many digits as it takes to tell it from a tick `every` ms later. */
export function atSecond(tick, tickMs, every = tickMs) {
  return `${(tick * tickMs / 1000).toFixed(every % 10 ? 3 : every % 1000 ? 2 : 1)} s`;
}

const probe = make("i", { hidden: true });

/** A colour of the palette as canvases take it: what it is in the theme of now. */
export function colour(name) {
  if (!probe.isConnected) document.body.append(probe);
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}
