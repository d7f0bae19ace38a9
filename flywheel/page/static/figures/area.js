// The area of a servo drive: its curves of torque over speed, the motion's loop, the rms point and the peak point.

import { axis, csv, label, node, paint, path, round, valueAt, wide } from "./svg.js";
import { DASHES, lineOf, note, setAll } from "./curves.js";
import { clear, driverOf, legendOf, up } from "./panel.js";
import { jumpPairs, nearest, planeCurve } from "./plane.js";

export const area = {
  draw(answer, width, tools) {
    const data = answer.servo;
    const { title, about, remarks, rows: [row] } = data.diagram;
    const driver = driverOf(answer, tools);
    const legend = legendOf([
      { name: driver.symbol, unit: driver.unit, swatchless: true },
      { name: "ω", unit: "rpm", swatchless: true },
      { name: "T", unit: row.unit, swatchless: true },
      ...row.curves.map((curve) => ({ ...curve, dash: DASHES[curve.dash], line: curve.width })),
      ...row.marks.map(({ words, colour, kind }) => ({ name: words, colour, mark: kind === "greatest" ? up : disc })),
    ], width, 0, tools);
    const children = [...legend.nodes];
    let top = legend.height;
    for (const words of remarks) top = note(children, words, width, top);
    top += 20;
    const bottom = top + Math.round(Math.min(Math.max(0.5 * width, 200), 300));
    const vertical = axis(data.window[2], data.window[3], bottom, top, { every: 34, number: tools.number });
    const left = Math.max(...vertical.ticks.map((tick) => wide(tick.words)), 24) + 12;
    const right = width - 22;
    const along = axis(data.window[0] * row.across, data.window[1] * row.across, left, right, { every: 60, number: tools.number });
    const X = (value) => along.at(value * row.across);
    const Y = vertical.at;
    for (const tick of vertical.ticks) {
      children.push(node("line", { x1: round(left), x2: round(right), y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
      children.push(label(left - 5, tick.at + 4, tick.words, { anchor: "end", colour: "muted" }));
    }
    for (const tick of along.ticks) {
      children.push(node("line", { x1: round(tick.at), x2: round(tick.at), y1: top, y2: bottom, stroke: paint("grid") }));
      children.push(label(tick.at, bottom + 14, tick.words, { anchor: "middle", colour: "muted" }));
    }
    children.push(label(2, top - 7, `${row.label}, ${row.unit}`, { bold: true }));
    children.push(label((left + right) / 2, bottom + 29, data.words, { anchor: "middle", colour: "muted" }));
    if (data.window[2] < 0) children.push(node("line", { x1: round(left), x2: round(right), y1: round(Y(0)), y2: round(Y(0)), stroke: paint("ink") }));
    const [xs, ys] = [data.speed.map(X), data.torque.map(Y)];
    for (const curve of row.curves) {
      const style = { ...curve, dash: DASHES[curve.dash], line: curve.width };
      if (curve.of === "torque") children.push(...planeCurve(xs, ys, jumpPairs(answer.phi, xs, ys, bottom - top, driver.cyclic), style));
      else for (const way of data.window[2] < 0 ? [1, -1] : [1]) children.push(lineOf(path(data.speeds.map(X), data[curve.of].map((value) => Y(way * value))), style));
    }
    const free = clear();
    for (const { at, value, kind, colour, short } of row.marks.map((mark, k) => ({ ...mark, short: data.names[k] }))) {
      const [x, y] = [X(at), Y(value)];
      children.push(node("path", { d: kind === "greatest" ? up(x, y) : disc(x, y), fill: paint(colour) }));
      const spot = free.take([[x + 8, y - 6], [x - 8 - wide(short), y - 6], [x - wide(short) / 2, y - 22], [x - wide(short) / 2, y + 10]].filter(([a]) => a > left && a + wide(short) < right), wide(short), 12);
      if (spot) children.push(label(spot[0], spot[1] + 10, short, { halo: true, colour }));
    }
    children.push(node("rect", { x: round(left), y: top, width: round(right - left), height: bottom - top, fill: "none", stroke: paint("edge") }));
    const cursor = node("circle", { r: 6, fill: "none", stroke: paint("ink"), "stroke-width": 2.4, visibility: "hidden" });
    children.push(cursor);
    return {
      title,
      about,
      height: bottom + 36,
      children,
      point: (x, y) => nearest(answer.phi, xs, ys, x, y, 60),
      move(at) {
        const [speed, torque] = [valueAt(answer.phi, data.speed, at, driver.cyclic), valueAt(answer.phi, data.torque, at, driver.cyclic)];
        legend.tell(0, [at], driver.factor);
        legend.tell(1, [speed], row.across);
        legend.tell(2, [torque], 1);
        setAll(cursor, { cx: round(X(speed)), cy: round(Y(torque)), visibility: "visible" });
      },
      csv: () => csv([{ name: driver.name, unit: driver.si, values: answer.phi }, { name: "ω", unit: "rad/s", values: data.speed }, { name: "T", unit: "N m", values: data.torque }]),
    };
  },
};

const disc = (x, y) => `M${round(x - 4)} ${round(y)}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0`;
