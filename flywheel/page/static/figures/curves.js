// Diagrams of rows, whichever they are: curves over the driver's coordinate, stacks, bars and points, with one axis under them.

import { axis, csv, extent, figure, label, node, paint, path, round, scaled, SMALL, valuesAt, wide } from "./svg.js";
import { clear, coloursOf, down, driverOf, driverTicks, legendOf, up } from "./panel.js";

export const DASHES = { "-": null, "--": "7 3", "-.": "9 3 2 3", ":": "2 3" };
const BODY_DASHES = [null, "6 3", "2 2", "8 3 2 3", "1 3", "10 4", "4 2", "3 5"];
const FILL = 0.3; // opacity of what is filled
const STACK = 0.4;
const ROOM = 0.08; // of a row's height, above and below its curves
const ROOM_OF_WORDS = 0.18;
const MOST_NAMED = 40; // areas

/** The values of a curve: its place in the figures of a diagram, "traces.0.values". */
export function valuesOf(data, of) {
  return of.split(".").reduce((part, key) => part[key], data);
}

/** A figure of the rows of one diagram of an answer. */
export const rowsOf = (id) => ({
  draw(answer, width, tools) {
    const data = answer[id];
    const { title, about, remarks, rows: source } = data.diagram;
    const driver = driverOf(answer, tools);
    const numbered = source[0].ticks !== "";
    const phi = answer.phi;
    const colours = coloursOf(answer);
    const rows = source.map((row, k) => ({
      ...row, ...rangeOf(row, data), si: row.si || row.unit, pixels: heightOf(row, k, width),
      curves: row.curves.map((curve, n) => ({
        ...curve, values: valuesOf(data, curve.of), dash: DASHES[curve.dash], line: curve.width,
        ...(row.kind === "stack" && !curve.drawn ? { colour: colours(curve.body, n), fill: STACK, dash: BODY_DASHES[n % 8] } : {}),
      })),
    }));
    const read = numbered ? [] : rows.flatMap((row) => row.curves.map((curve) => ({ ...curve, row })));
    const legend = legendOf(entriesOf(rows, read, numbered ? null : driver, phi), width, 0, tools);
    const children = [...legend.nodes];
    let y = legend.height;
    for (const words of [...remarks, ...rows.flatMap((row) => row.notes)]) y = note(children, words, width, y);
    const left = Math.min(Math.max(...rows.map((row) => ticksWidth(row, tools))) + 10, 0.3 * width);
    const right = width - 8;
    const count = Math.max(...rows.map((row) => row.curves[0].values.length + (row.ticks === "A" ? 1 : 0)));
    const X = numbered
      ? (at) => left + ((at + 0.5) / count) * (right - left)
      : (at) => left + ((at - driver.least) / (driver.greatest - driver.least)) * (right - left);
    const cursors = [];
    for (const row of rows) {
      const drawn = drawnRow(children, row, { X, left, right, top: y + 20, phi, driver, data, tools, count });
      cursors.push(drawn);
      y = drawn.bottom + (numbered ? 26 : 6);
    }
    if (!numbered) children.push(...driverAxis(driver, { X, left, right, y: y - 6 }, tools));
    const columns = rows.flatMap((row) => row.curves.map((curve) => ({ name: (curve.name || row.label).split(", ")[0], unit: row.si, values: curve.values })));
    return {
      title,
      about,
      height: numbered ? y : y + 30,
      children,
      point: numbered ? undefined : (x) => Math.min(Math.max(driver.least + ((x - left) / (right - left)) * (driver.greatest - driver.least), driver.least), driver.greatest),
      move(at) {
        if (numbered) return;
        legend.tell(0, [at], driver.factor);
        read.forEach((curve, k) => legend.tell(k + 1, valuesAt(phi, curve.values, at, driver.cyclic), curve.row.unit.factor));
        const x = round(X(at));
        for (const { line, dots } of cursors) {
          setAll(line, { x1: x, x2: x, visibility: "visible" });
          for (const { dot, curve, Y } of dots) {
            const value = valuesAt(phi, curve.values, at, driver.cyclic).pop();
            setAll(dot, value === null ? { visibility: "hidden" } : { cx: x, cy: round(Y(value)), visibility: "visible" });
          }
        }
      },
      csv: () => csv([numbered ? { name: rows[0].ticks, values: Array.from({ length: count }, (_, k) => k) } : { name: driver.name, unit: driver.si, values: phi }, ...columns]),
    };
  },
});

function heightOf({ height }, k, width) {
  const share = height / 4.4;
  return Math.round((k ? 0.6 : 1) * share * Math.min(Math.max(0.42 * width, 160), 230));
}

function entriesOf(rows, read, driver, phi) {
  const entries = driver ? [{ name: driver.symbol, unit: driver.unit, swatchless: true }] : [];
  entries.push(...read.map((curve) => ({ ...curve, unit: curve.row.unit.unit, jumps: jumpsIn(phi, curve.values), swatchless: !curve.drawn && !curve.fill })));
  for (const row of rows) {
    if (!driver) entries.push(...row.curves.filter(({ name }) => name).map((curve) => ({ ...curve, mark: disc })));
    entries.push(...row.fills.map((fill) => ({ name: fill.name, colour: fill.colour, fill: FILL })));
    entries.push(...row.bands.filter(({ name }) => entries.every((entry) => entry.name !== name)).map(({ name, colour }) => ({ name, colour, fill: FILL })));
    entries.push(...row.levels.map(({ low, high, name }) => (low === high ? { name, colour: "muted", line: 1, dash: "8 3 1 3" } : { name, colour: "grid", fill: 1 })));
    if (row.dots.length) entries.push({ name: row.dots_name, colour: "ink", mark: disc });
  }
  return entries;
}

const disc = (x, y) => `M${round(x - 3)} ${round(y)}a3 3 0 1 0 6 0a3 3 0 1 0 -6 0`;

/** One row; adds to the children, and returns where it ends with its cursor. */
function drawnRow(children, row, { X, left, right, top, phi, driver, data, tools, count }) {
  const bottom = top + row.pixels;
  const scale = axis(row.least, row.greatest, bottom, top, { every: 30, number: tools.number });
  const apart = scale.origin ? ` − ${tools.number(String(Number(scale.origin.toPrecision(10))))}` : "";
  const span = row.span ? ` (${row.span[2]})` : "";
  children.push(label(2, top - 7, `${row.label}${apart}${row.unit.unit ? `, ${row.unit.unit}` : ""}${span}`, { bold: true }));
  for (const tick of scale.ticks) {
    children.push(lineAt(tick.at, left, right, { stroke: paint("grid") }));
    children.push(label(left - 5, tick.at + 4, tick.words, { anchor: "end", colour: "muted" }));
  }
  const Y = (value) => scale.at(value * row.unit.factor);
  const place = { X, Y, xs: row.ticks ? [] : phi.map(X), top, bottom, left, right, phi, driver, free: clear(), tools };
  if (!row.ticks) children.push(...gridOf(driver, place));
  children.push(...row.bands.map((band) => bandOf(band, place)), ...row.levels.flatMap((level) => levelOf(level, place)));
  const dots = [];
  if (row.ticks) children.push(...numberedOf(row, place, count));
  else {
    if (row.kind === "stack") children.push(...layers(row.curves.filter(({ fill }) => fill), place));
    for (const fill of row.fills) children.push(fillOf(fill, valuesOf(data, fill.of), place));
    if (row.least < 0 && row.greatest > 0) children.push(lineAt(Y(0), left, right, { stroke: paint("ink") }));
    for (const curve of row.curves.filter(({ drawn }) => drawn)) {
      children.push(lineOf(path(place.xs, curve.values.map((value) => (value === null ? null : Y(value)))), curve));
      const dot = node("circle", { r: 3.5, fill: paint(curve.colour), stroke: paint("paper"), visibility: "hidden" });
      dots.push({ dot, curve, Y });
    }
    children.push(...row.dots.map(([at, value]) => node("path", { d: disc(X(at), Y(value)), fill: paint("ink") })));
  }
  for (const mark of row.marks) children.push(...markOf(mark, place));
  if (row.areas.length && !row.ticks) children.push(...numbers(data, row, place));
  children.push(node("rect", { x: round(left), y: top, width: round(right - left), height: row.pixels, fill: "none", stroke: paint("edge") }));
  const line = node("line", { y1: top, y2: bottom, stroke: paint("ink"), "stroke-dasharray": "4 3", visibility: "hidden" });
  children.push(line, ...dots.map(({ dot }) => dot));
  return { bottom, line, dots };
}

function lineAt(y, left, right, attributes) {
  return node("line", { x1: round(left), x2: round(right), y1: round(y), y2: round(y), ...attributes });
}

/** A stretch of the axis over the whole height. */
function bandOf({ low, high, colour }, { X, top, bottom }) {
  return node("rect", { x: round(X(low)), y: top, width: round(X(high) - X(low)), height: bottom - top, fill: paint(colour), "fill-opacity": FILL });
}

/** A band between two values, or a line at one. */
function levelOf({ low, high }, { Y, left, right }) {
  if (low === high) return [lineAt(Y(low), left, right, { stroke: paint("muted"), "stroke-dasharray": "8 3 1 3" })];
  const [top, bottom] = [Y(high), Y(low)];
  const band = node("rect", { x: round(left), y: round(top), width: round(right - left), height: round(bottom - top), fill: paint("grid"), "fill-opacity": 0.6 });
  return [band, ...[top, bottom].map((y) => lineAt(y, left, right, { stroke: paint("muted"), "stroke-dasharray": "1 3" }))];
}

/** What lies between a curve and zero, on one side. */
function fillOf({ side, colour }, values, { xs, Y }) {
  const zero = Y(0);
  const data = path(xs, values.map((value) => (side * value > 0 ? Y(value) : zero)));
  return node("path", { d: `${data}L${round(xs[xs.length - 1])} ${round(zero)}L${round(xs[0])} ${round(zero)}Z`, fill: paint(colour), "fill-opacity": FILL });
}

/** Curves upon one another, each with its name where there is room. */
function layers(curves, { xs, Y, left, free }) {
  const floor = new Array(xs.length).fill(0);
  const drawn = [];
  const names = [];
  for (const curve of curves) {
    const below = floor.map(Y);
    curve.values.forEach((value, k) => (floor[k] += value ?? 0));
    const above = floor.map(Y);
    const back = `${path([...xs].reverse(), [...below].reverse())}`.replace("M", "L");
    drawn.push(node("path", { d: `${path(xs, above)}${back}Z`, fill: paint(curve.colour), "fill-opacity": curve.fill }));
    drawn.push(node("path", { d: path(xs, above), fill: "none", stroke: paint(curve.colour), "stroke-width": 1.2, "stroke-dasharray": curve.dash }));
    let best = 0;
    for (let k = 1; k < xs.length - 1; k++) if (below[k] - above[k] > below[best] - above[best]) best = k;
    const w = wide(curve.name);
    const spot = [Math.min(Math.max(xs[best] - w / 2, left + 4), xs[xs.length - 1] - w - 4), (below[best] + above[best]) / 2 - 6];
    if (below[best] - above[best] > 16 && free.take([spot], w, 12)) names.push(label(spot[0], spot[1] + 10, curve.name, { halo: true }));
  }
  return [...drawn, ...names];
}

/** Bars of areas or points at crossings, with their numbers below and their values beside them. */
function numberedOf(row, { X, Y, left, right, bottom, tools }, count) {
  const drawn = [];
  const each = (right - left) / count;
  const every = Math.ceil(34 / each);
  const [curve] = row.curves;
  const first = row.ticks === "A" ? 1 : 0;
  const xs = curve.values.map((_, k) => X(k + first / 2));
  if (row.kind === "bars") drawn.push(lineAt(Y(0), left, right, { stroke: paint("ink") }));
  else if (curve.line && row.span) drawn.push(lineOf(path(xs, curve.values.map(Y)), { colour: curve.colour, line: 1.2 }));
  curve.values.forEach((value, k) => {
    const y = Y(value);
    if (row.kind === "bars") {
      const { colour } = row.fills.find(({ side }) => side * value > 0) ?? row.fills[0];
      const height = Math.abs(y - Y(0));
      drawn.push(node("rect", { x: round(xs[k] - 0.34 * each), width: round(0.68 * each), y: round(Math.min(Y(0), y)), height: round(height), fill: paint(colour), "fill-opacity": FILL, stroke: paint("ink") }));
    } else drawn.push(node("circle", { cx: round(xs[k]), cy: round(y), r: 4, fill: paint(curve.colour) }));
    if (k % every) return;
    drawn.push(label(xs[k], bottom + 14, `${row.ticks}${k + first}`, { anchor: "middle", colour: "muted" }));
    const words = tools.number(figure(value * row.unit.factor));
    if (row.kind === "bars" && wide(words) < each * every) drawn.push(label(xs[k], value < 0 ? y + 14 : y - 7, words, { anchor: "middle", halo: true }));
  });
  return drawn;
}

/** A number and the work of every area: within it, or beyond its curve; where there is no room the number alone, or nothing. */
function numbers(data, row, place) {
  const { X, Y, phi, free, left, right, top, bottom } = place;
  const order = data.areas.map((area, k) => ({ ...area, k })).filter((area) => area.work).sort((a, b) => Math.abs(b.work) - Math.abs(a.work));
  const net = row.curves[0].values;
  const drawn = [];
  for (const { from, to, work, k } of order.slice(0, MOST_NAMED)) {
    const side = Math.sign(work);
    const [at, high] = summit(net, phi, from, to, side);
    for (const words of [`A${k + 1}: ${row.areas[k]}`, `A${k + 1}`]) {
      const w = 1.1 * wide(words, 11) + 4;
      const spots = [];
      const middle = X((from + to) / 2);
      if (X(to) - X(from) > w + 6 && Math.abs(Y(high) - Y(0)) > 20) spots.push([X(at) - w / 2, (Y(0) + Y(high)) / 2 - 6], [middle - w / 2, Y(0) + (side > 0 ? -16 : 4)]);
      const edge = Y(side > 0 ? Math.max(high, 0) : Math.min(high, 0));
      for (const lift of [4, 18, 32]) spots.push([X(at) - w / 2, side > 0 ? edge - 12 - lift : edge + lift]);
      const inside = spots.map(([x, y]) => [Math.min(Math.max(x, left + 2), right - w - 2), Math.min(Math.max(y, top + 2), bottom - 14)]);
      const spot = free.take(inside, w, 13);
      if (!spot) continue;
      drawn.push(label(spot[0], spot[1] + 10, words, { bold: true, halo: true }));
      break;
    }
  }
  return drawn;
}

/** Where an area is highest, and how high. */
function summit(net, phi, from, to, side) {
  let best = [(from + to) / 2, 0];
  for (let k = 0; k < phi.length; k++) {
    if (phi[k] >= from && phi[k] <= to && side * net[k] > side * best[1]) best = [phi[k], net[k]];
  }
  const near = 0.25 * (to - from);
  return [Math.min(Math.max(best[0], from + near), to - near), best[1]];
}

export function setAll(element, attributes) {
  for (const key in attributes) element.setAttribute(key, attributes[key]);
}

/** A curve's line with its colour and dashes. */
export function lineOf(data, { colour, dash, line = 1.8 }) {
  return node("path", { d: data, fill: "none", stroke: paint(colour), "stroke-width": line, "stroke-dasharray": dash, "stroke-linejoin": "round" });
}

function rangeOf(row, data) {
  const seen = row.curves.filter((curve) => curve.drawn).map((curve) => valuesOf(data, curve.of));
  const also = row.levels.flatMap(({ low, high }) => [low, high]);
  let [least, greatest] = extent(...seen, also);
  if (row.zero) [least, greatest] = [Math.min(least, 0), Math.max(greatest, 0)];
  const unit = row.factor === 1 ? scaled(row.unit, Math.max(Math.abs(least), Math.abs(greatest))) : { unit: row.unit, factor: row.factor };
  const room = (greatest - least) * (row.marks.length || row.areas.length ? ROOM_OF_WORDS : ROOM);
  const [below, above] = [row.zero && least === 0 ? 0 : room, row.zero && greatest === 0 ? 0 : room];
  return { unit, least: (least - below) * unit.factor, greatest: (greatest + above) * unit.factor };
}

function ticksWidth(row, tools) {
  const { ticks } = axis(row.least, row.greatest, row.pixels, 0, { every: 30, number: tools.number });
  return Math.max(...ticks.map((tick) => wide(tick.words)), 10);
}

function jumpsIn(phi, values) {
  for (let k = 1; k < phi.length; k++) if (phi[k] === phi[k - 1] && values[k] !== values[k - 1]) return true;
  return false;
}

/** A sentence over the rows, in as many lines as it takes; returns where what follows begins. */
export function note(children, words, width, y) {
  let line = "";
  for (const word of words.split(" ")) {
    if (line && wide(`${line} ${word}`) > width - 8) {
      children.push(label(4, y + SMALL, line, { colour: "muted" }));
      y += 15;
      line = word;
    } else line = line ? `${line} ${word}` : word;
  }
  children.push(label(4, y + SMALL, line, { colour: "muted" }));
  return y + 19;
}

function gridOf(driver, { X, top, bottom, left, right }) {
  return driverTicks(driver, right - left).map((at) =>
    node("line", { x1: round(X(at)), x2: round(X(at)), y1: top, y2: bottom, stroke: paint("grid") }));
}

/** The axis of the driver under the rows. */
function driverAxis(driver, { X, left, right, y }, tools) {
  const labels = driverTicks(driver, right - left).map((at) => {
    const words = tools.number(String(Number((at * driver.factor).toFixed(6))).replace("-", "−"));
    const half = wide(words) / 2;
    return label(Math.min(X(at), right + 6 - half), y + 14, words, { anchor: "middle", colour: "muted" });
  });
  labels.push(label((left + right) / 2, y + 29, `${driver.name} ${driver.symbol}, ${driver.unit}`, { anchor: "middle", colour: "muted" }));
  return labels;
}

/** The greatest or least value of a curve: a triangle and its value, where there is room for it. */
function markOf({ at, value, kind, words, colour, level }, place) {
  if (at === null || value === null) return [];
  const [x, y] = [place.X(at), place.Y(value)];
  const top = kind === "greatest";
  const drawn = [node("path", { d: top ? up(x, y - 1) : down(x, y + 1), fill: paint(colour) })];
  if (level) drawn.push(lineAt(y, x, place.right, { stroke: paint("muted"), "stroke-dasharray": "1 3" }));
  const w = wide(words);
  const above = top ? [y - 20, y + 8] : [y + 10, y - 24];
  const places = above.flatMap((height) => [[x - w / 2, height], [x + 8, height], [x - w - 8, height]]);
  const inside = places.map(([a, b]) => [Math.min(Math.max(a, place.left + 2), place.right - w - 2), Math.min(Math.max(b, place.top + 2), place.bottom - 14)]);
  place.free.block(x - 5, y - 8, 10, 16);
  const spot = place.free.take(inside, w, 13);
  if (spot) drawn.push(label(spot[0], spot[1] + 10, words, { halo: true, colour }));
  return drawn;
}
