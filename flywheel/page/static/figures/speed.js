// The speed over the cycle with each flywheel, the band that was asked for, and where it is greatest and least.

import { axis, csv, figure, label, node, paint, round, wide } from "./svg.js";
import { curvesOf, note } from "./curves.js";
import { driverOf, legendOf, placeOf } from "./panel.js";

const RPM = 30 / Math.PI;
const CONFIRMED = 1e-4; // of the irregularity
const LINES = {
  exact: { colour: "blue", line: 2.2 },
  given: { colour: "blue", line: 2.2 },
  approximate: { colour: "vermillion", dash: "7 3" },
  inertia_torque_flywheel: { colour: "green", dash: "2 3" },
};

export const speed = {
  draw(answer, width, tools) {
    const data = answer.speed;
    return data.diagram ? crossings(data, width, tools) : curves(answer, data, width, tools);
  },
};

function names(text) {
  return {
    exact: text("exact flywheel"), given: text("given flywheel"),
    approximate: text("flywheel by the areas"), inertia_torque_flywheel: text("flywheel by the inertia torque"),
  };
}

function curves(answer, data, width, tools) {
  const { text, number } = tools;
  const driver = driverOf(answer, tools);
  const named = names(text);
  const told = (value) => `${number(figure(value * RPM, 6))} rpm`;
  const lines = data.traces.map((trace) => ({
    ...LINES[trace.key], values: trace.values,
    name: text("{name}, {inertia} kg m², ε = {eps}", { name: named[trace.key], inertia: number(figure(trace.inertia, 5)), eps: number(figure(trace.irregularity)) }),
  }));
  const notes = [];
  for (const key of data.stops ?? []) notes.push(text("With the {name} the machine would stop within the cycle.", { name: named[key] }));
  notes.push(...confirmed(data, tools));
  const marks = [["greatest", "up"], ["least", "down"]].map(([which, kind]) => ({
    ...data[which], kind, colour: "blue", words: `${told(data[which].value)}, ${placeOf(driver, data[which].at, tools)}`,
  }));
  return curvesOf(answer, width, tools, {
    title: text("Speed of the crank over the cycle"),
    about: `${text("Greatest {greatest}, least {least}.", { greatest: marks[0].words, least: marks[1].words })} ${lines.map((each) => each.name).join("; ")}. ${notes.join(" ")}`,
    notes,
    rows: [{
      name: text("crank speed"), unit: { unit: "rpm", factor: RPM }, height: Math.round(Math.min(Math.max(0.38 * width, 140), 200)),
      room: 0.14, curves: lines, marks, also: data.band ?? [], under: (place) => band(data, place),
    }],
    columns: data.traces.map((trace) => ({ name: named[trace.key], unit: "rad/s", values: trace.values })),
  });
}

function confirmed({ confirmed: found }, { text, number }) {
  if (!found || found.error === null) return [];
  const eps = number(figure(found.irregularity, 5));
  const words = found.route === "time" ? text("Stepped in time, the irregularity is {eps}", { eps }) : text("Found by another route, the irregularity is {eps}", { eps });
  const off = found.error < CONFIRMED ? text("confirmed") : text("give or take {off} %", { off: number(figure(100 * found.error, 2)) });
  return [`${words}: ${off}.`];
}

function band({ band: asked, mean }, { Y, left, right, tools, free }) {
  const { text } = tools;
  const drawn = [];
  if (asked) {
    const [low, high] = asked.map(Y);
    drawn.push(node("rect", { x: round(left), y: round(high), width: round(right - left), height: round(low - high), fill: paint("grid"), "fill-opacity": 0.6 }));
    for (const y of [low, high]) drawn.push(node("line", { x1: round(left), x2: right, y1: round(y), y2: round(y), stroke: paint("muted"), "stroke-dasharray": "1 3" }));
    const words = text("band asked");
    drawn.push(label(left + 5, high + 16, words, { colour: "muted", halo: true }));
    free?.block(left + 5, high + 3, wide(words), 16);
  }
  drawn.push(node("line", { x1: round(left), x2: right, y1: round(Y(mean)), y2: round(Y(mean)), stroke: paint("muted"), "stroke-dasharray": "8 3 1 3" }));
  return drawn;
}

// -- a diagram of areas -----------------------------------------------------------------------------------------------

function crossings(data, width, tools) {
  const { text, number } = tools;
  const values = data.crossings.map((value) => value * RPM);
  const legend = legendOf([{ name: text("speed at the crossings"), colour: "blue", line: 0, mark: (x, y) => `M${round(x - 4)} ${round(y)}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0` }], width, 0, tools);
  const children = [...legend.nodes];
  const words = text("{name}, {inertia} kg m², ε = {eps}", { name: text("flywheel"), inertia: number(figure(data.inertia, 5)), eps: number(figure(data.irregularity)) });
  const top = note(children, `${words}.`, width, legend.height) + 20;
  const bottom = top + 160;
  const all = [...values, ...(data.band ?? []).map((value) => value * RPM)];
  const room = 0.12 * (Math.max(...all) - Math.min(...all));
  const scale = axis(Math.min(...all) - room, Math.max(...all) + room, bottom, top, { every: 30, number });
  const [left, right] = [64, width - 10];
  const apart = scale.origin ? ` − ${number(String(scale.origin))}` : "";
  children.push(label(2, top - 7, `${text("crank speed")}${apart}, rpm`, { bold: true }));
  for (const tick of scale.ticks) {
    children.push(node("line", { x1: left, x2: right, y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
    children.push(label(left - 5, tick.at + 4, tick.words, { anchor: "end", colour: "muted" }));
  }
  children.push(...band(data, { Y: (value) => scale.at(value * RPM), left, right, tools }));
  const X = (k) => left + ((k + 0.5) / values.length) * (right - left);
  const every = Math.ceil(values.length / Math.max((right - left) / 34, 1));
  values.forEach((value, k) => {
    children.push(node("circle", { cx: round(X(k)), cy: round(scale.at(value)), r: 4, fill: paint("blue") }));
    if (k % every === 0) children.push(label(X(k), bottom + 14, `S${k}`, { anchor: "middle", colour: "muted" }));
  });
  children.push(node("rect", { x: left, y: top, width: right - left, height: 160, fill: "none", stroke: paint("edge") }));
  return {
    title: text("Speed of the crank at the crossings"),
    about: values.map((value, k) => `S${k}: ${number(figure(value, 6))} rpm`).join("; "),
    height: bottom + 22,
    children,
    csv: () => csv([{ name: text("crossing"), values: values.map((_, k) => `S${k}`) }, { name: text("crank speed"), unit: "rad/s", values: data.crossings }]),
  };
}

