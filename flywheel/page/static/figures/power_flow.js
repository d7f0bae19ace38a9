// The power flow from the motor down to the tools as a Sankey diagram: the mean over the cycle, and at the cursor's angle.
//
// Power runs down the shafts. What a shaft loses or gives to a load leaves to the right, what it stores goes to the left and
// comes back from there. A band is as wide as its power; where power runs back, so do the arrows.

import { csv, figure, label, node, paint, round, scaled, valueAt, wide } from "./svg.js";
import { driverOf, placeOf } from "./panel.js";

const TURN = 5; // px: inner radius of a band that leaves
const HEAD = 8; // px: length of an arrow's head
const REACH = 16; // px: how far a band that has left goes on
const LINE = 14; // px between two lines of a label
const NAME = 22; // px of a shaft's name
const LEAST = 0.75; // px: the width of the smallest power that there is
const NOTHING = 1e-9; // of the greatest power: less is rounding
const SIDE_BY_SIDE = 720; // px: the width from which both diagrams stand side by side
const LINKS = new Set(["input", "drive", "shaft"]); // kinds of streams between places of the train
const COLOURS = { lost: "vermillion", load: "green", stored: "purple", train: "blue" };

export const powerFlow = {
  draw(answer, width, tools) {
    const { text, number } = tools;
    const data = answer.power_flow;
    const driver = driverOf(answer, tools);
    const rows = rowsOf(data);
    const columns = width >= SIDE_BY_SIDE ? 2 : 1;
    const each = width / columns - 6 * (columns - 1);
    const means = data.streams.map((stream) => stream.mean);
    const at = (phi) => data.streams.map((stream) => valueAt(answer.phi, stream.powers, phi, driver.cyclic));
    const lasting = rows.filter((row) => row.place !== undefined || means[row.k] !== 0); // what is stored is 0 on the mean
    const mean = diagramIn({ left: 0, top: 0, width: each, rows: lasting, courses: means.map((value) => [value]), heading: () => text("Mean over the cycle") }, data, tools);
    const beside = columns > 1 ? { left: each + 12, top: 0 } : { left: 0, top: mean.height + 14 };
    const now = diagramIn({ ...beside, width: each, rows, courses: data.streams.map((stream) => stream.powers), heading: (phi) => text("At {angle}", { angle: placeOf(driver, phi, tools) }) }, data, tools);
    mean.show(means, null);
    const watts = (value) => `${number(figure(value * scaled("W", data.input).factor))} ${scaled("W", data.input).unit}`;
    const share = data.efficiency === null ? "" : text(", {share} % of it as output", { share: number(figure(100 * data.efficiency)) });
    const parts = data.streams.filter((stream) => stream.kind !== "stored" && stream.mean).map((stream) => `${stream.label} ${watts(stream.mean)}`);
    return {
      title: text("Power flow"),
      about: `${text("Mean over the cycle: {input} in, {output} out, {losses} lost", { input: watts(data.input), output: watts(data.output), losses: watts(data.losses) })}${share}. ${parts.join("; ")}.`,
      height: columns > 1 ? Math.max(mean.height, now.height) : beside.top + now.height,
      children: [mean.group, now.group],
      move: (phi) => now.show(at(phi), phi),
      csv: () => csv([
        { name: driver.name, unit: driver.si, values: answer.phi },
        ...data.streams.map((stream) => ({ name: stream.label, unit: "W", values: stream.powers })),
      ]),
    };
  },
};

// -- the train as rows ------------------------------------------------------------------------------------------------

/** Rows from the source of power down: {place} names a place, {stream, side, sign} is what leaves it (sign -1: comes in). */
function rowsOf({ streams }) {
  const ends = (stream) => [stream.from, stream.to];
  const linked = streams.map((stream, k) => ({ ...stream, k })).filter((stream) => LINKS.has(stream.kind));
  const root = rootOf(streams);
  const rows = [];
  const seen = new Set();

  function visit(place, from) {
    seen.add(place);
    rows.push({ place, from });
    const sign = (stream) => (stream.from === place ? 1 : -1);
    const here = streams.map((stream, k) => ({ stream, k })).filter(({ stream, k }) => ends(stream).includes(place) && k !== from?.k);
    const leaves = (kinds) => here.filter(({ stream }) => kinds(stream)).map(({ stream, k }) => ({ k, sign: sign(stream), side: stream.kind === "stored" ? "left" : "right" }));
    rows.push(...leaves((stream) => stream.kind === "stored"), ...leaves((stream) => stream.lost));
    rows.push(...leaves((stream) => !stream.lost && stream.kind !== "stored" && !LINKS.has(stream.kind)));
    const onward = linked.filter((link) => link.k !== from?.k && ends(link).includes(place));
    onward.sort((a, b) => Math.abs(a.mean) - Math.abs(b.mean));
    const last = onward.pop();
    for (const link of onward) rows.push({ k: link.k, sign: sign(link), side: "right" });
    const next = (link) => (link.from === place ? link.to : link.from);
    const go = (link, broken) => !seen.has(next(link)) && visit(next(link), { k: link.k, sign: sign(link), broken });
    if (last) go(last, false);
    for (const link of onward) go(link, true);
  }

  visit(root.place, root.from);
  return rows;
}

/** Where power comes from: the mains, the drive, or the load that drives most; else the crank. */
function rootOf(streams) {
  for (const kind of ["input", "drive"]) {
    const source = streams.find((stream) => stream.kind === kind);
    if (source && source.from === { input: "mains", drive: "drive" }[kind]) return { place: source.from, from: null };
  }
  const entries = streams.map((stream, k) => ({ stream, k })).filter(({ stream }) => stream.to.startsWith("shafts.") && stream.kind === "load");
  entries.sort((a, b) => b.stream.mean - a.stream.mean);
  if (entries.length) return { place: entries[0].stream.to, from: { k: entries[0].k, sign: 1, entry: true } };
  return { place: "shafts.crank", from: null };
}

// -- a diagram --------------------------------------------------------------------------------------------------------

/** A diagram of rows: `show(values, phi)` draws it for powers of all streams; `courses` are lists of all that it may show. */
function diagramIn({ left, top, width, rows, courses, heading }, data, tools) {
  const { streams } = data;
  const group = node("g");
  const title = label(left + 2, top + 14, "", { bold: true, size: 12 });
  const bands = node("g");
  const words = node("g");
  group.append(title, bands, words);
  const most = courses.map((values) => Math.max(...values.map(Math.abs)));
  const extent = extentOf(rows, streams, courses);
  const widest = (side) => Math.max(...rows.filter((row) => row.side === side).map((row) => wide(streams[row.k].label)), 60);
  const places = Math.max(...rows.filter((row) => row.place !== undefined).map((row) => wide(data.places[row.place] ?? row.place)));
  const leftRoom = Math.min(0.46 * width, Math.max(rows.some((row) => row.side === "left") ? widest("left") + REACH + HEAD + TURN + 10 : 0, 1.1 * places + 14));
  const across = Math.max(Math.min(0.3 * width, 100, width - leftRoom - Math.min(widest("right"), 0.36 * width) - REACH - HEAD - TURN - 18), 24);
  const room = { left: leftRoom - REACH - HEAD - TURN - 10, right: width - leftRoom - across - REACH - HEAD - TURN - 8 };
  const placed = rows.map((row) => {
    const names = row.place === undefined ? broken(streams[row.k].label, room[row.side]) : ["", ""];
    const lines = [...names, ""].map(() => label(0, 0, ""));
    words.append(...lines);
    return { ...row, lines, names };
  });
  const factor = across / Math.max(extent.left + extent.right, extent.most);
  const begin = left + leftRoom + extent.left * factor;
  const heights = placed.map((row) => (row.place === undefined ? Math.max((row.names.length + 1) * LINE + 3, most[row.k] * factor + 2 * TURN + 4) : NAME + (row.from?.entry ? LINE : 0)));
  const height = 24 + heights.reduce((sum, one) => sum + one, 0) + 6;
  const thick = (value) => (Math.abs(value) <= NOTHING * extent.most ? 0 : Math.max(Math.abs(value) * factor, LEAST));

  function show(values, phi) {
    title.textContent = heading(phi);
    const parts = [];
    const trunkParts = [];
    const unit = scaled("W", Math.max(...values.map(Math.abs)));
    const say = (value) => `${tools.number(figure(value * unit.factor, 3))} ${unit.unit}`;
    let [x, y, p] = [begin, top + 24, 0];
    placed.forEach((row, n) => {
      const h = heights[n];
      if (row.place !== undefined) {
        p = powerInto(row, streams, values);
        if (row.from?.broken || n === 0) x = begin;
        trunkParts.push(rect(x, y, thick(p), h));
        parts.push(p === 0 ? null : chevron(x + thick(p) / 2, y + h / 2, Math.sign(p), thick(p)));
        parts.push(node("line", { x1: round(x - 6), x2: round(x + Math.max(thick(p), 8) + 6), y1: round(y + h), y2: round(y + h), stroke: paint("ink"), "stroke-width": 2 }));
        place(row.lines, left + 2, y + h - 3, "start", [data.places[row.place] ?? row.place], true);
        const ends = !row.from || row.from.entry || row.from.broken || n === placed.length - 1 || placed[n + 1].from?.broken;
        row.lines[1].textContent = row.lines[2].textContent = "";
        const entry = row.from?.entry ? [streams[row.from.k].label] : [];
        if (ends) place(row.lines.slice(1), x + thick(p) + 10, y + h - 5 - entry.length * LINE, "start", [...entry, say(p)]);
        y += h;
        return;
      }
      const stream = streams[row.k];
      const value = row.sign * values[row.k];
      const q = p - value;
      const made = junction({ x, y, h, p, q, thick, side: row.side, kind: kindOf(stream) });
      parts.push(...made.parts);
      trunkParts.push(made.through);
      const end = row.side === "right" ? made.end + 4 : made.end - 4;
      const share = stream.lost && data.input > 0 && phi === null ? ` · ${tools.number(figure((100 * stream.mean) / data.input, 3))} %` : "";
      const above = made.middle - 2 - ((row.names.length - 1) * LINE) / 2;
      place(row.lines, end, above, row.side === "right" ? "start" : "end", [...row.names, `${say(values[row.k])}${share}`]);
      x = made.x;
      p = q;
      y += h;
    });
    bands.replaceChildren(node("g", { opacity: 0.5 }, ...trunkParts), ...parts.filter(Boolean));
  }

  return { group, height, show };
}

function kindOf(stream) {
  return stream.lost ? "lost" : stream.kind === "stored" ? "stored" : stream.kind === "load" ? "load" : "train";
}

/** The power that comes down to a place: of the one where it all begins what leaves it. */
function powerInto({ place, from }, streams, values) {
  if (from) return from.sign * values[from.k];
  return streams.reduce((sum, stream, k) => sum + values[k] * ((stream.from === place) - (stream.to === place)), 0);
}

/** How far the train reaches to the left and right of where it begins, and the greatest power in it, at any time (W). */
function extentOf(rows, streams, courses) {
  const extent = { left: 0, right: 0, most: 1e-300 };
  for (let n = 0; n < Math.max(...courses.map((values) => values.length)); n++) {
    const values = courses.map((course) => course[n]);
    let [x, p] = [0, 0];
    for (const row of rows) {
      const q = row.place === undefined ? p - row.sign * values[row.k] : powerInto(row, streams, values);
      if (row.side === "left") x += Math.abs(p) - Math.abs(q);
      if (row.from?.broken) x = 0;
      p = q;
      extent.left = Math.max(extent.left, -x);
      extent.right = Math.max(extent.right, x + Math.abs(p));
      extent.most = Math.max(extent.most, Math.abs(p), row.k === undefined ? 0 : Math.abs(values[row.k]));
    }
  }
  return extent;
}

/** A label in lines that have room, broken between words. */
function broken(words, room) {
  const lines = [];
  for (const word of words.split(" ")) {
    const longer = lines.length ? `${lines[lines.length - 1]} ${word}` : word;
    if (lines.length && wide(longer) <= room) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

/** Lines of a label, one under the other. */
function place(lines, x, y, anchor, texts, bold = false) {
  texts.forEach((words, k) => {
    const line = lines[k];
    line.setAttribute("x", round(x));
    line.setAttribute("y", round(y + k * LINE));
    line.setAttribute("text-anchor", anchor);
    if (bold || (k && k === texts.length - 1)) line.setAttribute("font-weight", "bold");
    line.textContent = words;
  });
}

function rect(x, y, width, height) {
  return width ? node("rect", { x: round(x), y: round(y), width: round(width), height: round(height) + 0.4, fill: paint(COLOURS.train) }) : null;
}

/** The sense in which power runs in a band that goes down (1) or up (-1). */
function chevron(x, y, sense, thick) {
  if (thick < 7) return null;
  const half = Math.min(thick / 2 - 1, 7);
  return node("path", { d: `M${round(x - half)} ${round(y - 3 * sense)}L${round(x)} ${round(y + 3 * sense)}L${round(x + half)} ${round(y - 3 * sense)}`, fill: "none", stroke: paint("ink"), "stroke-width": 1.5 });
}

/**
 * A place where p W come down and q W go on down, the rest leaving at a side: what goes straight through, and what turns off
 * from above and from below. A negative power runs up. `end` is where the band ends, `middle` its height, `x` the left edge
 * of what goes on.
 */
function junction({ x, y, h, p, q, thick, side, kind }) {
  const right = side === "right";
  const least = Math.abs(p) < Math.abs(q) ? p : q;
  const through = p * q > 0 ? thick(least) : 0;
  const above = through && least === q ? through + thick(p - q) : thick(p);
  const below = through && least === p ? through + thick(p - q) : thick(q);
  const edge = right ? x : x + above; // which stays where it is
  const to = right ? 1 : -1;
  const parts = [];
  const inner = edge + to * through;
  const [a, b] = [above - through, below - through];
  const end = edge + to * (Math.max(above, below) + TURN + REACH);
  const out = p - q > 0;
  const middles = [];
  const top = y + Math.max((h - (a + b) - 2 * TURN) / 2, 0);
  for (const [t, from, sense] of [[a, y, 1], [b, y + h, -1]]) {
    if (t < 0.01) continue;
    const near = sense > 0 ? top + TURN : top + TURN + a + b; // of the side towards which it comes
    parts.push(turned({ inner, t, from, near, sense, to, end, out, kind }));
    middles.push(near + (sense * t) / 2);
  }
  const middle = middles.length ? middles.reduce((sum, one) => sum + one, 0) / middles.length : y + h / 2;
  const tip = out ? end + to * HEAD : end;
  return { parts, through: rect(right ? edge : edge - through, y, through, h), x: right ? x : edge - below, middle, end: middles.length ? tip : edge + to * (above + 6) };
}

/** A band of width t that comes down (sense 1) or up and turns aside, or comes from there: an arrow's head where it ends. */
function turned({ inner, t, from, near, sense, to, end, out, kind }) {
  const outer = inner + to * t;
  const far = near + sense * t;
  const sweep = sense * to > 0 ? 0 : 1;
  const tip = out ? end + to * HEAD : end - to * Math.min(HEAD, REACH);
  const middle = (near + far) / 2;
  const extra = out ? Math.min(3, t) * sense : 0;
  const start = near - sense * TURN;
  const d = [
    `M${round(inner)} ${round(from)}`, `L${round(inner)} ${round(start)}`,
    `A${round(t + TURN)} ${round(t + TURN)} 0 0 ${sweep} ${round(outer + to * TURN)} ${round(far)}`,
    `L${round(end)} ${round(far)}`, `L${round(end)} ${round(far + extra)}`, `L${round(tip)} ${round(middle)}`, `L${round(end)} ${round(near - extra)}`, `L${round(end)} ${round(near)}`,
    `L${round(outer + to * TURN)} ${round(near)}`, `A${TURN} ${TURN} 0 0 ${1 - sweep} ${round(outer)} ${round(start)}`,
    `L${round(outer)} ${round(from)}Z`,
  ].join("");
  return node("path", { d, fill: paint(COLOURS[kind]), "fill-opacity": kind === "train" ? 0.45 : 0.6, stroke: paint(COLOURS[kind]), "stroke-width": 0.75 });
}
