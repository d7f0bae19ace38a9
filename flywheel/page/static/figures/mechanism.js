// The mechanism, moving: bodies on their pins and slides, paths of points, centres of mass; any body can be dragged.

import { csv, label, node, paint, path, round, standalone, valueAt, wide } from "./svg.js";
import { setAll } from "./curves.js";
import { clear, driverOf, followWidth, placeOf, coloursOf, widthOf } from "./panel.js";

const FILLED = { plate: 0.3, bar: 0.75, rail: 0.65, block: 0.5, "fixed block": 0.5, wheel: 0.12, cam: 0.3, dot: 1 };
const WHITE = new Set(["pin", "slot", "support"]);
const ORDER = ["ground", "cam", "wheel", "mark", "track", "plate", "rail", "slot", "bar", "support", "block", "fixed block", "dot", "weld", "pin", "arrow"];
const OPEN = new Set(["ground", "mark", "track", "arrow"]);
const DASHED = { wheel: "9 3 2 3", mark: "4 3" };
const STEP = 1; // degrees that an arrow key turns the crank by; hundredths of a stroke
const WINDOW = 0.2; // of the cycle: how far one movement of a dragging hand can take it
const SHAPE = 0.6; // height to width of the figure
const PART = 0.9; // height to width of several mechanisms together
const [LOWEST, HIGHEST] = [330, 520]; // px: how high a mechanism may be in a narrow place, in a wide one
let count = 0;

/** The mechanism in its place: a slider of the crank's angle for keyboard and screen reader, dragged by hand on any body. */
export function mechanismIn(host, answer, tools) {
  const { text } = tools;
  const name = `mechanism-${++count}`;
  const svg = node("svg", { role: "img", "aria-labelledby": `${name}-title ${name}-about` });
  const slider = document.createElement("div");
  slider.setAttribute("role", "slider");
  slider.tabIndex = 0;
  slider.append(svg);
  host.replaceChildren(slider);
  const state = { answer, width: widthOf(host), at: answer.phi[0], views: [], grip: null };

  function draw() {
    const width = Math.max(state.width, 240);
    const { views, without } = state.answer.mechanism;
    const driver = driverOf(state.answer, tools);
    state.driver = driver;
    const columns = columnsOf(views, width);
    const size = width / columns;
    const children = [];
    state.views = [];
    let top = 0;
    for (let row = 0; row * columns < views.length; row++) {
      const here = views.slice(row * columns, (row + 1) * columns);
      const drawn = here.map((view, k) => drawnView(view, state.answer, tools, { left: k * size, top, width: size, alone: views.length === 1 }));
      for (const each of drawn) {
        children.push(each.group);
        state.views.push(each);
      }
      top += Math.max(...drawn.map((each) => each.height));
    }
    if (without.length) children.push(label(4, (top += 16) - 4, text("Not drawn, as they have no bodies: {names}", { names: without.join(", ") }), { colour: "muted" }));
    if (views.some((view) => view.schematic)) children.push(label(4, (top += 16) - 4, text("Shafts as discs, not to scale."), { colour: "muted" }));
    svg.setAttribute("viewBox", `0 0 ${width} ${Math.ceil(top + 4)}`);
    const title = text("Mechanism");
    svg.replaceChildren(node("title", { id: `${name}-title` }, title), node("desc", { id: `${name}-about` }, aboutOf(views, tools)), ...children);
    setAll(slider, {
      "aria-label": { m: text("Position of the driver: drag a body, or use the arrow keys"), rad: text("Crank angle: drag a body, or use the arrow keys"), s: text("Time: drag a body, or use the arrow keys") }[driver.si],
      "aria-valuemin": coordinate(driver, driver.least), "aria-valuemax": coordinate(driver, driver.greatest),
    });
    move(state.at);
    if (state.grip && !views[state.grip.view]?.bodies[state.grip.at[0]]) state.grip = null;
    if (state.grip) state.grip.points = state.views[state.grip.view].track(state.grip.at);
  }

  function move(at) {
    state.at = at;
    for (const view of state.views) view.move(at);
    setAll(slider, { "aria-valuenow": coordinate(state.driver, at), "aria-valuetext": placeOf(state.driver, at, tools) });
  }

  function go(at) {
    const { least, greatest, cyclic } = state.driver;
    const span = greatest - least;
    const next = cyclic ? least + ((((at - least) % span) + span) % span) : Math.min(Math.max(at, least), greatest);
    host.dispatchEvent(new CustomEvent("cursor", { bubbles: true, detail: { phi: next } }));
  }

  slider.addEventListener("keydown", (event) => {
    const { driver } = state;
    const small = !driver.turns || !driver.cyclic ? (driver.greatest - driver.least) / 100 : (STEP * Math.PI) / 180;
    const steps = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 15, PageDown: -15 };
    const far = event.shiftKey ? 10 : 1;
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    if (event.key === "Home") go(driver.least);
    else if (event.key === "End") go(driver.cyclic ? driver.greatest - small : driver.greatest);
    else if (steps[event.key]) go(state.at + steps[event.key] * far * small);
    else return;
    event.preventDefault();
  });
  svg.style.touchAction = "none";
  svg.style.cursor = "grab";
  svg.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    const spot = placeIn(svg, state.width, event);
    const view = Math.max(state.views.findIndex((each) => each.holds(spot)), 0);
    const at = state.views[view].grip(spot, event.target.dataset?.body, state.at);
    state.grip = { view, at, points: state.views[view].track(at) };
    svg.setPointerCapture(event.pointerId);
    svg.style.cursor = "grabbing";
    slider.focus({ preventScroll: true });
    event.preventDefault();
  });
  svg.addEventListener("pointermove", (event) => {
    if (!state.grip) return;
    const { view, points } = state.grip;
    const moves = event.getCoalescedEvents?.() ?? []; // on a slow machine a hand goes far between two frames
    const spots = (moves.length ? moves : [event]).map((each) => placeIn(svg, state.width, each));
    go(spots.reduce((at, spot) => state.views[view].drag(points, spot, at), state.at));
  });
  for (const ended of ["pointerup", "pointercancel", "lostpointercapture"]) {
    svg.addEventListener(ended, () => {
      state.grip = null;
      svg.style.cursor = "grab";
    });
  }
  const fit = followWidth(host, state, draw);
  draw();
  return {
    fit,
    move,
    update(next) {
      state.answer = next;
      draw();
    },
    svg: () => standalone(svg),
    csv: () => placesOf(state.answer, tools),
  };
}

function placeIn(svg, width, event) {
  const box = svg.getBoundingClientRect();
  const scale = Math.max(width, 240) / box.width;
  return [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
}

function coordinate(driver, at) {
  return Number((at * driver.factor).toFixed(2));
}

function aboutOf(views, { text }) {
  return views.map((view) => text("{name}: bodies {bodies}; paths of {points}.", {
    name: view.name || text("Shafts"), bodies: Object.keys(view.bodies).join(", "), points: view.traces.map((trace) => trace.name).join(", ") || "–",
  })).join(" ");
}

/** How many mechanisms stand side by side: as many as bring the figure nearest to the shape that a card has. */
function columnsOf(views, width) {
  const most = Math.max(Math.min(views.length, Math.floor(width / 230)), 1);
  const off = (columns) => Math.abs(Math.log(Math.ceil(views.length / columns) * (36 + Math.max(...views.map((view) => tallOf(view, width / columns)))) / Math.min(PART * width, HIGHEST)));
  return Array.from({ length: most }, (_, k) => most - k).reduce((best, columns) => (off(columns) < off(best) ? columns : best));
}

/** How many px a mechanism takes of a m, in a place so wide; and how high it is then, px. */
function scaleOf({ box: [[x0, x1], [y0, y1]] }, width) {
  return Math.min((width - 24) / (x1 - x0), Math.min(Math.max(SHAPE * width, LOWEST), HIGHEST) / (y1 - y0));
}

const tallOf = (view, width) => (view.box[1][1] - view.box[1][0]) * scaleOf(view, width);

// -- one mechanism ----------------------------------------------------------------------------------------------------

/** One mechanism drawn at a place: `move`; the point of a body that a hand grips, the point's track, where it is dragged to. */
function drawnView(view, answer, tools, { left, top, width, alone }) {
  const phi = answer.phi;
  const driver = driverOf(answer, tools);
  const names = Object.keys(view.bodies);
  const colours = coloursOf(answer);
  const colour = (body) => (view.bodies[body] ? colours(alone ? `${view.name}.${body}` : `${view.name}.${body}`, names.indexOf(body)) : "ink");
  const [[x0, x1], [y0, y1]] = view.box;
  const head = alone ? 4 : 20;
  const scale = scaleOf(view, width);
  const tall = tallOf(view, width);
  const X = (x) => left + width / 2 + (x - (x0 + x1) / 2) * scale;
  const Y = (y) => top + head + 8 + tall / 2 - (y - (y0 + y1) / 2) * scale;

  const group = node("g");
  if (!alone) group.append(label(left + 6, top + 14, view.name, { bold: true }));
  for (const trace of view.traces) {
    const points = phi.map((_, k) => place(view, trace.at, k));
    group.append(node("path", { d: path(points.map(([x]) => X(x)), points.map(([, y]) => Y(y))), fill: "none", stroke: paint(colour(trace.at[0])), "stroke-width": 1, "stroke-dasharray": "4 3", "stroke-opacity": 0.8 }, node("title", {}, trace.name)));
  }
  const parts = [...view.shapes].sort((a, b) => ORDER.indexOf(a.kind) - ORDER.indexOf(b.kind)).map((shape) => {
    const drawn = figureOf(shape, colour(shape.body), scale);
    group.append(drawn);
    return { shape, drawn };
  });
  const centres = view.centres.map(({ body, at }) => {
    const drawn = centreOf(body);
    group.append(drawn);
    return { at, drawn };
  });
  const texts = view.labels.filter((each) => each.text && each.text !== "frame").map((each) => {
    const body = each.body !== "frame";
    const drawn = label(0, 0, each.text, { bold: body, halo: true, size: body ? 11 : 10 });
    drawn.style.pointerEvents = "none";
    const lead = node("line", { stroke: paint("muted"), "stroke-width": 0.75 });
    group.append(lead, drawn);
    return { ...each, drawn, lead, w: body ? 1.1 * wide(each.text, 11) : wide(each.text, 10), last: 0, isBody: body };
  });
  const hatching = clear();
  for (const { kind, at, outline: [xs, ys] } of view.shapes) {
    if (kind !== "ground" && kind !== "arrow") continue;
    const [u, v] = place(view, at, 0);
    const still = (k) => Math.hypot(...place(view, at, k).map((value, n) => value - [u, v][n])) * scale < 1;
    if (!phi.every((_, k) => still(k))) continue;
    xs.forEach((x, k) => {
      if (x === null) return;
      const before = k && xs[k - 1] !== null ? k - 1 : k;
      const pieces = Math.max(Math.ceil((Math.hypot(x - xs[before], ys[k] - ys[before]) * scale) / 4), 1);
      for (let n = 1; n <= pieces; n++) {
        const [a, b] = [xs, ys].map((values) => values[before] + (n / pieces) * (values[k] - values[before]));
        hatching.block(X(u + a) - 2, Y(v + b) - 2, 4, 4);
      }
    });
  }
  const bounds = [left + 2, top + (alone ? 2 : head), left + width - 2, top + head + tall + 14];

  function move(at) {
    const pose = poseAt(view, phi, at);
    for (const { shape, drawn } of parts) {
      const [x, y] = spotAt(pose, shape.at);
      const turn = pose[shape.turns]?.[2] ?? 0;
      drawn.setAttribute("transform", `translate(${round(X(x))} ${round(Y(y))}) rotate(${(-turn * 180) / Math.PI})`);
    }
    for (const { at: spot, drawn } of centres) {
      const [x, y] = spotAt(pose, spot);
      drawn.setAttribute("transform", `translate(${round(X(x))} ${round(Y(y))})`);
    }
    write(texts, (spot) => {
      const [x, y] = spotAt(pose, spot);
      return [X(x), Y(y)];
    }, view.centres.map((each) => each.at), hatching, bounds);
  }

  return {
    group,
    height: head + tall + 16,
    move,
    holds: ([x, y]) => x >= left && x < left + width && y >= top && y < top + head + tall + 16,
    grip([x, y], body, at) {
      const carrier = view.bodies[body] ? body : view.driver;
      const pose = poseAt(view, phi, at)[carrier] ?? [0, 0, 0];
      const [dx, dy] = [x0 + (x - X(x0)) / scale - pose[0], y0 + (Y(y0) - y) / scale - pose[1]];
      const [c, s] = [Math.cos(pose[2]), Math.sin(pose[2])];
      return [carrier, dx * c + dy * s, dy * c - dx * s];
    },
    track: (spot) => phi.map((_, k) => place(view, spot, k)).map(([a, b]) => [X(a), Y(b)]),
    drag: (points, spot, at) => nearestAlong(phi, points, spot, at, driver),
  };
}

/** The driver's position near the present one at which a point that is held comes nearest to the hand. */
function nearestAlong(phi, points, [x, y], at, driver) {
  const span = driver.greatest - driver.least;
  let best = at;
  let least = Infinity;
  for (let k = 1; k < phi.length; k++) {
    let away = Math.abs(phi[k] - at);
    if (driver.cyclic) away = Math.min(away, span - away);
    if (away > WINDOW * Math.min(span, !driver.turns || !driver.cyclic ? 5 * span : 2 * Math.PI)) continue;
    const [ax, ay] = points[k - 1];
    const [bx, by] = [points[k][0] - ax, points[k][1] - ay];
    const long = bx * bx + by * by;
    const share = long > 0 ? Math.min(Math.max(((x - ax) * bx + (y - ay) * by) / long, 0), 1) : 0;
    const far = Math.hypot(ax + share * bx - x, ay + share * by - y) + (2 * away) / span;
    if (far < least) [least, best] = [far, phi[k - 1] + share * (phi[k] - phi[k - 1])];
  }
  return best;
}

function poseAt(view, phi, at) {
  const poses = {};
  for (const name in view.bodies) {
    const { x, y, turn } = view.bodies[name];
    poses[name] = [valueAt(phi, x, at, false), valueAt(phi, y, at, false), valueAt(phi, turn, at, false)];
  }
  return poses;
}

function spotAt(pose, [body, a, b]) {
  const [x, y, turn] = pose[body] ?? [0, 0, 0];
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  return [x + a * c - b * s, y + a * s + b * c];
}

function place(view, at, k) {
  const body = view.bodies[at[0]];
  return spotAt(body ? { [at[0]]: [body.x[k], body.y[k], body.turn[k]] } : {}, at);
}

function figureOf(shape, colour, scale) {
  const [xs, ys] = shape.outline;
  const data = path(xs.map((x) => (x === null ? null : x * scale)), ys.map((y) => (y === null ? null : -y * scale)));
  const open = OPEN.has(shape.kind);
  const white = WHITE.has(shape.kind);
  const drawn = node("path", {
    d: open ? data : `${data}Z`, "data-body": shape.body, "data-kind": shape.kind,
    fill: open ? "none" : paint(white ? "paper" : shape.kind === "weld" ? "ink" : colour),
    "fill-opacity": open || white ? null : FILLED[shape.kind] ?? 1,
    stroke: paint(white || shape.kind === "ground" || shape.kind === "arrow" ? "ink" : colour),
    "stroke-width": shape.kind === "ground" ? 1 : 1.4, "stroke-dasharray": DASHED[shape.kind], "stroke-linejoin": "round",
  });
  drawn.append(node("title", {}, shape.body));
  return drawn;
}

/** The sign of a centre of mass: a disc with two black quarters. */
function centreOf(body) {
  const r = 5;
  const drawn = node("g", {},
    node("circle", { r, fill: paint("paper"), stroke: paint("ink") }),
    node("path", { d: `M0 0L${r} 0A${r} ${r} 0 0 0 0 ${-r}ZM0 0L${-r} 0A${r} ${r} 0 0 0 0 ${r}Z`, fill: paint("ink") }),
    node("title", {}, body));
  drawn.style.pointerEvents = "none";
  return drawn;
}

const SIDES = [[0, -1], [1, -0.7], [1, 0.7], [0, 1], [-1, 0.7], [-1, -0.7]];
const AROUND = [14, 22, 32, 44, 58, 76].flatMap((far) => SIDES.map(([x, y]) => [far * x, far * y]));
const NEAR = 12; // of the places around: a name further away has a line to what it names

/** Names beside their places, clear of one another, of hatching and of the driver's arrow: each stays on its side as long as that is free. */
function write(texts, spotOf, centres, hatching, [left, top, right, bottom]) {
  const free = clear();
  for (const at of [...texts.filter((name) => !name.isBody).map((name) => name.at), ...centres]) {
    const [x, y] = spotOf(at);
    free.block(x - 5, y - 5, 10, 10);
  }
  for (const name of texts) {
    const { drawn, lead, w } = name;
    const h = 12;
    const [x, y] = spotOf(name.at);
    const places = AROUND.map(([dx, dy]) => [x + dx - (dx > 0 ? 0 : dx < 0 ? w : w / 2), y + dy - h / 2]);
    const fits = ([a, b]) => a >= left && b >= top && a + w <= right && b + h <= bottom && free.free(a, b, w, h) && hatching.free(a, b, w, h);
    const k = name.last < NEAR && fits(places[name.last]) ? name.last : places.findIndex(fits);
    drawn.setAttribute("visibility", k < 0 ? "hidden" : "visible");
    lead.setAttribute("visibility", k < NEAR ? "hidden" : "visible");
    if (k < 0) continue;
    name.last = k;
    const [a, b] = places[k];
    free.block(a, b, w, h);
    setAll(drawn, { x: round(a), y: round(b + 10) });
    setAll(lead, { x1: round(x), y1: round(y), x2: round(Math.min(Math.max(x, a), a + w)), y2: round(Math.min(Math.max(y, b), b + h)) });
  }
}

/** Places of all points and angles of all bodies as CSV. */
function placesOf(answer, tools) {
  const { text } = tools;
  const driver = driverOf(answer, tools);
  const columns = [{ name: driver.name, unit: driver.si, values: answer.phi }];
  for (const view of answer.mechanism.views) {
    const before = answer.mechanism.views.length > 1 ? `${view.name} ` : "";
    for (const trace of view.traces) {
      const points = answer.phi.map((_, k) => place(view, trace.at, k));
      columns.push({ name: `${before}${trace.name} x`, unit: "m", values: points.map(([x]) => x) }, { name: `${before}${trace.name} y`, unit: "m", values: points.map(([, y]) => y) });
    }
    for (const [body, { turn }] of Object.entries(view.bodies)) columns.push({ name: `${before}${body} ${text("angle")}`, unit: "rad", values: turn });
  }
  return csv(columns);
}
