// What every figure is: an SVG as wide as its place, drawn anew for another answer or another width, with a cursor.

import { FONT, SMALL, figure, label, node, paint, round, standalone, wide } from "./svg.js";

const WIDTH = 480; // px, until the place is known
let count = 0;

/** A figure in `host`. `kind` has `draw(answer, width, tools)` -> {height, children, move, csv, title, about, point}. */
export function figureIn(host, answer, tools, kind) {
  const name = `figure-${++count}`;
  const svg = node("svg", { role: "img", "aria-labelledby": `${name}-title ${name}-about`, "font-family": "inherit" });
  const state = { answer, width: widthOf(host), at: answer.phi[0] ?? 0, made: null };
  host.replaceChildren(svg);

  function draw() {
    const made = kind.draw(state.answer, Math.max(state.width, 240), tools);
    state.made = made;
    svg.setAttribute("viewBox", `0 0 ${Math.max(state.width, 240)} ${Math.ceil(made.height)}`);
    svg.replaceChildren(
      node("title", { id: `${name}-title` }, made.title),
      node("desc", { id: `${name}-about` }, made.about),
      ...made.children,
    );
    made.move?.(state.at);
  }

  function tell(event) {
    if (!state.made.point) return;
    const box = svg.getBoundingClientRect();
    const scale = Math.max(state.width, 240) / box.width;
    const phi = state.made.point((event.clientX - box.left) * scale, (event.clientY - box.top) * scale);
    if (phi !== null && phi !== undefined) host.dispatchEvent(new CustomEvent("cursor", { bubbles: true, detail: { phi } }));
  }

  svg.style.touchAction = "pan-y";
  svg.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    svg.setPointerCapture(event.pointerId);
    tell(event);
  });
  svg.addEventListener("pointermove", (event) => {
    if (svg.hasPointerCapture(event.pointerId)) tell(event);
  });
  const fit = followWidth(host, state, draw);
  draw();
  return {
    fit,
    move(phi) {
      state.at = phi;
      state.made.move?.(phi);
    },
    update(next) {
      state.answer = next;
      draw();
    },
    svg: () => standalone(svg),
    csv: () => state.made.csv(),
  };
}

/** Draw anew whenever the place of a figure has another width, which `state` has; returns how to have another drawn. */
export function followWidth(host, state, draw) {
  const fit = (width) => {
    if (width < 1 || width === state.width) return;
    state.width = width;
    draw();
  };
  new ResizeObserver(([entry]) => fit(Math.floor(entry.contentRect.width))).observe(host);
  return (width) => fit(width ?? widthOf(host));
}

/** The width within a figure's place, px. */
export function widthOf(host) {
  const style = getComputedStyle(host);
  return Math.floor(host.clientWidth - Number.parseFloat(style.paddingLeft) - Number.parseFloat(style.paddingRight)) || WIDTH;
}

// -- the driver's coordinate ------------------------------------------------------------------------------------------

/** How positions of the driver are told: in degrees, in mm where it slides; stroke by stroke times are told. */
export function driverOf(answer, { text }) {
  const { kind, stroke } = answer.driver;
  const kinds = {
    angle: { unit: "°", sign: "°", factor: 180 / Math.PI, symbol: "φ", name: text("crank angle"), si: "rad" },
    length: { unit: "mm", sign: " mm", factor: 1000, symbol: "x", name: text("position of the driver"), si: "m" },
    time: { unit: "s", sign: " s", factor: 1, symbol: "t", name: text("time"), si: "s" },
  };
  return {
    ...kinds[kind],
    cyclic: !stroke,
    turns: kind === "angle",
    least: answer.driver.from,
    greatest: answer.driver.to,
  };
}

/** A position of the driver in words. */
export function placeOf(driver, at, { number }, places = driver.si === "s" ? 3 : 1) {
  const value = (at * driver.factor).toFixed(places).replace("-", "−");
  return `${number(value)}${driver.sign}`;
}

/** Positions (SI) at which an axis of the driver has ticks: whole parts of a turn, or round numbers of mm. */
export function driverTicks(driver, width) {
  const least = driver.least * driver.factor;
  const span = (driver.greatest - driver.least) * driver.factor;
  const most = Math.max(Math.floor(width / 46), 2);
  const ten = 10 ** Math.floor(Math.log10(span / most));
  const steps = !driver.turns || span < 30 ? [1, 2, 5, 10, 20].map((part) => part * ten) : [5, 10, 15, 30, 45, 60, 90, 180, 360, 720, 1440, 2880, 5760];
  const step = steps.find((each) => span / each <= most) ?? steps[steps.length - 1];
  const ticks = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= least + span * (1 + 1e-9); k++) ticks.push((k * step) / driver.factor);
  return ticks;
}

// -- legend -----------------------------------------------------------------------------------------------------------

const LONGEST = "−0.0000000"; // of four significant digits

/** A legend whose entries tell the values at the cursor: {name, colour, dash, fill, unit, width}. Returns its nodes and `tell`. */
export function legendOf(entries, width, top, { number }) {
  const nodes = [];
  const values = [];
  let x = 4;
  let y = top + FONT;
  for (const entry of entries) {
    const value = entry.unit === undefined ? 0 : wide(`${entry.jumps ? `${LONGEST} → ` : ""}${LONGEST} ${entry.unit}`, SMALL, true);
    const room = entry.swatchless ? 0 : 24;
    const needed = room + wide(entry.name) + 6 + value + 14;
    if (x > 4 && x + needed - 10 > width) {
      x = 4;
      y += 17;
    }
    if (room) nodes.push(swatch(entry, x, y));
    nodes.push(label(x + room, y, entry.name));
    const below = x === 4 && needed - 14 > width;
    if (below) y += 15;
    const reading = label(below ? x + room : x + room + wide(entry.name) + 6, y, "", { bold: true });
    nodes.push(reading);
    values.push(reading);
    x += below ? width : needed;
  }
  function tell(k, readings, factor) {
    const unit = entries[k].unit;
    const words = readings.map((value) => number(figure(value === null ? null : value * factor))).join(" → ");
    values[k].textContent = unit ? `${words} ${unit}` : words;
  }
  return { nodes, tell, height: y - top + 8 };
}

function swatch({ colour, dash, fill, hatch, line = 2, mark }, x, y) {
  if (mark) return node("path", { d: mark(x + 9, y - 4), fill: paint(colour) });
  if (fill) {
    return node("g", {},
      node("rect", { x: round(x), y: y - 9, width: 18, height: 10, fill: paint(colour), "fill-opacity": fill }),
      hatch ? node("path", { d: hatch(x, y - 9, 18, 10), stroke: paint(colour), "stroke-width": 1, fill: "none" }) : null);
  }
  return node("line", { x1: round(x), x2: round(x + 18), y1: y - 4, y2: y - 4, stroke: paint(colour), "stroke-width": line, "stroke-dasharray": dash });
}

/** Triangles for the greatest and the least value. */
export const up = (x, y) => `M${round(x)} ${round(y - 6)}l5 9h-10z`;
export const down = (x, y) => `M${round(x)} ${round(y + 6)}l5 -9h-10z`;

/** Places for texts that keep clear of one another: the first free one of some is taken, or none. */
export function clear() {
  const taken = [];
  return {
    block(x, y, w, h) {
      taken.push([x, y, x + w, y + h]);
    },
    free(x, y, w, h) {
      return !taken.some(([a, b, c, d]) => x < c && a < x + w && y < d && b < y + h);
    },
    take(places, w, h) {
      const spot = places.find(([x, y]) => this.free(x, y, w, h));
      if (spot) this.block(spot[0], spot[1], w, h);
      return spot ?? null;
    },
  };
}

// -- bodies -----------------------------------------------------------------------------------------------------------

const BODY_COLOURS = ["sky", "orange", "green", "purple", "vermillion", "yellow", "blue", "muted"];

/** The bodies of an answer's mechanisms. */
export function bodiesOf(answer) {
  return (answer.mechanism?.views ?? []).flatMap((view) => Object.keys(view.bodies).map((body) => `${view.name}.${body}`));
}

/** A body's colour, the same in all figures; `bodies` are those of an earlier answer where this one has no mechanism. */
export function coloursOf(answer) {
  const names = answer.bodies ?? bodiesOf(answer);
  return (name, k) => {
    const plain = name.replace(/ .*$/, "");
    const exact = names.indexOf(plain);
    const place = exact < 0 ? names.findIndex((each) => each.endsWith(`.${plain}`)) : exact;
    return BODY_COLOURS[(place < 0 ? k : place) % BODY_COLOURS.length];
  };
}
