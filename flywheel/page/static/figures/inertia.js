// The reduced inertia, body upon body, with the total on top.

import { figure, label, node, paint, path, round, scaled, wide } from "./svg.js";
import { curvesOf } from "./curves.js";

const COLOURS = ["sky", "orange", "green", "purple", "vermillion", "yellow", "blue", "muted"];
const OPACITY = [0.45, 0.5, 0.4, 0.4, 0.35, 0.35, 0.45, 0.3];
const DASHES = [null, "6 3", "2 2", "8 3 2 3", "1 3", "10 4", "4 2", "3 5"];

export const inertia = {
  draw(answer, width, tools) {
    const { text, number } = tools;
    const data = answer.inertia;
    const unit = scaled(data.unit, data.greatest);
    const colours = coloursOf(answer);
    const bodies = data.bodies.map((body, k) => ({ ...body, colour: colours(body.name, k), fill: OPACITY[k % 8], dash: DASHES[k % 8], hidden: true, name: nameOf(body.name, text) }));
    const told = (value) => `${number(figure(value * unit.factor, 5))} ${unit.unit}`;
    const sliding = data.unit === "kg";
    const symbol = sliding ? "m*" : "I*";
    const mean = data.mean === null ? "" : ` ${text("Mean {value}.", { value: told(data.mean) })}`;
    return curvesOf(answer, width, tools, {
      title: sliding ? text("Reduced mass by body") : text("Reduced inertia by body"),
      about: `${text("From {least} to {greatest}.", { least: told(data.least), greatest: told(data.greatest) })}${mean} ${bodies.map((body) => body.name).join(", ")}.`,
      notes: [`${symbol}: ${text("from {least} to {greatest}.", { least: told(data.least), greatest: told(data.greatest) })}${mean}`],
      rows: [{
        name: answer.driver.stroke ? symbol : `${symbol}, ${text("without the flywheel")}`, unit, height: Math.round(Math.min(Math.max(0.4 * width, 150), 210)), zero: true,
        also: [0, data.greatest],
        curves: [...bodies, { name: text("total"), values: data.total, colour: "ink", line: 2 }],
        under: (place) => layers(bodies, place),
      }],
      columns: [...bodies.map((body) => ({ name: body.name, unit: data.unit, values: body.values })), { name: text("total"), unit: data.unit, values: data.total }],
    });
  },
};

/** The bodies of an answer's mechanisms. */
export function bodiesOf(answer) {
  return (answer.mechanism?.views ?? []).flatMap((view) => Object.keys(view.bodies).map((body) => `${view.name}.${body}`));
}

/** A body's colour, the same in all figures; `bodies` are those of an earlier answer where this one has no mechanism. */
export function coloursOf(answer) {
  const names = answer.bodies ?? bodiesOf(answer);
  return (name, k) => {
    const plain = name.replace(/ .*$/, "");
    const exact = names.indexOf(plain);
    const found = exact < 0 ? names.findIndex((each) => each.endsWith(`.${plain}`)) : exact;
    return COLOURS[(found < 0 ? k : found) % COLOURS.length];
  };
}

function nameOf(name, text) {
  const others = /^(\d+) others$/.exec(name);
  return others ? text("{n} others", { n: others[1] }) : name;
}

function layers(bodies, { xs, Y, left, free }) {
  const floor = new Array(xs.length).fill(0);
  const drawn = [];
  const names = [];
  for (const body of bodies) {
    const below = floor.map(Y);
    body.values.forEach((value, k) => (floor[k] += value ?? 0));
    const above = floor.map(Y);
    const back = `${path([...xs].reverse(), [...below].reverse())}`.replace("M", "L");
    drawn.push(node("path", { d: `${path(xs, above)}${back}Z`, fill: paint(body.colour), "fill-opacity": body.fill }));
    drawn.push(node("path", { d: path(xs, above), fill: "none", stroke: paint(body.colour), "stroke-width": 1.2, "stroke-dasharray": body.dash }));
    let best = 0;
    for (let k = 1; k < xs.length - 1; k++) if (below[k] - above[k] > below[best] - above[best]) best = k;
    const w = wide(body.name);
    const spot = [Math.min(Math.max(xs[best] - w / 2, left + 4), xs[xs.length - 1] - w - 4), (below[best] + above[best]) / 2 - 6];
    if (below[best] - above[best] > 16 && free.take([spot], w, 12)) names.push(label(spot[0], spot[1] + 10, body.name, { halo: true }));
  }
  return [...drawn, ...names];
}
