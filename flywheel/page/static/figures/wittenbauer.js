// Wittenbauer's diagram: accumulated work against reduced inertia, the two tangents, MN and P.

import { axis, csv, figure, label, node, paint, round, scaled, valueAt, wide } from "./svg.js";
import { note, setAll } from "./curves.js";
import { clear, driverOf, legendOf, placeOf } from "./panel.js";
import { marksOf, nearest, planeCurve, planeMarks } from "./plane.js";

const WITHIN = 2.5; // times the greatest I*: a pole that is nearer is drawn

export const wittenbauer = {
  draw(answer, width, tools) {
    const { text, number } = tools;
    const data = answer.wittenbauer;
    const driver = driverOf(answer, tools);
    const phi = answer.phi;
    const most = Math.max(...data.inertia);
    const near = data.flywheel <= WITHIN * most;
    const first = near ? -1.08 * data.flywheel : 0;
    const end = 1.06 * most;
    const line = ({ slope, intercept }, x) => slope * x + intercept;
    const seen = [...data.energy, ...data.tangents.flatMap((tangent) => [line(tangent, end), tangent.intercept, tangent.contact[1], near ? line(tangent, data.pole[0]) : 0])];
    const joule = scaled("J", Math.max(...seen.map(Math.abs)));
    const kilo = scaled("kg m²", most);
    const told = (value, digits = 5) => `${number(figure(value * joule.factor, digits))} ${joule.unit}`;
    const names = [text("fastest"), text("slowest")];
    const entries = [
      { name: driver.symbol, unit: driver.unit, swatchless: true },
      { name: "I*", unit: kilo.unit, swatchless: true },
      { name: "W", unit: joule.unit, colour: "ink", line: 2, jumps: false },
    ];
    const legend = legendOf(entries, width, 0, tools);
    const children = [...legend.nodes];
    let y = legend.height;
    data.tangents.forEach((tangent, k) => {
      const words = text("ψ = {angle}° at the {which} point, {phi} (tan ψ = ½ ω² = {slope} J/(kg m²), ω = {speed} rpm)", {
        angle: number(tangent.steepness.toFixed(2)), which: names[k], phi: placeOf(driver, tangent.angle, tools),
        slope: number(figure(tangent.slope)), speed: number(figure((tangent.speed * 30) / Math.PI, 5)),
      });
      const before = y;
      const inner = [];
      y = note(inner, words, width - 28, y);
      for (const each of inner) each.setAttribute("x", 28);
      children.push(node("line", { x1: 4, x2: 22, y1: before + 7, y2: before + 7, stroke: paint(k ? "vermillion" : "blue"), "stroke-width": 2, "stroke-dasharray": k ? "7 3" : null }), ...inner);
    });
    const pole = `P: I* = ${number(figure(data.pole[0] * kilo.factor, 5))} ${kilo.unit}, W = ${told(data.pole[1])}`;
    y = note(children, `MN = ${told(data.mn)}. ${pole}${near ? "" : ` (${text("left of the picture")})`}.`, width, y);

    const top = y + 20;
    const bottom = top + Math.round(Math.min(Math.max(0.6 * width, 220), 320));
    const room = 0.06 * (Math.max(...seen) - Math.min(...seen));
    const up = axis((Math.min(...seen) - room) * joule.factor, (Math.max(...seen) + room) * joule.factor, bottom, top, { every: 34, number });
    const left = Math.min(Math.max(...up.ticks.map((tick) => wide(tick.words)), 24) + 12, 0.25 * width);
    const second = axis(up.least / joule.factor / data.joule, up.greatest / joule.factor / data.joule, bottom, top, { every: 34, number });
    const right = width - Math.min(Math.max(...second.ticks.map((tick) => wide(tick.words))) + 10, 0.2 * width);
    const gap = near ? 0 : 0.07 * (right - left);
    const along = axis(first * kilo.factor, end * kilo.factor, left + gap, right, { every: 60, number });
    const X = (value) => along.at(value * kilo.factor);
    const Y = (value) => up.at(value * joule.factor);
    for (const tick of up.ticks) {
      children.push(node("line", { x1: round(left), x2: round(right), y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
      children.push(label(left - 5, tick.at + 4, tick.words, { anchor: "end", colour: "muted" }));
    }
    for (const tick of second.ticks) children.push(label(right + 5, tick.at + 4, tick.words, { colour: "muted" }));
    for (const tick of along.ticks) {
      children.push(node("line", { x1: round(tick.at), x2: round(tick.at), y1: top, y2: bottom, stroke: paint("grid") }));
      children.push(label(tick.at, bottom + 14, tick.words, { anchor: "middle", colour: "muted" }));
    }
    children.push(label(2, top - 7, `W, ${joule.unit}`, { bold: true }), label(width - 2, top - 7, "2 W/ω², kg m²", { anchor: "end", bold: true }));
    children.push(label((left + right) / 2, bottom + 29, `I*, ${kilo.unit}`, { anchor: "middle", colour: "muted" }));
    children.push(node("line", { x1: round(X(0)), x2: round(X(0)), y1: top, y2: bottom, stroke: paint("ink") }));

    const xs = data.inertia.map(X);
    const ys = data.energy.map(Y);
    const free = clear();
    const [from, to] = [near ? data.pole[0] : 0, end];
    data.tangents.forEach((tangent, k) => {
      children.push(node("line", { x1: round(X(from)), y1: round(Y(line(tangent, from))), x2: round(X(to)), y2: round(Y(line(tangent, to))), stroke: paint(k ? "vermillion" : "blue"), "stroke-width": 1.8, "stroke-dasharray": k ? "7 3" : null }));
    });
    children.push(...planeCurve(phi, xs, ys, bottom - top, driver.cyclic, { colour: "ink", line: 1.5 }));
    children.push(...arrows(xs, ys));
    data.tangents.forEach((tangent, k) => {
      children.push(node("circle", { cx: round(X(tangent.contact[0])), cy: round(Y(tangent.contact[1])), r: 4.5, fill: paint(k ? "vermillion" : "blue") }));
    });
    children.push(...secant(data, { X, Y, told, free, near }));
    if (near) {
      children.push(node("circle", { cx: round(X(data.pole[0])), cy: round(Y(data.pole[1])), r: 4, fill: paint("purple") }));
      children.push(label(X(data.pole[0]), Y(data.pole[1]) - 9, "P", { bold: true, anchor: "middle" }));
    }
    const spot = (at) => [X(valueAt(phi, data.inertia, at, false)), Y(valueAt(phi, data.energy, at, false))];
    children.push(...planeMarks(marksOf(driver), spot, driver, free, number, { colour: "ink", bounds: [left, top, right, bottom] }));
    children.push(node("rect", { x: round(left), y: top, width: round(right - left), height: bottom - top, fill: "none", stroke: paint("edge") }));
    const cursor = node("circle", { r: 6, fill: "none", stroke: paint("ink"), "stroke-width": 2.4, visibility: "hidden" });
    children.push(cursor);
    return {
      title: text("Wittenbauer's diagram"),
      about: `MN = ${told(data.mn)}. ${pole}. ${text("Flywheel {inertia} kg m², irregularity {eps}.", { inertia: number(figure(data.flywheel, 5)), eps: number(figure(data.irregularity)) })}`,
      height: bottom + 34,
      children,
      point: (x, yy) => nearest(phi, xs, ys, x, yy, 60),
      move(at) {
        const [inertia, work] = [valueAt(phi, data.inertia, at, false), valueAt(phi, data.energy, at, false)];
        legend.tell(0, [at], driver.factor);
        legend.tell(1, [inertia], kilo.factor);
        legend.tell(2, [work], joule.factor);
        setAll(cursor, { cx: round(X(inertia)), cy: round(Y(work)), visibility: "visible" });
      },
      csv: () => csv([{ name: driver.name, unit: driver.si, values: phi }, { name: "I*", unit: "kg m²", values: data.inertia }, { name: "W", unit: "J", values: data.energy }]),
    };
  },
};

/** The stretch MN that the tangents cut off where I* = 0. */
function secant(data, { X, Y, told, free, near }) {
  const [m, n] = data.tangents.map((tangent) => Y(tangent.intercept));
  const x = X(0);
  const words = `MN = ${told(data.mn, 4)}`;
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
