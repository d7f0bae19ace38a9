// Rows of curves over the driver's coordinate, one axis under all of them, with values told at the cursor.

import { axis, csv, extent, label, node, paint, path, round, scaled, SMALL, valuesAt, wide } from "./svg.js";
import { clear, down, driverOf, driverTicks, legendOf, placeOf, up } from "./panel.js";

/**
 * Rows of curves. `spec`: {title, about, rows, notes, columns}; a row: {name, unit, height, curves, zero, under, over, marks};
 * a curve: {name, values, colour, dash, line, silent, hidden}, `hidden` in the legend alone, `silent` in the drawing alone.
 */
export function curvesOf(answer, width, tools, spec) {
  const driver = driverOf(answer, tools);
  const phi = answer.phi;
  const rows = spec.rows.map((row) => ({ ...row, ...rangeOf(row) }));
  const told = rows.flatMap((row) => row.curves.filter((curve) => !curve.silent).map((curve) => ({ ...curve, row })));
  const entries = [{ name: driver.symbol, unit: driver.unit, colour: "paper", line: 0, swatchless: true }];
  entries.push(...told.map((curve) => ({ ...curve, unit: curve.row.unit.unit, jumps: jumpsIn(phi, curve.values) })));
  const legend = legendOf(entries, width, 0, tools);
  const children = [...legend.nodes];
  let y = legend.height;
  for (const words of spec.notes ?? []) y = note(children, words, width, y);
  const left = Math.min(Math.max(...rows.map((row) => ticksWidth(row, tools))) + 10, 0.3 * width);
  const right = width - 8;
  const X = (at) => left + ((at - driver.least) / (driver.greatest - driver.least)) * (right - left);
  const xs = phi.map(X);
  const cursors = [];
  for (const row of rows) {
    const top = y + 20;
    const bottom = top + row.height;
    const scale = axis(row.least, row.greatest, bottom, top, { every: 30, number: tools.number });
    const apart = scale.origin ? ` − ${tools.number(String(Number(scale.origin.toPrecision(10))))}` : "";
    children.push(label(2, top - 7, `${row.name}${apart}${row.unit.unit ? `, ${row.unit.unit}` : ""}`, { bold: true }));
    for (const tick of scale.ticks) {
      children.push(node("line", { x1: round(left), x2: right, y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
      children.push(label(left - 5, tick.at + 4, tick.words, { anchor: "end", colour: "muted" }));
    }
    const Y = (value) => scale.at(value * row.unit.factor);
    const place = { X, Y, xs, top, bottom, left, right, phi, driver, free: clear(), tools };
    children.push(...gridOf(driver, place));
    children.push(...(row.under?.(place) ?? []));
    if (row.least < 0 && row.greatest > 0) {
      children.push(node("line", { x1: round(left), x2: right, y1: round(Y(0)), y2: round(Y(0)), stroke: paint("ink") }));
    }
    const dots = [];
    for (const curve of row.curves) {
      if (curve.hidden) continue;
      const ys = curve.values.map((value) => (value === null ? null : Y(value)));
      children.push(lineOf(path(xs, ys), curve));
      const dot = node("circle", { r: 3.5, fill: paint(curve.colour), stroke: paint("paper"), visibility: "hidden" });
      dots.push({ dot, curve, Y });
    }
    for (const mark of row.marks ?? []) children.push(...markOf(mark, place));
    children.push(...(row.over?.(place) ?? []));
    children.push(node("rect", { x: round(left), y: top, width: round(right - left), height: row.height, fill: "none", stroke: paint("edge") }));
    const line = node("line", { y1: top, y2: bottom, stroke: paint("ink"), "stroke-dasharray": "4 3", visibility: "hidden" });
    children.push(line, ...dots.map(({ dot }) => dot));
    cursors.push({ line, dots });
    y = bottom + 6;
  }
  children.push(...driverAxis(driver, { X, left, right, y: y - 6 }, tools));
  const height = y + 30;
  return {
    title: spec.title,
    about: spec.about,
    height,
    children,
    point: (x) => Math.min(Math.max(driver.least + ((x - left) / (right - left)) * (driver.greatest - driver.least), driver.least), driver.greatest),
    move(at) {
      legend.tell(0, [at], driver.factor);
      told.forEach((curve, k) => legend.tell(k + 1, valuesAt(phi, curve.values, at, driver.cyclic), curve.row.unit.factor));
      const x = round(X(at));
      for (const { line, dots } of cursors) {
        setAll(line, { x1: x, x2: x, visibility: "visible" });
        for (const { dot, curve, Y } of dots) {
          const found = valuesAt(phi, curve.values, at, driver.cyclic);
          const value = found[found.length - 1];
          setAll(dot, value === null ? { visibility: "hidden" } : { cx: x, cy: round(Y(value)), visibility: "visible" });
        }
      }
    },
    csv: () => csv([{ name: driver.name, unit: driver.si, values: phi }, ...spec.columns]),
  };
}

export function setAll(element, attributes) {
  for (const key in attributes) element.setAttribute(key, attributes[key]);
}

/** A curve's line with its colour and dashes. */
export function lineOf(data, { colour, dash, line = 1.8 }) {
  return node("path", { d: data, fill: "none", stroke: paint(colour), "stroke-width": line, "stroke-dasharray": dash, "stroke-linejoin": "round" });
}

function rangeOf(row) {
  const seen = row.curves.filter((curve) => !curve.hidden).map((curve) => curve.values);
  let [least, greatest] = row.range ?? extent(...seen, ...(row.also ? [row.also] : []));
  if (row.zero) [least, greatest] = [Math.min(least, 0), Math.max(greatest, 0)];
  const unit = row.unit.factor === undefined ? scaled(row.unit, Math.max(Math.abs(least), Math.abs(greatest))) : row.unit;
  const room = (greatest - least) * (row.room ?? 0.08);
  const [below, above] = [row.zero && least === 0 ? 0 : room, row.zero && greatest === 0 ? 0 : room];
  return { unit, least: (least - below) * unit.factor, greatest: (greatest + above) * unit.factor };
}

function ticksWidth(row, tools) {
  const { ticks } = axis(row.least, row.greatest, row.height, 0, { every: 30, number: tools.number });
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
  const found = driverTicks(driver, right - left).map((at) => {
    const words = tools.number(String(Number((at * driver.factor).toFixed(6))).replace("-", "−"));
    const half = wide(words) / 2;
    return label(Math.min(X(at), right + 6 - half), y + 14, words, { anchor: "middle", colour: "muted" });
  });
  found.push(label((left + right) / 2, y + 29, `${driver.name} ${driver.symbol}, ${driver.unit}`, { anchor: "middle", colour: "muted" }));
  return found;
}

/** The greatest or least value of a curve: a triangle and its value, where there is room for it. */
function markOf({ at, value, kind, words, colour = "ink" }, place) {
  if (at === null || value === null) return [];
  const [x, y] = [place.X(at), place.Y(value)];
  const found = [node("path", { d: kind === "up" ? up(x, y - 1) : down(x, y + 1), fill: paint(colour) })];
  const w = wide(words);
  const above = kind === "up" ? [y - 20, y + 8] : [y + 10, y - 24];
  const places = above.flatMap((top) => [[x - w / 2, top], [x + 8, top], [x - w - 8, top]]);
  const inside = places.map(([a, b]) => [Math.min(Math.max(a, place.left + 2), place.right - w - 2), Math.min(Math.max(b, place.top + 2), place.bottom - 14)]);
  place.free.block(x - 5, y - 8, 10, 16);
  const spot = place.free.take(inside, w, 13);
  if (spot) found.push(label(spot[0], spot[1] + 10, words, { halo: true, colour }));
  return found;
}

/** Words for the greatest or least value of a curve. */
export function extremeWords(extreme, unit, driver, tools, { figure }) {
  return extreme ? `${tools.number(figure(extreme.value * unit.factor))} ${unit.unit}, ${placeOf(driver, extreme.at, tools)}` : "";
}
