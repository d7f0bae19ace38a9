// The turning moment: what drives and what resists, their sum with its areas and their works, and the work W under it.

import { axis, csv, figure, label, node, paint, path, round, scaled, wide } from "./svg.js";
import { curvesOf, lineOf } from "./curves.js";
import { driverOf, legendOf, placeOf } from "./panel.js";

const OFF_THE_SCALE = 6; // times the greatest net moment: curves beyond it are told, not drawn

export const moment = {
  draw(answer, width, tools) {
    const data = answer.moment;
    return data.diagram ? bars(data, width, tools) : curves(answer, data, width, tools);
  },
};

function curves(answer, data, width, tools) {
  const { text, number } = tools;
  const driver = driverOf(answer, tools);
  const largest = greatest(data.net);
  const far = Math.max(greatest(data.driving), greatest(data.resisting)) > OFF_THE_SCALE * largest;
  const unit = scaled("N m", far ? largest : Math.max(greatest(data.driving), greatest(data.resisting), largest));
  const joule = scaled("J", greatest(data.work));
  const beyond = far ? ` (${text("off the scale")})` : "";
  const lines = [
    { name: text("M*, net"), values: data.net, colour: "ink", line: 2 },
    { name: `${text("drives")}${beyond}`, values: data.driving, colour: "blue", dash: "7 3", hidden: far },
    { name: `${text("resists")}${beyond}`, values: data.resisting, colour: "vermillion", dash: "2 3", hidden: far },
  ];
  if (data.along) lines.push({ name: text("M* along the motion"), values: data.along, colour: "green", dash: "9 3 2 3", line: 1.4 });
  const notes = [];
  if (data.constant_speed) {
    notes.push(text("Areas are those at a constant speed of {speed} rpm.", { speed: number(figure((data.constant_speed * 30) / Math.PI)) }));
  }
  if (data.balance) {
    const { name, value, unit: own } = data.balance;
    notes.push(`${name === "drive" ? text("Balance: driving torque") : text("Balance: {name}", { name })} ${number(figure(value, 5))} ${own}`.trim() + ".");
  }
  const extremes = [["greatest", "up"], ["least", "down"]].map(([which, kind]) => {
    const { at, value } = data[which];
    return { at, value, kind, words: `${number(figure(value * joule.factor))} ${joule.unit}` };
  });
  const swing = `${number(figure(data.fluctuation * joule.factor, 5))} ${joule.unit}`;
  return curvesOf(answer, width, tools, {
    title: text("Turning moment and its areas"),
    about: about(data, driver, tools),
    notes,
    rows: [
      {
        name: "M*", unit, height: Math.round(Math.min(Math.max(0.42 * width, 150), 230)), curves: lines, zero: true, room: 0.12,
        under: (place) => fills(data, place),
        over: (place) => numbers(data, place),
      },
      {
        name: `W, ${text("accumulated")} (ΔW = ${swing})`, unit: joule, height: 96, zero: true, room: 0.22,
        curves: [{ name: "W", values: data.work, colour: "purple", line: 2 }], marks: extremes,
      },
    ],
    columns: [
      { name: "M*", unit: "N m", values: data.net },
      { name: text("drives"), unit: "N m", values: data.driving },
      { name: text("resists"), unit: "N m", values: data.resisting },
      ...(data.along ? [{ name: text("M* along the motion"), unit: "N m", values: data.along }] : []),
      { name: "W", unit: "J", values: data.work },
    ],
  });
}

function greatest(values) {
  let found = 0;
  for (const value of values) if (Math.abs(value) > found) found = Math.abs(value);
  return found;
}

function about(data, driver, tools) {
  const { text, number } = tools;
  const told = data.areas.slice(0, 12).map((area, k) =>
    text("area {k} from {from} to {to}: {work} J", {
      k: k + 1, from: placeOf(driver, area.from, tools), to: placeOf(driver, area.to, tools), work: number(figure(area.work, 5)),
    }));
  const swing = text("Greatest less least accumulated work: {work} J.", { work: number(figure(data.fluctuation, 5)) });
  return `${told.join("; ")}. ${swing}`;
}

/** The areas, blue where the moment speeds the machine up, orange where it slows it down. */
function fills(data, { xs, Y }) {
  const zero = Y(0);
  return [[1, "sky", 0.28], [-1, "orange", 0.3]].map(([side, colour, opacity]) => {
    const ys = data.net.map((value) => (side * value > 0 ? Y(value) : zero));
    const closed = `${path(xs, ys)}L${round(xs[xs.length - 1])} ${round(zero)}L${round(xs[0])} ${round(zero)}Z`;
    return node("path", { d: closed, fill: paint(colour), "fill-opacity": opacity });
  });
}

/** A number and the work of every area: within it, or beyond its curve; where there is no room the number alone, or nothing. */
function numbers(data, place) {
  const { X, Y, phi, free, left, right, top, bottom } = place;
  const largest = greatest(data.areas.map((area) => area.work));
  const order = data.areas.map((area, k) => ({ ...area, k })).filter((area) => area.work).sort((a, b) => Math.abs(b.work) - Math.abs(a.work));
  const joule = scaled("J", largest);
  const found = [];
  for (const { from, to, work, k } of order.slice(0, 40)) {
    const side = Math.sign(work);
    const [at, high] = top_of(data.net, phi, from, to, side);
    const words = [`A${k + 1}: ${place.tools.number(figure(work * joule.factor))} ${joule.unit}`, `A${k + 1}`];
    for (const word of words) {
      const w = 1.1 * wide(word, 11) + 4;
      const spots = [];
      const middle = X((from + to) / 2);
      if (X(to) - X(from) > w + 6 && Math.abs(Y(high) - Y(0)) > 20) spots.push([X(at) - w / 2, (Y(0) + Y(high)) / 2 - 6], [middle - w / 2, Y(0) + (side > 0 ? -16 : 4)]);
      const edge = Y(side > 0 ? Math.max(high, 0) : Math.min(high, 0));
      for (const lift of [4, 18, 32]) spots.push([X(at) - w / 2, side > 0 ? edge - 12 - lift : edge + lift]);
      const inside = spots.map(([x, y]) => [Math.min(Math.max(x, left + 2), right - w - 2), Math.min(Math.max(y, top + 2), bottom - 14)]);
      const spot = free.take(inside, w, 13);
      if (!spot) continue;
      found.push(label(spot[0], spot[1] + 10, word, { bold: true, halo: true }));
      break;
    }
  }
  return found;
}

/** Where an area is highest, and how high. */
function top_of(net, phi, from, to, side) {
  let best = [(from + to) / 2, 0];
  for (let k = 0; k < phi.length; k++) {
    if (phi[k] >= from && phi[k] <= to && side * net[k] > side * best[1]) best = [phi[k], net[k]];
  }
  const near = 0.25 * (to - from);
  return [Math.min(Math.max(best[0], from + near), to - near), best[1]];
}

// -- a diagram of areas -----------------------------------------------------------------------------------------------

/** Bars of the areas, and their sums under them. */
function bars(data, width, tools) {
  const { text, number } = tools;
  const works = data.areas.map((area) => area.work);
  const sums = [0, ...data.areas.map((area) => area.accumulated)];
  const joule = scaled("J", Math.max(greatest(works), greatest(sums)));
  const legend = legendOf([{ name: text("speeds up"), colour: "sky", fill: 0.6 }, { name: text("slows down"), colour: "orange", fill: 0.6 }], width, 0, tools);
  const children = [...legend.nodes];
  const left = 64;
  const right = width - 10;
  const X = (k) => left + ((k + 0.5) / sums.length) * (right - left);
  const rows = [
    { name: text("Areas"), values: works, top: legend.height + 20, height: 140, mark: "A", first: 1, shift: 0.5 },
    { name: `${text("Sums of the areas")} (ΔW = ${number(figure(data.fluctuation * joule.factor, 5))} ${joule.unit})`, values: sums, top: legend.height + 212, height: 130, mark: "S", first: 0, shift: 0 },
  ];
  for (const row of rows) {
    const bottom = row.top + row.height;
    const least = Math.min(0, ...row.values) * joule.factor;
    const most = Math.max(0, ...row.values) * joule.factor;
    const room = 0.15 * (most - least);
    const scale = axis(least - (least < 0 ? room : 0), most + (most > 0 ? room : 0), bottom, row.top, { every: 30, number });
    children.push(label(2, row.top - 7, `${row.name}, ${joule.unit}`, { bold: true }));
    for (const tick of scale.ticks) {
      children.push(node("line", { x1: left, x2: right, y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
      children.push(label(left - 5, tick.at + 4, tick.words, { anchor: "end", colour: "muted" }));
    }
    const Y = (value) => scale.at(value * joule.factor);
    const every = Math.ceil(row.values.length / Math.max((right - left) / 34, 1));
    row.values.forEach((value, k) => {
      const x = X(k + row.shift);
      if (row.mark === "A") {
        const half = 0.34 * ((right - left) / sums.length);
        children.push(node("rect", { x: round(x - half), width: round(2 * half), y: round(Math.min(Y(0), Y(value))), height: round(Math.abs(Y(value) - Y(0))), fill: paint(value > 0 ? "sky" : "orange"), "fill-opacity": 0.6, stroke: paint("ink") }));
      } else children.push(node("circle", { cx: round(x), cy: round(Y(value)), r: 4, fill: paint("purple") }));
      if (k % every) return;
      children.push(label(x, bottom + 14, `${row.mark}${k + row.first}`, { anchor: "middle", colour: "muted" }));
      const words = number(figure(value * joule.factor));
      if (wide(words) < ((right - left) / sums.length) * every) {
        children.push(label(x, value < 0 ? Y(value) + 14 : Y(value) - 7, words, { anchor: "middle", halo: true }));
      }
    });
    if (row.mark === "S") {
      children.push(lineOf(path(row.values.map((_, k) => X(k)), row.values.map(Y)), { colour: "purple", dash: "3 3", line: 1.2 }));
      for (const [which, colour] of [["greatest", "blue"], ["least", "vermillion"]]) {
        const y = round(Y(data[which].value));
        children.push(node("line", { x1: left, x2: right, y1: y, y2: y, stroke: paint(colour), "stroke-dasharray": "6 3" }));
      }
    }
    children.push(node("line", { x1: left, x2: right, y1: round(Y(0)), y2: round(Y(0)), stroke: paint("ink") }));
    children.push(node("rect", { x: left, y: row.top, width: right - left, height: row.height, fill: "none", stroke: paint("edge") }));
  }
  return {
    title: text("Areas of the turning moment and their sums"),
    about: works.map((work, k) => `A${k + 1}: ${number(figure(work, 5))} J, S${k + 1}: ${number(figure(sums[k + 1], 5))} J`).join("; "),
    height: legend.height + 370,
    children,
    csv: () => csv([
      { name: text("area"), values: works.map((_, k) => `A${k + 1}`) },
      { name: text("work"), unit: "J", values: works },
      { name: text("accumulated"), unit: "J", values: sums.slice(1) },
    ]),
  };
}
