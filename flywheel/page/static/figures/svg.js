// SVG elements, colours, numbers and scales that all figures share. Texts go in as text, never as markup.

const NS = "http://www.w3.org/2000/svg";

/** Colours by name on white paper; on the page its style sheet has its own by the same names. */
const PAPER = {
  ink: "#1b1e22", muted: "#565c64", paper: "#ffffff", grid: "#e2e4e2", edge: "#84898f",
  blue: "#0067a5", vermillion: "#b54700", green: "#00735a", purple: "#9c4076", orange: "#8a5f00", sky: "#1f78ae", yellow: "#736900",
};

export const FONT = 12; // px
export const SMALL = 11;

/** A colour of the page by its name. */
export function paint(name) {
  return `var(--${name}, ${PAPER[name]})`;
}

/** An SVG element with attributes and children (elements or texts; null is left out). */
export function node(name, attributes = {}, ...children) {
  const made = document.createElementNS(NS, name);
  for (const key in attributes) {
    const value = attributes[key];
    if (value !== null && value !== undefined) made.setAttribute(key, value);
  }
  for (const child of children) if (child !== null && child !== undefined) made.append(child);
  return made;
}

/** A text; `anchor` is start, middle or end. With `halo` the paper shows around it, over curves. */
export function label(x, y, content, { anchor = "start", colour = "ink", size = SMALL, bold = false, halo = false } = {}) {
  const attributes = { x: round(x), y: round(y), fill: paint(colour), "font-size": size, "text-anchor": anchor };
  if (bold) attributes["font-weight"] = "bold";
  if (halo) Object.assign(attributes, { stroke: paint("paper"), "stroke-width": 3, "paint-order": "stroke", "stroke-linejoin": "round" });
  return node("text", attributes, content);
}

export function round(value) {
  return Math.round(value * 10) / 10;
}

const measure = document.createElement("canvas").getContext("2d");
const widths = new Map();

/** About how wide a text is, px. */
export function wide(content, size = SMALL, bold = false) {
  const key = `${bold} ${content}`;
  let width = widths.get(key);
  if (width === undefined) {
    if (widths.size > 4000) widths.clear();
    measure.font = `${bold ? "bold " : ""}100px system-ui, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif`;
    width = measure.measureText(content).width / 100;
    widths.set(key, width);
  }
  return width * size * 1.03;
}

/** The data of a path through points; a point that is null, or whose place is in `gaps`, begins a new stroke. */
export function path(xs, ys, gaps = null) {
  let data = "";
  let pen = "M";
  for (let k = 0; k < xs.length; k++) {
    const x = xs[k];
    const y = ys[k];
    if (x === null || y === null || x !== x || y !== y) {
      pen = "M";
      continue;
    }
    if (gaps !== null && gaps.has(k)) pen = "M";
    data += pen + Math.round(x * 10) / 10 + " " + Math.round(y * 10) / 10;
    pen = "L";
  }
  return data;
}

// -- numbers ----------------------------------------------------------------------------------------------------------

/** A number to so many significant digits, with a true minus; powers of ten where it is very large or small. */
export function figure(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  let written;
  if (size >= 1e7 || size < 1e-4) {
    const [mantissa, power] = value.toExponential(digits - 1).split("e");
    written = `${mantissa}·10${superscript(Number(power))}`;
  } else {
    const places = Math.max(digits - 1 - Math.floor(Math.log10(size)), 0);
    written = value.toFixed(Math.min(places, 12));
    if (written.includes(".")) written = written.replace(/\.?0+$/, "");
  }
  return written.replace("-", "−");
}

function superscript(power) {
  return [...String(power)].map((digit) => (digit === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit])).join("");
}

/** The unit in which values up to `largest` (SI) are told, and what they are multiplied by. */
export function scaled(unit, largest) {
  if (unit === "rad") return { unit: "°", factor: 180 / Math.PI };
  if (/^(m|m\/rad|m\/rad²|m\/s)$/.test(unit) && largest < 1 && largest > 0) return { unit: `m${unit}`, factor: 1000 };
  if (/^(N|N m|J|W)$/.test(unit)) {
    if (largest >= 1e6) return { unit: `M${unit}`, factor: 1e-6 };
    if (largest >= 1e4) return { unit: `k${unit}`, factor: 1e-3 };
  }
  if (unit === "kg m²" && largest < 1e-2 && largest > 0) return { unit: "kg cm²", factor: 1e4 };
  return { unit, factor: 1 };
}

/** The least and greatest of several lists, without what is null. */
export function extent(...lists) {
  let least = Infinity;
  let greatest = -Infinity;
  for (const list of lists) {
    for (const value of list) {
      if (value === null || value !== value) continue;
      if (value < least) least = value;
      if (value > greatest) greatest = value;
    }
  }
  return least <= greatest ? [least, greatest] : [0, 1];
}

/** An axis of numbers from `least` to `greatest` along pixels from `from` to `to`, with its ticks. */
export function axis(least, greatest, from, to, { every = 44, number = (written) => written } = {}) {
  const size = Math.max(Math.abs(least), Math.abs(greatest));
  if (!(greatest - least > 1e-13 * size)) {
    const room = 0.5 * size || 1;
    [least, greatest] = [least - room, greatest + room];
  }
  const span = greatest - least;
  const count = Math.max(Math.floor(Math.abs(to - from) / every), 1);
  const rough = span / count;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((part) => part * ten).find((part) => part >= rough * 0.999) ?? 10 * ten;
  const places = Math.max(-Math.floor(Math.log10(step) + 1e-9), 0);
  const far = Math.log10(size / step) > 5; // too many digits: counted from a round number in the middle
  const origin = far ? Math.round((least + greatest) / 2 / step) * step : 0;
  const at = (value) => from + ((value - least) / span) * (to - from);
  const ticks = [];
  for (let k = Math.ceil((least - origin) / step - 1e-6); origin + k * step <= greatest + 1e-6 * step; k++) {
    ticks.push({ at: at(origin + k * step), words: number(tick(k * step, places, step)) });
  }
  return { at, back: (pixel) => least + ((pixel - from) / (to - from)) * span, ticks, origin, least, greatest };
}

function tick(value, places, step) {
  if (Math.abs(value) < step * 1e-6) return "0";
  if (Math.abs(value) >= 1e6 || places > 6) return figure(value, 3);
  return value.toFixed(places).replace("-", "−");
}

// -- values at the cursor ---------------------------------------------------------------------------------------------

const NOTHING = 1e-7; // of a curve's largest value: less is rounding, or the instant after a jump
const SAME = 2e-6; // of the axis: nearer positions are one

const sizes = new WeakMap(); // of a curve: its largest value

function sizeOf(values) {
  let greatest = sizes.get(values);
  if (greatest === undefined) {
    greatest = 0;
    for (const value of values) if (Math.abs(value) > greatest) greatest = Math.abs(value);
    sizes.set(values, greatest);
  }
  return greatest;
}

/** Values of a curve at a position: one, between samples on the line that is drawn; or the two at a jump. Rounding is 0. */
export function valuesAt(phi, values, at, cyclic) {
  const least = NOTHING * sizeOf(values);
  return between(phi, values, at, cyclic).map((value) => (value !== null && Math.abs(value) < least ? 0 : value));
}

function between(phi, values, at, cyclic) {
  const last = phi.length - 1;
  const near = SAME * (phi[last] - phi[0]);
  if (cyclic && (at - phi[0] < near || phi[last] - at < near)) return apart(values[last], values[0], values);
  let low = 0;
  let high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (phi[middle] <= at) low = middle;
    else high = middle;
  }
  if (phi[low] === phi[low - 1] && at - phi[low] < near) return apart(values[low - 1], values[low], values);
  if (phi[high] === phi[high + 1] && phi[high] - at < near) return apart(values[high], values[high + 1], values);
  const [a, b] = [values[low], values[high]];
  if (a === null || b === null) return [null];
  const share = phi[high] > phi[low] ? Math.min(Math.max((at - phi[low]) / (phi[high] - phi[low]), 0), 1) : 0;
  return [a + share * (b - a)];
}

function apart(before, after, values) {
  if (before === null || after === null) return [before ?? after];
  return Math.abs(before - after) > 1e-5 * sizeOf(values) ? [before, after] : [after];
}

/** One value between samples, of the side behind a jump. */
export function valueAt(phi, values, at, cyclic) {
  const sides = valuesAt(phi, values, at, cyclic);
  return sides[sides.length - 1];
}

// -- files ------------------------------------------------------------------------------------------------------------

/** A copy of a drawing that stands alone: colours as on white paper, nothing that the page's style sheet must tell. */
export function standalone(svg) {
  const copy = svg.cloneNode(true);
  const plain = (value) => value.replace(/var\(--(\w+), (#\w+)\)/g, "$2");
  for (const part of [copy, ...copy.querySelectorAll("*")]) {
    for (const { name, value } of [...part.attributes]) {
      if (name === "style" || name === "class") part.removeAttribute(name);
      else if (value.includes("var(")) part.setAttribute(name, plain(value));
    }
  }
  const [, , width, height] = copy.getAttribute("viewBox").split(" ");
  copy.setAttribute("xmlns", NS);
  copy.setAttribute("width", width);
  copy.setAttribute("height", height);
  copy.setAttribute("font-family", "system-ui, 'Segoe UI', Roboto, 'Noto Sans', 'DejaVu Sans', sans-serif");
  const first = [...copy.children].find((child) => !["title", "desc"].includes(child.localName)) ?? null;
  copy.insertBefore(node("rect", { width, height, fill: PAPER.paper }), first);
  return copy;
}

/** Columns of numbers as CSV: a header with units, all digits, nothing where there is no number. */
export function csv(columns) {
  const rows = Math.max(...columns.map((column) => column.values.length));
  const lines = [columns.map((column) => quoted(column.unit ? `${column.name} [${column.unit}]` : column.name)).join(",")];
  for (let k = 0; k < rows; k++) lines.push(columns.map((column) => quoted(column.values[k] ?? "")).join(","));
  return `${lines.join("\r\n")}\r\n`;
}

function quoted(value) {
  const written = String(value);
  const safe = typeof value === "string" && /^[=+@\t\r-]/.test(written) ? `'${written}` : written;
  return /[",\r\n]/.test(safe) ? `"${safe.replace(/"/g, '""')}"` : safe;
}
