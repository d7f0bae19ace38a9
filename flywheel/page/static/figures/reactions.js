// Reactions in the joints: the tip of each force over the motion, or of a slide its normal force, and the driving action.

import { axis, csv, extent, figure, label, node, paint, round, valueAt, valuesAt, wide } from "./svg.js";
import { DASHES, note, setAll, valuesOf } from "./curves.js";
import { clear, driverOf, driverTicks, figureIn, placeOf } from "./panel.js";
import { breakPairs, nearest, planeCurve, planeMarks } from "./plane.js";

const CELL = 200; // px, about

/** The reactions in their place; of several mechanisms one is chosen, which the page is told by a "view" event. */
export function reactionsIn(host, answer, tools) {
  const { text } = tools;
  const select = document.createElement("select");
  const choice = document.createElement("label");
  const place = document.createElement("div");
  choice.append(`${text("Mechanism")} `, select);
  host.replaceChildren(choice, place);
  select.addEventListener("change", () => host.dispatchEvent(new CustomEvent("view", { bubbles: true, detail: { mechanism: select.value } })));
  function choices({ mechanism, mechanisms }) {
    choice.hidden = mechanisms.length < 2;
    if (select.options.length !== mechanisms.length || mechanisms.some((name, k) => select.options[k].value !== name)) {
      select.replaceChildren(...mechanisms.map((name) => new Option(name, name)));
    }
    select.value = mechanism;
  }
  choices(answer.reactions);
  const figure = figureIn(place, answer, tools, reactions);
  return {
    ...figure,
    update(next) {
      choices(next.reactions);
      figure.update(next);
    },
  };
}

const reactions = {
  draw(answer, width, tools) {
    const data = answer.reactions;
    const { title, about, remarks, rows } = data.diagram;
    const driver = driverOf(answer, tools);
    const phi = answer.phi;
    const columns = Math.max(Math.floor((width + 12) / (CELL + 12)), 1);
    const size = (width - 12 * (columns - 1)) / columns;
    const tall = Math.min(0.86 * size, 230);
    const children = [];
    let y = 0;
    for (const words of remarks) y = note(children, words, width, y);
    const cells = rows.map((row, k) => {
      const place = { left: (k % columns) * (size + 12), top: y + Math.floor(k / columns) * (tall + 58), size, height: tall };
      const curves = row.curves.map((curve) => ({ ...curve, values: valuesOf(data, curve.of), dash: DASHES[curve.dash] }));
      const begin = head(row, place);
      const cell = curves.length ? (row.kind === "plane" ? hodograph : overDriver)({ ...row, curves }, begin, place, { phi, driver, tools }) : empty(begin, place);
      children.push(...cell.children);
      return { ...cell, place };
    });
    return {
      title,
      about,
      height: y + Math.ceil(rows.length / columns) * (tall + 58),
      children,
      point(x, yy) {
        const cell = cells.find(({ place }) => x >= place.left && x <= place.left + size && yy >= place.top && yy <= place.top + place.height + 58);
        return cell ? cell.point(x, yy) : null;
      },
      move: (at) => cells.forEach((cell) => cell.move(at)),
      csv: () => csv([
        { name: driver.name, unit: driver.si, values: phi },
        ...rows.flatMap((row) => row.curves.map((curve) => ({ name: `${row.title.split(":")[0]} ${curve.name}`, unit: row.si, values: valuesOf(data, curve.of) }))),
      ]),
    };
  },
};

/** The head of a cell: whose force it is, its largest value, and the value at the cursor. */
function head({ title, about }, { left, top, size }) {
  const cut = (line, width, bold = false) => {
    while (line.length > 4 && wide(line, undefined, bold) > width) line = `${line.slice(0, -2).trimEnd()}…`;
    return line;
  };
  const value = label(left + 2, top + 42, "", {});
  return { nodes: [label(left + 2, top + 12, cut(title, size - 6, true), { bold: true }), label(left + 2, top + 27, cut(about, size - 6), { colour: "muted" })], value };
}

function empty({ nodes }, { left, top, size, height }) {
  const frame = node("rect", { x: round(left + 1), y: round(top + 48), width: round(size - 2), height: round(height), fill: "none", stroke: paint("edge") });
  return { children: [...nodes, frame], move: () => {}, point: () => null };
}

// -- hodographs -------------------------------------------------------------------------------------------------------

function hodograph(row, begin, place, { phi, driver, tools }) {
  const { left, top, size, height } = place;
  const { number } = tools;
  const children = begin.nodes;
  const [forceX, forceY] = row.curves.map(({ values }) => values);
  const [x0, y0, x1, y1] = [left + 1, top + 48, left + size - 1, top + 48 + height];
  children.push(node("rect", { x: round(x0), y: round(y0), width: round(x1 - x0), height: round(y1 - y0), fill: "none", stroke: paint("edge") }));
  const [a, b] = extent(forceX, [0]);
  const [c, d] = extent(forceY, [0]);
  const inner = 26;
  const largest = Math.max(-a, b, -c, d);
  const scale = Math.min((x1 - x0 - 2 * inner) / Math.max(b - a, 1e-12 * largest, 1e-300), (y1 - y0 - 2 * inner) / Math.max(d - c, 1e-12 * largest, 1e-300));
  const kept = Math.min(scale, (0.5 * Math.min(x1 - x0, y1 - y0)) / (0.25 * largest || 1));
  const X = (value) => (x0 + x1) / 2 + (value - (a + b) / 2) * kept;
  const Y = (value) => (y0 + y1) / 2 - (value - (c + d) / 2) * kept;
  const free = clear();
  free.block(X(0) - 4, Y(0) - 4, 8, 8);
  children.push(...cross(X, Y, [x0, y0, x1, y1], row, kept, number, free));
  const xs = forceX.map((value) => (value === null ? null : X(value)));
  const ys = forceY.map((value) => (value === null ? null : Y(value)));
  const pairs = breakPairs(row.breaks, phi.length);
  children.push(...planeCurve(xs, ys, pairs));
  const spot = (at) => {
    const [x, y] = [valueAt(phi, forceX, at, false), valueAt(phi, forceY, at, false)];
    return x === null || y === null ? null : [X(x), Y(y)];
  };
  children.push(...planeMarks(row.along, spot, driver, free, number, { bounds: [x0, y0, x1, y1], ends: pairs.flat().map((k) => ({ spot: [xs[k], ys[k]], position: phi[k] })) }));
  const arrow = node("path", { fill: "none", stroke: paint("vermillion"), "stroke-width": 2, visibility: "hidden" });
  children.push(arrow, begin.value);
  return {
    children,
    point: (x, y) => nearest(phi, xs, ys, x, y, 60),
    move(at) {
      const tip = spot(at);
      const force = [forceX, forceY].map((values) => valueAt(phi, values, at, driver.cyclic));
      begin.value.textContent = `${driver.symbol} = ${placeOf(driver, at, tools)}: ${tip ? `${number(figure(Math.hypot(...force) * row.factor))} ${row.unit}` : "–"}`;
      setAll(arrow, tip ? { d: arrowTo([X(0), Y(0)], tip), visibility: "visible" } : { visibility: "hidden" });
    },
  };
}

/** The axes through the origin of forces, with a scale. */
function cross(X, Y, [x0, y0, x1, y1], unit, kept, number, free) {
  const drawn = [];
  const rough = 60 / kept;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const bar = [1, 2, 5, 10].map((part) => part * ten).filter((part) => part * kept < 0.45 * (x1 - x0)).pop() ?? ten;
  if (Y(0) >= y0 && Y(0) <= y1) drawn.push(node("line", { x1: round(x0), x2: round(x1), y1: round(Y(0)), y2: round(Y(0)), stroke: paint("grid"), "stroke-width": 1.4 }));
  if (X(0) >= x0 && X(0) <= x1) drawn.push(node("line", { x1: round(X(0)), x2: round(X(0)), y1: round(y0), y2: round(y1), stroke: paint("grid"), "stroke-width": 1.4 }));
  drawn.push(node("path", { d: `M${round(x0 + 8)} ${round(y1 - 12)}v4h${round(bar * kept)}v-4`, fill: "none", stroke: paint("ink") }));
  const put = (x, y, words, anchor) => {
    const w = wide(words, 10);
    drawn.push(label(x, y, words, { anchor, colour: "muted", size: 10 }));
    free.block(anchor === "end" ? x - w - 2 : x - 2, y - 11, w + 4, 14);
  };
  free.block(x0 + 6, y1 - 14, bar * kept + 4, 10);
  put(x0 + 12 + bar * kept, y1 - 6, `${number(figure(bar * unit.factor, 2))} ${unit.unit}`, "start");
  put(x1 - 4, Math.min(Math.max(Y(0) - 4, y0 + 10), y1 - 4), "x", "end");
  put(Math.min(Math.max(X(0) + 4, x0 + 4), x1 - 10), y0 + 10, "y", "start");
  drawn.push(node("circle", { cx: round(X(0)), cy: round(Y(0)), r: 2, fill: paint("ink") }));
  return drawn;
}

function arrowTo([ax, ay], [bx, by]) {
  const length = Math.hypot(bx - ax, by - ay);
  if (length < 2) return `M${round(ax)} ${round(ay)}`;
  const angle = Math.atan2(by - ay, bx - ax);
  const barb = (turn) => `${round(bx - 8 * Math.cos(angle + turn))} ${round(by - 8 * Math.sin(angle + turn))}`;
  return `M${round(ax)} ${round(ay)}L${round(bx)} ${round(by)}M${barb(0.4)}L${round(bx)} ${round(by)}L${barb(-0.4)}`;
}

// -- over the driver --------------------------------------------------------------------------------------------------

function overDriver(row, begin, place, { phi, driver, tools }) {
  const { left, top, size, height } = place;
  const children = begin.nodes;
  const [least, most] = extent(...row.curves.map(({ values }) => values), [0]);
  const [y0, y1] = [top + 48, top + 48 + height - 16];
  const room = 0.08 * (most - least);
  const scale = axis((least - room) * row.factor, (most + room) * row.factor, y1, y0, { every: 34, number: tools.number });
  const x0 = left + Math.min(Math.max(...scale.ticks.map((tick) => wide(tick.words, 10))) + 8, 0.3 * size);
  const x1 = left + size - 2;
  const X = (at) => x0 + ((at - driver.least) / (driver.greatest - driver.least)) * (x1 - x0);
  const Y = (value) => scale.at(value * row.factor);
  for (const tick of scale.ticks) {
    children.push(node("line", { x1: round(x0), x2: round(x1), y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
    children.push(label(x0 - 4, tick.at + 4, tick.words, { anchor: "end", colour: "muted", size: 10 }));
  }
  for (const at of driverTicks(driver, x1 - x0)) {
    const numeral = tools.number(String(Number((at * driver.factor).toFixed(6))).replace("-", "−"));
    const half = wide(numeral, 10) / 2;
    children.push(node("line", { x1: round(X(at)), x2: round(X(at)), y1: round(y0), y2: round(y1), stroke: paint("grid") }));
    children.push(label(Math.min(Math.max(X(at), left + half), x1 - half + 2), y1 + 12, numeral, { anchor: "middle", colour: "muted", size: 10 }));
  }
  children.push(node("line", { x1: round(x0), x2: round(x1), y1: round(Y(0)), y2: round(Y(0)), stroke: paint("ink") }));
  for (const curve of row.curves) {
    const ys = curve.values.map((value) => (value === null ? null : Y(value)));
    children.push(...planeCurve(phi.map(X), ys, breakPairs(row.breaks, phi.length), { colour: curve.colour, dash: curve.dash, open: false }));
  }
  children.push(node("rect", { x: round(x0), y: round(y0), width: round(x1 - x0), height: round(y1 - y0), fill: "none", stroke: paint("edge") }));
  children.push(label(x0 + 4, y0 + 12, `${row.label}, ${row.unit}`, { colour: "muted", size: 10, halo: true }));
  const line = node("line", { y1: round(y0), y2: round(y1), stroke: paint("ink"), "stroke-dasharray": "4 3" });
  const dots = row.curves.map(({ colour }) => node("circle", { r: 3.5, fill: paint(colour), stroke: paint("paper") }));
  children.push(line, ...dots, begin.value);
  return {
    children,
    point: (x) => Math.min(Math.max(driver.least + ((x - x0) / (x1 - x0)) * (driver.greatest - driver.least), driver.least), driver.greatest),
    move(at) {
      const sides = row.curves.map(({ values }) => valuesAt(phi, values, at, driver.cyclic));
      const words = sides.map((each) => each.map((value) => tools.number(figure(value === null ? null : value * row.factor))).join(" → "));
      begin.value.textContent = `${driver.symbol} = ${placeOf(driver, at, tools)}: ${words.join("; ")} ${row.unit}`;
      setAll(line, { x1: round(X(at)), x2: round(X(at)) });
      sides.forEach((each, k) => {
        const value = each[each.length - 1];
        setAll(dots[k], value === null ? { visibility: "hidden" } : { cx: round(X(at)), cy: round(Y(value)), visibility: "visible" });
      });
    },
  };
}
