// Reactions in the joints: the tip of each force over the motion, or of a slide its normal force, and the driving action.

import { axis, csv, extent, figure, label, node, paint, path, round, scaled, valueAt, valuesAt, wide } from "./svg.js";
import { lineOf, note, setAll } from "./curves.js";
import { clear, driverOf, driverTicks, figureIn, placeOf } from "./panel.js";
import { jumpEnds, marksOf, nearest, planeCurve, planeMarks } from "./plane.js";

const CELL = 215; // px, about

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
    const { text, number } = tools;
    const data = answer.reactions;
    const driver = driverOf(answer, tools);
    const phi = answer.phi;
    const columns = Math.max(Math.floor((width + 12) / (CELL + 12)), 1);
    const size = (width - 12 * (columns - 1)) / columns;
    const tall = Math.min(0.86 * size, 230);
    const children = [];
    let y = note(children, text("What the first body of each joint does to the second."), width, 0);
    if (driver.sliding) y = note(children, text("Figures along the curves are positions of the driver in mm."), width, y);
    if (data.without_inertia) y = note(children, text("Without inertia forces, as no speed is given."), width, y);
    const cells = [];
    const jobs = [...data.joints.map((joint) => [joint, joint.normal ? curveCell : hodograph]), ...data.driving.map((drive) => [drive, drivingCell])];
    jobs.forEach(([part, draw], k) => {
      const place = { left: (k % columns) * (size + 12), top: y + Math.floor(k / columns) * (tall + 58), size, height: tall };
      const cell = draw(part, place, { answer, phi, driver, tools });
      children.push(...cell.children);
      cells.push({ ...cell, place });
    });
    const height = y + Math.ceil(jobs.length / columns) * (tall + 58);
    const largest = data.joints.map((joint) => `${headOf(joint, text)}: ${largestOf(joint, driver, tools)}`);
    return {
      title: text("Reactions in the joints"),
      about: largest.join("; "),
      height,
      children,
      point(x, yy) {
        const cell = cells.find(({ place }) => x >= place.left && x <= place.left + size && yy >= place.top && yy <= place.top + place.height + 58);
        return cell ? cell.point(x, yy) : null;
      },
      move: (at) => cells.forEach((cell) => cell.move(at)),
      csv: () => csv([
        { name: driver.name, unit: driver.si, values: phi },
        ...data.joints.flatMap((joint) => [["x", joint.x], ["y", joint.y], ...(joint.normal ? [["normal", joint.normal]] : [])].map(([name, values]) => ({ name: `${joint.name} ${name}`, unit: "N", values }))),
        ...data.driving.map((drive) => ({ name: `${drive.name} ${text("driving action")}`, unit: drive.unit, values: drive.values })),
      ]),
    };
  },
};

function headOf({ name, first, second }, text) {
  return first ? text("{joint}: {first} on {second}", { joint: name, first, second }) : name;
}

function largestOf({ largest }, driver, tools) {
  const { text, number } = tools;
  if (!largest) return text("not known: redundant constraints leave it open, or friction locks");
  const unit = scaled("N", largest.value);
  return text("at most {force} at {place}", { force: `${number(figure(largest.value * unit.factor))} ${unit.unit}`, place: placeOf(driver, largest.at, tools) });
}

/** The head of a cell: whose force it is, its largest value, and the value at the cursor. */
function head(words, about, { left, top, size }) {
  const cut = (line, width) => {
    while (line.length > 4 && wide(line) > width) line = `${line.slice(0, -2).trimEnd()}…`;
    return line;
  };
  const value = label(left + 2, top + 42, "", {});
  return { nodes: [label(left + 2, top + 12, cut(words, size - 6), { bold: true }), label(left + 2, top + 27, cut(about, size - 6), { colour: "muted" })], value };
}

// -- hodographs -------------------------------------------------------------------------------------------------------

function hodograph(joint, place, { phi, driver, tools }) {
  const { left, top, size, height } = place;
  const { number, text } = tools;
  const begin = head(headOf(joint, text), largestOf(joint, driver, tools), place);
  const children = begin.nodes;
  const [x0, y0, x1, y1] = [left + 1, top + 48, left + size - 1, top + 48 + height];
  children.push(node("rect", { x: round(x0), y: round(y0), width: round(x1 - x0), height: round(y1 - y0), fill: "none", stroke: paint("edge") }));
  if (!joint.largest) return { children, move: () => {}, point: () => null };
  const unit = scaled("N", joint.largest.value);
  const [a, b] = extent(joint.x, [0]);
  const [c, d] = extent(joint.y, [0]);
  const inner = 26;
  const scale = Math.min((x1 - x0 - 2 * inner) / Math.max(b - a, 1e-12 * joint.largest.value, 1e-300), (y1 - y0 - 2 * inner) / Math.max(d - c, 1e-12 * joint.largest.value, 1e-300));
  const kept = Math.min(scale, (0.5 * Math.min(x1 - x0, y1 - y0)) / (0.25 * joint.largest.value || 1));
  const X = (value) => (x0 + x1) / 2 + (value - (a + b) / 2) * kept;
  const Y = (value) => (y0 + y1) / 2 - (value - (c + d) / 2) * kept;
  const free = clear();
  free.block(X(0) - 4, Y(0) - 4, 8, 8);
  children.push(...cross(X, Y, [x0, y0, x1, y1], unit, kept, number, free));
  const xs = joint.x.map((value) => (value === null ? null : X(value)));
  const ys = joint.y.map((value) => (value === null ? null : Y(value)));
  children.push(...planeCurve(phi, xs, ys, y1 - y0, driver.cyclic));
  const spot = (at) => {
    const [x, y] = [valueAt(phi, joint.x, at, false), valueAt(phi, joint.y, at, false)];
    return x === null || y === null ? null : [X(x), Y(y)];
  };
  children.push(...planeMarks(marksOf(driver), spot, driver, free, number, { bounds: [x0, y0, x1, y1], ends: jumpEnds(phi, xs, ys, y1 - y0, driver.cyclic) }));
  const arrow = node("path", { fill: "none", stroke: paint("vermillion"), "stroke-width": 2, visibility: "hidden" });
  children.push(arrow, begin.value);
  return {
    children,
    point: (x, y) => nearest(phi, xs, ys, x, y, 60),
    move(at) {
      const tip = spot(at);
      const found = [valueAt(phi, joint.x, at, driver.cyclic), valueAt(phi, joint.y, at, driver.cyclic)];
      begin.value.textContent = `${driver.symbol} = ${placeOf(driver, at, tools)}: ${tip ? `${number(figure(Math.hypot(...found) * unit.factor))} ${unit.unit}` : "–"}`;
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

function curveCell(joint, place, shared) {
  const { text } = shared.tools;
  const words = headOf(joint, text);
  return overDriver(words, largestOf(joint, shared.driver, shared.tools), joint.normal, "N", text("normal force"), "blue", place, shared);
}

function drivingCell(drive, place, shared) {
  const { text, number } = shared.tools;
  const unit = scaled(drive.unit, Math.max(Math.abs(drive.least?.value ?? 0), Math.abs(drive.greatest?.value ?? 0)));
  const told = [drive.least, drive.greatest].map((each) => (each ? number(figure(each.value * unit.factor)) : "–")).join(" … ");
  return overDriver(text("{joint}: driving action", { joint: drive.name }), `${told} ${unit.unit}`, drive.values, drive.unit, "", "green", place, shared);
}

function overDriver(words, about, values, si, name, colour, place, { phi, driver, tools }) {
  const { left, top, size, height } = place;
  const begin = head(words, about, place);
  const children = begin.nodes;
  const [least, most] = extent(values, [0]);
  const unit = scaled(si, Math.max(Math.abs(least), Math.abs(most)));
  const [y0, y1] = [top + 48, top + 48 + height - 16];
  const room = 0.08 * (most - least);
  const scale = axis((least - room) * unit.factor, (most + room) * unit.factor, y1, y0, { every: 34, number: tools.number });
  const x0 = left + Math.min(Math.max(...scale.ticks.map((tick) => wide(tick.words, 10))) + 8, 0.3 * size);
  const x1 = left + size - 2;
  const X = (at) => x0 + ((at - driver.least) / (driver.greatest - driver.least)) * (x1 - x0);
  const Y = (value) => scale.at(value * unit.factor);
  for (const tick of scale.ticks) {
    children.push(node("line", { x1: round(x0), x2: round(x1), y1: round(tick.at), y2: round(tick.at), stroke: paint("grid") }));
    children.push(label(x0 - 4, tick.at + 4, tick.words, { anchor: "end", colour: "muted", size: 10 }));
  }
  for (const at of driverTicks(driver, x1 - x0)) {
    const told = tools.number(String(Number((at * driver.factor).toFixed(6))).replace("-", "−"));
    const half = wide(told, 10) / 2;
    children.push(node("line", { x1: round(X(at)), x2: round(X(at)), y1: round(y0), y2: round(y1), stroke: paint("grid") }));
    children.push(label(Math.min(Math.max(X(at), left + half), x1 - half + 2), y1 + 12, told, { anchor: "middle", colour: "muted", size: 10 }));
  }
  children.push(node("line", { x1: round(x0), x2: round(x1), y1: round(Y(0)), y2: round(Y(0)), stroke: paint("ink") }));
  children.push(lineOf(path(phi.map(X), values.map((value) => (value === null ? null : Y(value)))), { colour }));
  children.push(node("rect", { x: round(x0), y: round(y0), width: round(x1 - x0), height: round(y1 - y0), fill: "none", stroke: paint("edge") }));
  children.push(label(x0 + 4, y0 + 12, `${name ? `${name}, ` : ""}${unit.unit}`, { colour: "muted", size: 10, halo: true }));
  const line = node("line", { y1: round(y0), y2: round(y1), stroke: paint("ink"), "stroke-dasharray": "4 3" });
  const dot = node("circle", { r: 3.5, fill: paint(colour), stroke: paint("paper") });
  children.push(line, dot, begin.value);
  return {
    children,
    point: (x) => Math.min(Math.max(driver.least + ((x - x0) / (x1 - x0)) * (driver.greatest - driver.least), driver.least), driver.greatest),
    move(at) {
      const found = valuesAt(phi, values, at, driver.cyclic);
      const value = found[found.length - 1];
      begin.value.textContent = `${driver.symbol} = ${placeOf(driver, at, tools)}: ${found.map((each) => tools.number(figure(each === null ? null : each * unit.factor))).join(" → ")} ${unit.unit}`;
      setAll(line, { x1: round(X(at)), x2: round(X(at)) });
      setAll(dot, value === null ? { visibility: "hidden" } : { cx: round(X(at)), cy: round(Y(value)), visibility: "visible" });
    },
  };
}
