// Wittenbauer's diagram: accumulated work against reduced inertia, the two tangents, MN and P.

import { axis, csv, figure, label, node, paint, round, scaled, valueAt, wide } from "./svg.js";
import { note, setAll } from "./curves.js";
import { clear, driverOf, legendOf } from "./panel.js";
import { jumpPairs, marksOf, nearest, planeCurve, planeMarks } from "./plane.js";

export const wittenbauer = {
  draw(answer, width, tools) {
    const { text } = tools;
    const data = answer.wittenbauer;
    const driver = driverOf(answer, tools);
    const most = Math.max(...data.inertia);
    const joule = scaled("J", Math.max(...data.energy.map(Math.abs), ...data.tangents.map(({ intercept }) => Math.abs(intercept))));
    const kilo = scaled("kg m²", most);
    const shared = { data, phi: answer.phi, driver, joule, kilo, tools, width, near: data.seen === "P" };
    const legend = legendOf([
      { name: driver.symbol, unit: driver.unit, swatchless: true },
      { name: "I*", unit: kilo.unit, swatchless: true },
      { name: "W", unit: joule.unit, colour: "ink", line: 2 },
    ], width, 0, tools);
    const children = [...legend.nodes];
    let y = tangentsIn(children, shared, legend.height);
    for (const words of data.diagram.remarks) y = note(children, words, width, y);
    const height = Math.round(Math.min(Math.max(0.6 * width, 220), 320));
    const plots = data.windows.map((window, k) => {
      const plot = plotOf(shared, window, y + 20, k === data.windows.length - 1 ? height : 0.6 * height);
      if (k) plot.children.push(label(width / 2, y + 13, text("enlarged"), { anchor: "middle", colour: "muted" }));
      children.push(...plot.children);
      y = plot.bottom + 34;
      return plot;
    });
    return {
      title: data.diagram.title,
      about: data.diagram.about,
      height: y,
      children,
      point: (x, yy) => (plots.find((plot) => yy < plot.bottom + 30) ?? plots[0]).point(x, yy),
      move(at) {
        const [inertia, work] = [valueAt(answer.phi, data.inertia, at, false), valueAt(answer.phi, data.energy, at, false)];
        legend.tell(0, [at], driver.factor);
        legend.tell(1, [inertia], kilo.factor);
        legend.tell(2, [work], joule.factor);
        for (const plot of plots) plot.move(inertia, work);
      },
      csv: () => csv([{ name: driver.name, unit: driver.si, values: answer.phi }, { name: "I*", unit: "kg m²", values: data.inertia }, { name: "W", unit: "J", values: data.energy }]),
    };
  },
};

const line = ({ slope, intercept }, x) => slope * x + intercept;

/** The tangents in words, each beside its line. */
function tangentsIn(children, { data, width }, y) {
  data.tangents.forEach(({ words }, k) => {
    const inner = [];
    children.push(node("line", { x1: 4, x2: 22, y1: y + 7, y2: y + 7, stroke: paint(k ? "vermillion" : "blue"), "stroke-width": 2, "stroke-dasharray": k ? "7 3" : null }));
    y = note(inner, words, width - 28, y);
    for (const each of inner) each.setAttribute("x", 28);
    children.push(...inner);
  });
  return y;
}

/** The diagram within a window. */
function plotOf({ data, phi, driver, joule, kilo, tools, width, near }, [x0, x1, y0, y1], top, height) {
  const { number } = tools;
  const bottom = top + height;
  const up = axis(y0 * joule.factor, y1 * joule.factor, bottom, top, { every: 34, number });
  const left = Math.min(Math.max(...up.ticks.map((tick) => wide(tick.words)), 24) + 12, 0.25 * width);
  const second = axis(up.least / joule.factor / data.joule, up.greatest / joule.factor / data.joule, bottom, top, { every: 34, number });
  const right = width - Math.min(Math.max(...second.ticks.map((tick) => wide(tick.words))) + 10, 0.2 * width);
  const along = axis(x0 * kilo.factor, x1 * kilo.factor, left, right, { every: 60, number });
  const X = (value) => along.at(value * kilo.factor);
  const Y = (value) => up.at(value * joule.factor);
  const children = [];
  for (const tick of up.ticks) {
    children.push(node("line", { x1: round(left), x2: round(right), y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
    children.push(label(left - 5, tick.at + 4, tick.words, { anchor: "end", colour: "muted" }));
  }
  for (const tick of second.ticks) children.push(label(right + 5, tick.at + 4, tick.words, { colour: "muted" }));
  for (const tick of along.ticks) {
    children.push(node("line", { x1: round(tick.at), x2: round(tick.at), y1: top, y2: bottom, stroke: paint("grid") }));
    children.push(label(tick.at, bottom + 14, tick.words, { anchor: "middle", colour: "muted" }));
  }
  const less = ({ origin }) => (origin ? ` − ${number(String(Number(origin.toPrecision(8))))}` : "");
  children.push(label(2, top - 7, `W${less(up)}, ${joule.unit}`, { bold: true }), label(width - 2, top - 7, `2 W/ω²${less(second)}, kg m²`, { anchor: "end", bold: true }));
  children.push(label((left + right) / 2, bottom + 29, `I*${less(along)}, ${kilo.unit}`, { anchor: "middle", colour: "muted" }));

  const [xs, ys] = [data.inertia.map(X), data.energy.map(Y)];
  const free = clear();
  data.tangents.forEach((tangent, k) => {
    const ends = clipped(tangent, Math.max(near ? data.pole[0] : 0, x0), x1, up.least / joule.factor, up.greatest / joule.factor);
    if (!ends) return;
    children.push(node("line", { x1: round(X(ends[0])), y1: round(Y(line(tangent, ends[0]))), x2: round(X(ends[1])), y2: round(Y(line(tangent, ends[1]))), stroke: paint(k ? "vermillion" : "blue"), "stroke-width": 1.8, "stroke-dasharray": k ? "7 3" : null }));
  });
  if (x0 <= 0) children.push(node("line", { x1: round(X(0)), x2: round(X(0)), y1: top, y2: bottom, stroke: paint("ink") }), ...secant(data, { X, Y, joule, number, free, near }));
  children.push(...planeCurve(xs, ys, jumpPairs(phi, xs, ys, height, driver.cyclic), { colour: "ink", line: 1.5 }));
  children.push(...arrows(xs, ys));
  data.tangents.forEach((tangent, k) => {
    children.push(node("circle", { cx: round(X(tangent.contact[0])), cy: round(Y(tangent.contact[1])), r: 4.5, fill: paint(k ? "vermillion" : "blue") }));
  });
  if (near && x0 <= data.pole[0]) {
    children.push(node("circle", { cx: round(X(data.pole[0])), cy: round(Y(data.pole[1])), r: 4, fill: paint("purple") }));
    children.push(label(X(data.pole[0]), Y(data.pole[1]) - 9, "P", { bold: true, anchor: "middle" }));
  }
  const spot = (at) => [X(valueAt(phi, data.inertia, at, false)), Y(valueAt(phi, data.energy, at, false))];
  children.push(...planeMarks(marksOf(driver), spot, driver, free, number, { colour: "ink", bounds: [left, top, right, bottom] }));
  children.push(node("rect", { x: round(left), y: top, width: round(right - left), height, fill: "none", stroke: paint("edge") }));
  const cursor = node("circle", { r: 6, fill: "none", stroke: paint("ink"), "stroke-width": 2.4, visibility: "hidden" });
  children.push(cursor);
  return {
    children,
    bottom,
    point: (x, y) => nearest(phi, xs, ys, x, y, 60),
    move: (inertia, work) => setAll(cursor, { cx: round(X(inertia)), cy: round(Y(work)), visibility: "visible" }),
  };
}

/** The stretch of a tangent between two inertias that lies between two energies; null where none does. */
function clipped(tangent, from, to, low, high) {
  if (tangent.slope > 0) {
    from = Math.max(from, (low - tangent.intercept) / tangent.slope);
    to = Math.min(to, (high - tangent.intercept) / tangent.slope);
  }
  return from < to ? [from, to] : null;
}

/** The stretch MN that the tangents cut off where I* = 0. */
function secant(data, { X, Y, joule, number, free, near }) {
  const [m, n] = data.tangents.map((tangent) => Y(tangent.intercept));
  const x = X(0);
  const words = `MN = ${number(figure(data.mn * joule.factor, 4))} ${joule.unit}`;
  const side = near ? 1 : -1;
  const drawn = [node("line", { x1: round(x), x2: round(x), y1: round(m), y2: round(n), stroke: paint("purple"), "stroke-width": 4 })];
  const close = Math.abs(m - n) < 13;
  const marks = close ? [["M, N", (m + n) / 2 + 4]] : [["M", m < n ? m - 3 : m + 11], ["N", m < n ? n + 11 : n - 3]];
  for (const [name, y] of marks) drawn.push(label(x + side * 5, y, name, { bold: true, halo: true, anchor: near ? "start" : "end" }));
  free.block(x - 30, Math.min(m, n) - 14, 60, Math.abs(m - n) + 28);
  if (!close) {
    const spot = free.take([[x + 6, (m + n) / 2 - 5], [x + 34, (m + n) / 2 - 5], [x + 34, Math.min(m, n) - 26], [x + 34, Math.max(m, n) + 14]], wide(words), 12);
    if (spot) drawn.push(label(spot[0], spot[1] + 10, words, { colour: "purple", halo: true }));
  }
  return drawn;
}

/** Arrows along a loop: the sense in which the angle grows. */
function arrows(xs, ys) {
  const lengths = [0];
  for (let k = 1; k < xs.length; k++) lengths.push(lengths[k - 1] + Math.hypot(xs[k] - xs[k - 1], ys[k] - ys[k - 1]));
  const total = lengths[lengths.length - 1];
  if (total < 60) return [];
  return [0.12, 0.37, 0.62, 0.87].map((share) => {
    const k = Math.max(lengths.findIndex((length) => length >= share * total), 1);
    const angle = Math.atan2(ys[k] - ys[k - 1], xs[k] - xs[k - 1]);
    const tip = (turn, size) => `${round(xs[k] + size * Math.cos(angle + turn))} ${round(ys[k] + size * Math.sin(angle + turn))}`;
    return node("path", { d: `M${tip(0, 6)}L${tip(2.5, 6)}L${tip(-2.5, 6)}Z`, fill: paint("ink") });
  });
}
