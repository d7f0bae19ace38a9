// The mechanism, moving: bodies on their pins and slides, paths of points, centres of mass; any body can be dragged.

import { csv, label, node, paint, path, round, standalone, valueAt, wide } from "./svg.js";
import { setAll } from "./curves.js";
import { clear, driverOf, followWidth, placeOf, coloursOf } from "./panel.js";

const FILLED = { plate: 0.3, bar: 0.75, rail: 0.65, block: 0.5, "fixed block": 0.5, wheel: 0.12, cam: 0.3, dot: 1 };
const WHITE = new Set(["pin", "slot", "support"]);
const ORDER = ["ground", "cam", "wheel", "mark", "track", "plate", "rail", "slot", "bar", "support", "block", "fixed block", "dot", "weld", "pin", "arrow"];
const OPEN = new Set(["ground", "mark", "track", "arrow"]);
const DASHED = { wheel: "9 3 2 3", mark: "4 3" };
const STEP = 1; // degrees that an arrow key turns the crank by; hundredths of a stroke
const WINDOW = 0.2; // of the cycle: how far one movement of a dragging hand can take it
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
  const style = getComputedStyle(host);
  const state = { answer, width: Math.floor(host.clientWidth - Number.parseFloat(style.paddingLeft) - Number.parseFloat(style.paddingRight)) || 480, at: answer.phi[0], views: [], grip: null };

  function draw() {
    const width = Math.max(state.width, 240);
    const { views, without } = state.answer.mechanism;
    const driver = driverOf(state.answer, tools);
    state.driver = driver;
    const columns = Math.min(views.length, Math.max(Math.floor(width / 230), 1));
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
      "aria-valuemin": shown(driver, driver.least), "aria-valuemax": shown(driver, driver.greatest),
    });
    move(state.at);
    if (state.grip && !views[state.grip.view]?.bodies[state.grip.at[0]]) state.grip = null;
    if (state.grip) state.grip.points = state.views[state.grip.view].track(state.grip.at);
  }

  function move(at) {
    state.at = at;
    for (const view of state.views) view.move(at);
    setAll(slider, { "aria-valuenow": shown(state.driver, at), "aria-valuetext": placeOf(state.driver, at, tools) });
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
  followWidth(host, state, draw);
  draw();
  return {
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

function shown(driver, at) {
  return Number((at * driver.factor).toFixed(2));
}

function aboutOf(views, { text }) {
  return views.map((view) => text("{name}: bodies {bodies}; paths of {points}.", {
    name: view.name || text("Shafts"), bodies: Object.keys(view.bodies).join(", "), points: view.traces.map((trace) => trace.name).join(", ") || "–",
  })).join(" ");
}

// -- one mechanism ----------------------------------------------------------------------------------------------------

/** One mechanism drawn at a place: `move`; the point of a body that a hand grips, the point's track, where it is dragged to. */
function drawnView(view, answer, tools, { left, top, width, alone }) {
  const phi = answer.phi;
  const driver = driverOf(answer, tools);
  const names = Object.keys(view.bodies);
  const colours = coloursOf(answer);
  const colour = (body) => (view.bodies[body] ? colours(alone ? `${view.name}.${body}` : `${view.name}.${body}`, names.indexOf(body)) : "ink");
  const box = boxOf(view, phi);
  const head = alone ? 4 : 20;
  const inner = width - 24;
  const scale = Math.min(inner / (box[2] - box[0]), 330 / (box[3] - box[1]));
  const tall = (box[3] - box[1]) * scale;
  const X = (x) => left + width / 2 + (x - (box[0] + box[2]) / 2) * scale;
  const Y = (y) => top + head + 8 + tall / 2 - (y - (box[1] + box[3]) / 2) * scale;

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
    group.append(drawn);
    return { ...each, drawn, w: body ? 1.1 * wide(each.text, 11) : wide(each.text, 10), last: 0, isBody: body };
  });
  const hatched = view.shapes.filter((shape) => shape.kind === "ground" && !view.bodies[shape.at[0]]).flatMap(({ at, outline: [xs, ys] }) =>
    xs.flatMap((x, k) => (x === null ? [] : [[X(at[1] + x), Y(at[2] + ys[k])]])));
  const bounds = [left + 2, top + 2, left + width - 2, top + head + tall + 14];

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
    }, view.centres.map((each) => each.at), hatched, bounds);
  }

  return {
    group,
    height: head + tall + 16,
    move,
    holds: ([x, y]) => x >= left && x < left + width && y >= top && y < top + head + tall + 16,
    grip([x, y], body, at) {
      const carrier = view.bodies[body] ? body : view.driver;
      const pose = poseAt(view, phi, at)[carrier] ?? [0, 0, 0];
      const [dx, dy] = [box[0] + (x - X(box[0])) / scale - pose[0], box[1] + (Y(box[1]) - y) / scale - pose[1]];
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
  const found = {};
  for (const name in view.bodies) {
    const { x, y, turn } = view.bodies[name];
    found[name] = [valueAt(phi, x, at, false), valueAt(phi, y, at, false), valueAt(phi, turn, at, false)];
  }
  return found;
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

/** The box of everything that is drawn, over the whole motion: [x0, y0, x1, y1] in m. */
function boxOf(view, phi) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const shape of view.shapes) {
    let reach = 0;
    const [xs, ys] = shape.outline;
    for (let k = 0; k < xs.length; k++) if (xs[k] !== null) reach = Math.max(reach, Math.hypot(xs[k], ys[k]));
    const still = !view.bodies[shape.at[0]] && !view.bodies[shape.turns];
    const every = still ? phi.length : Math.max(Math.floor(phi.length / 60), 1);
    for (let k = 0; k < phi.length; k += every) {
      const [x, y] = place(view, shape.at, k);
      if (still) {
        for (let n = 0; n < xs.length; n++) if (xs[n] !== null) grow(box, x + xs[n], y + ys[n], 0);
      } else if (reach < 0.2 * view.size || shape.kind === "wheel" || shape.kind === "cam" || shape.kind === "plate") grow(box, x, y, Math.min(reach, view.size));
      else {
        const turn = view.bodies[shape.turns]?.turn[k] ?? 0;
        const [c, s] = [Math.cos(turn), Math.sin(turn)];
        for (let n = 0; n < xs.length; n += 6) if (xs[n] !== null) grow(box, x + xs[n] * c - ys[n] * s, y + xs[n] * s + ys[n] * c, 0);
      }
    }
  }
  return box;
}

function grow(box, x, y, by) {
  box[0] = Math.min(box[0], x - by);
  box[1] = Math.min(box[1], y - by);
  box[2] = Math.max(box[2], x + by);
  box[3] = Math.max(box[3], y + by);
}

function figureOf(shape, colour, scale) {
  const [xs, ys] = shape.outline;
  const data = path(xs.map((x) => (x === null ? null : x * scale)), ys.map((y) => (y === null ? null : -y * scale)));
  const open = OPEN.has(shape.kind);
  const white = WHITE.has(shape.kind);
  const drawn = node("path", {
    d: open ? data : `${data}Z`, "data-body": shape.body,
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

const AROUND = [[0, -14], [12, -10], [12, 8], [0, 16], [-12, 8], [-12, -10], [18, -22], [-18, -22], [18, 22], [-18, 22]];

/** Names beside their places, clear of one another and, if there is room, of hatching: each stays on its side as long as that is free. */
function write(texts, spotOf, centres, hatched, bounds) {
  const free = clear();
  const bare = clear();
  for (const [x, y] of hatched) bare.block(x - 2, y - 2, 4, 4);
  for (const at of [...texts.filter((name) => !name.isBody).map((name) => name.at), ...centres]) {
    const [x, y] = spotOf(at);
    free.block(x - 5, y - 5, 10, 10);
  }
  for (const name of texts) {
    const [x, y] = spotOf(name.at);
    const h = 12;
    const places = AROUND.map(([dx, dy]) => [x + dx + (dx > 0 ? 0 : dx < 0 ? -name.w : -name.w / 2), y + dy - h / 2]);
    const inside = ([a, b]) => a >= bounds[0] && b >= bounds[1] && a + name.w <= bounds[2] && b + h <= bounds[3] && free.free(a, b, name.w, h);
    const best = (place) => inside(place) && bare.free(...place, name.w, h);
    const k = [best, inside].map((fits) => (fits(places[name.last]) ? name.last : places.findIndex(fits))).find((found) => found >= 0) ?? -1;
    name.drawn.setAttribute("visibility", k < 0 ? "hidden" : "visible");
    if (k < 0) continue;
    name.last = k;
    free.block(places[k][0], places[k][1], name.w, h);
    setAll(name.drawn, { x: round(places[k][0]), y: round(places[k][1] + 10) });
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
