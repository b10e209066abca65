// What a level took and gave in a tick, in words: for the studio, and for what is shared of a run.

import { make } from "./make.js";

// A number as it is read: six digits tell where it is; the whole of it stands among the variables.
export const short = (text) => String(text).replace(/-?\d+\.\d{5,}(?:e[-+]?\d+)?/g, (number) => String(Number(Number(number).toPrecision(6))));

// Orders and echoes, as they travel: what the level took and gave in this cycle, and what it saw of those below.
export function exchanges(box) {
  const said = [];
  for (const { order, report } of box.above) {
    if (order) said.push(exchange("↓", `from ${order.other || order.buffer}`, ordered(order), order.new || order.altered, order.fields));
    if (report) said.push(exchange("↑", `to ${report.other || report.buffer}`, reported(report), false, report.fields));
  }
  for (const { report, order } of box.below) {
    if (order) said.push(exchange("↓", `to ${order.other || order.buffer}`, ordered(order), order.new || order.altered, order.fields));
    if (report) said.push(exchange("↑", `from ${report.other || report.buffer}`, reported(report), false, report.fields));
  }
  return said;
}

const ordered = ({ number, command, new: fresh, altered }) => `${number === null ? "orders" : `order ${number}`} ${command}${fresh ? ", new" : altered ? ", altered under the same number" : ""}`;
function reported({ echo, echoed, status, of_number: number, of_command: command, matches }) {
  const said = `${echo === null ? "reports" : `echo ${echo}`}${echoed ? ` ${echoed}` : ""}: ${status}`;
  if (number === null || echo === null) return said;
  return matches ? said : `${said}; order ${number} ${command} is on its way`;
}

function exchange(arrow, who, text, fresh, fields) {
  const said = fields.map(({ name, value }) => `${name} ${value}`).join(", ");
  return make("p", { class: `exchange${fresh ? " fresh" : ""}` }, make("span", { "aria-hidden": "true" }, arrow), make("span", { class: "soft" }, ` ${who}: `), text,
    fields.length ? make("span", { class: "fields soft", title: said }, fields.flatMap(({ name, value, changed }, at) => [at ? ", " : "", changed ? make("strong", {}, `${name} ${short(value)}`) : `${name} ${short(value)}`])) : "");
}

export function changes(box) {
  const states = box.states.filter(({ before, now, pending }) => before !== now || pending);
  return [
    ...states.map(({ name, before, now, pending }) => make("p", { class: "change" }, make("code", {}, name), before === now ? ` is ${short(now)}` : ` ${short(before)} → `, before === now ? "" : make("strong", {}, short(now)), pending ? `, waits to become ${pending}` : "")),
    ...box.inputs.map(({ name, value }) => make("p", { class: "change soft" }, make("code", {}, name), ` came in as ${short(value)}`)),
  ];
}
