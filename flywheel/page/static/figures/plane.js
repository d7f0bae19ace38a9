// Curves in a plane, marked by the driver's positions that they belong to: hodographs and Wittenbauer's loop.

import { label, node, paint, path, round, wide } from "./svg.js";

const NEAR = 9; // px: marks closer than that are told together

/** Positions of the driver (SI) to be marked: every 30°, wider in a long cycle; tenths of a stroke. */
export function marksOf(driver) {
  const span = driver.greatest - driver.least;
  const step = !driver.turns || !driver.cyclic ? span / 10 : (Math.PI / 6) * Math.max(Math.ceil(span / (2 * Math.PI) - 1e-9), 1);
  const count = Math.round(span / step);
  return Array.from({ length: driver.cyclic ? count : count + 1 }, (_, k) => driver.least + k * step);
}

/** Where a curve in px jumps: pairs of the points before and behind; where it ends elsewhere than it began, too. */
export function jumpPairs(phi, xs, ys, size, cyclic) {
  const last = phi.length - 1;
  const apart = (a, b) => xs[a] !== null && xs[b] !== null && Math.hypot(xs[a] - xs[b], ys[a] - ys[b]) > 0.004 * size;
  const pairs = [];
  for (let k = 1; k <= last; k++) if (phi[k] === phi[k - 1] && apart(k - 1, k)) pairs.push([k - 1, k]);
  if (cyclic && apart(last, 0)) pairs.push([last, 0]);
  return pairs;
}

/** The samples before and behind each jump that a row names by the one behind; 0 is the jump from a cycle's end to its begin. */
export function breakPairs(breaks, count) {
  return breaks.map((k) => [k ? k - 1 : count - 1, k]);
}

/** The line of a curve in px, broken at its jumps (pairs of samples), which are dotted, with open ends. */
export function planeCurve(xs, ys, pairs, { colour = "blue", line = 1.8, dash = null, open = true } = {}) {
  const drawn = [node("path", { d: path(xs, ys, new Set(pairs.map(([, k]) => k))), fill: "none", stroke: paint(colour), "stroke-width": line, "stroke-dasharray": dash, "stroke-linejoin": "round" })];
  for (const [a, b] of pairs) {
    drawn.push(node("line", { x1: round(xs[a]), y1: round(ys[a]), x2: round(xs[b]), y2: round(ys[b]), stroke: paint("muted"), "stroke-width": 1, "stroke-dasharray": "1 4" }));
    for (const k of open ? [a, b] : []) drawn.push(node("circle", { cx: round(xs[k]), cy: round(ys[k]), r: 2.6, fill: paint("paper"), stroke: paint(colour) }));
  }
  return drawn;
}

/** Dots along a curve with the positions beside them; those of one place are told together, those without room not at all. */
export function planeMarks(marks, at, driver, free, number, { colour = "blue", bounds = null, ends = [] } = {}) {
  const drawn = [];
  const groups = [];
  for (const position of marks) {
    const spot = at(position);
    if (!spot) continue;
    drawn.push(node("circle", { cx: round(spot[0]), cy: round(spot[1]), r: 2.4, fill: paint(colour) }));
    const group = groups.find((each) => Math.hypot(each.spot[0] - spot[0], each.spot[1] - spot[1]) < NEAR);
    if (group) group.positions.push(position);
    else groups.push({ spot, positions: [position] });
  }
  for (const { spot, position } of ends) {
    if (!groups.some((each) => Math.hypot(each.spot[0] - spot[0], each.spot[1] - spot[1]) < NEAR)) groups.push({ spot, positions: [position] });
  }
  const middle = groups.reduce((sum, { spot }) => [sum[0] + spot[0] / groups.length, sum[1] + spot[1] / groups.length], [0, 0]);
  for (const { spot } of groups) free.block(spot[0] - 3, spot[1] - 3, 6, 6);
  for (const { spot, positions } of groups) {
    const words = number(together(positions, driver, marks[1] - marks[0]));
    const w = wide(words, 10);
    const [dx, dy] = [spot[0] - middle[0], spot[1] - middle[1]];
    const length = Math.hypot(dx, dy) || 1;
    const places = [0, 0.8, -0.8, 1.6, -1.6, 2.4, -2.4, 3.1].flatMap((turn) => [11, 18].map((far) => {
      const angle = Math.atan2(dy / length, dx / length) + turn;
      return [spot[0] + Math.cos(angle) * (far + w / 2 - 4) - w / 2, spot[1] + Math.sin(angle) * far - 5];
    })).filter(([x, y]) => !bounds || (x >= bounds[0] && x + w <= bounds[2] && y >= bounds[1] && y + 11 <= bounds[3]));
    const place = free.take(places, w, 11);
    if (place) drawn.push(label(place[0], place[1] + 9, words, { size: 10, halo: true }));
  }
  return drawn;
}

/** Positions of one place: 30°, or 30–150°. */
function together(positions, driver, step) {
  const written = (value) => String(Number((value * driver.factor).toFixed(1))).replace("-", "−");
  const sign = driver.turns ? "°" : "";
  const row = positions.every((each, k) => k === 0 || Math.abs(each - positions[k - 1] - step) < 1e-6);
  if (row && positions.length > 2) return `${written(positions[0])}–${written(positions[positions.length - 1])}${sign}`;
  const listed = positions.slice(0, 4).map(written).join(", ");
  return `${listed}${positions.length > 4 ? "…" : ""}${sign}`;
}

/** The position whose point is nearest to a place (px), within a distance. */
export function nearest(phi, xs, ys, x, y, within = Infinity) {
  let best = null;
  let least = within;
  for (let k = 0; k < phi.length; k++) {
    if (xs[k] === null) continue;
    const far = Math.hypot(xs[k] - x, ys[k] - y);
    if (far < least) [least, best] = [far, phi[k]];
  }
  return best;
}
