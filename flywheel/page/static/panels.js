// The figures of an answer: which are shown, one cursor through all of them, their motion, and each as a file.

import { byId, download, element, fileName } from "./elements.js";
import { draw, panels } from "./figures/index.js";
import { bodiesOf } from "./figures/panel.js";
import { number, text, typed } from "./language.js";
import { remember, remembered } from "./memory.js";

const SECONDS = 4; // of a turn, or of a stroke, at speed 1
const STILL_STEP = Math.PI / 12; // where motion is to be reduced, Play moves in steps
const STILL_SECONDS = 0.8;
const TURN = 2 * Math.PI;
const DEGREE = Math.PI / 180;
const PNG_SCALE = 2;
const PRINTED = 412; // px: a figure in one of two columns of a sheet, where its smallest text has 6 pt

const NEAR = "60px 0px"; // of the window: what is that near to it is drawn along

const boxes = new Map(); // id -> {box, host, figure, seen, old}
const reasons = new Map(); // id -> why it cannot be drawn, null where it can, as the last answer that told of it
const watch = new IntersectionObserver(sighted, { rootMargin: NEAR });
const still = matchMedia("(prefers-reduced-motion: reduce)");
let hidden = new Set(remembered("hidden", []));
let answer = null;
let bodies = []; // of the mechanisms: their order gives their colours
let units = "si";
let driver = { returns: true, pace: TURN / SECONDS, still: STILL_STEP, least: 0, span: TURN, unit: "deg", scale: DEGREE };
let at = 0;
let frame = 0;
let before = 0;

/** Make the controls of the cursor work. */
export function cursorIn() {
  byId("angle-range").addEventListener("input", () => move(byId("angle-range").valueAsNumber * driver.scale));
  byId("angle").addEventListener("change", () => {
    const angle = Number(typed(byId("angle").value));
    byId("angle").toggleAttribute("aria-invalid", !Number.isFinite(angle) || byId("angle").value.trim() === "");
    if (Number.isFinite(angle) && byId("angle").value.trim() !== "") move(angle * driver.scale);
  });
  byId("angle").addEventListener("keydown", (event) => {
    if (event.key === "Enter") byId("angle").dispatchEvent(new Event("change"));
  });
  byId("play").addEventListener("click", play);
  byId("panels").addEventListener("cursor", (event) => move(event.detail.phi));
  window.addEventListener("blur", () => (before = 0));
  const fit = (width) => boxes.forEach(({ figure }) => figure?.fit(width));
  window.addEventListener("beforeprint", () => fit(PRINTED));
  window.addEventListener("afterprint", () => fit(null));
}

/** Put the cursor at a crank angle (rad), in every figure. */
export function move(phi) {
  const inside = within(phi);
  if (!Number.isFinite(inside)) return;
  at = inside;
  tell();
  for (const { figure } of boxes.values()) figure?.move(at);
}

function within(phi) {
  const { returns, least, span } = driver;
  const past = phi < least || phi > least + span;
  return returns && past ? least + ((((phi - least) % span) + span) % span) : Math.min(Math.max(phi, least), least + span);
}

function tell() {
  const value = Number((at / driver.scale).toFixed(2));
  byId("angle-range").value = value;
  byId("angle-range").setAttribute("aria-valuetext", `${number(value)} ${driver.unit}`);
  if (document.activeElement !== byId("angle") || frame) byId("angle").value = number(value);
}

/** Let the cursor run through the cycle, or stop it. */
export function play() {
  if (frame) return pause();
  before = 0;
  frame = requestAnimationFrame(run);
  label();
}

function pause() {
  cancelAnimationFrame(frame);
  frame = 0;
  label();
}

function run(now) {
  before ||= now;
  const passed = (now - before) / 1000;
  const pace = Number(byId("pace").value);
  if (!still.matches) {
    advance(Math.min(passed, 0.1) * pace * driver.pace);
    before = now;
  } else if (passed * pace > STILL_SECONDS) {
    advance(driver.still);
    before = now;
  }
  frame = requestAnimationFrame(run);
}

function advance(by) {
  const end = driver.least + driver.span;
  move(at + by >= end ? driver.least + ((at + by - end) % driver.span) : at + by);
}

function label() {
  byId("play").textContent = frame ? text("Pause") : text("Play");
  byId("play").setAttribute("aria-pressed", String(frame !== 0));
}

/** Draw an answer in every figure that is shown; `whole`: make them anew, for another language or other units. */
export function showPanels(reply, system, whole = false) {
  if (reply.mechanism) bodies = bodiesOf(reply);
  answer = { ...reply, bodies };
  units = system;
  byId("figures-si").hidden = units === "si";
  span();
  const all = panels(answer).map((panel) => (panel.later ? { ...panel, why: reasons.get(panel.id) ?? null } : panel));
  for (const { id, why } of all) reasons.set(id, why);
  if (whole) clear();
  choices(all, whole);
  const chosen = all.filter((panel) => !hidden.has(panel.id));
  const order = [...chosen.filter((panel) => !panel.why), ...chosen.filter((panel) => panel.why)];
  arrange(order);
  for (const panel of order) {
    try {
      if (panel.later) mark(panel.id, true);
      else drawn(panel);
    } catch (error) {
      console.error(error); // a defect of one figure is no reason to lose the others
      Object.assign(boxes.get(panel.id), { figure: null });
      drawn({ ...panel, why: text("This figure could not be drawn.") });
    }
  }
  if (whole) label();
  if (within(at) === at) tell();
  else move(at);
}

function span() {
  const { kind = "angle", stroke = false, from = 0, to = answer.cycle } = answer.driver ?? {};
  const length = to - from || TURN;
  const { unit, scale, name } = {
    angle: { unit: "deg", scale: DEGREE, name: text("Crank angle") },
    length: { unit: "mm", scale: 1e-3, name: text("Position of the driver") },
    time: { unit: "s", scale: 1, name: text("Time") },
  }[kind];
  const turns = kind === "angle" && !stroke;
  const pace = kind === "time" ? 1 : (turns ? TURN : length) / SECONDS; // a second of time takes a second
  driver = { returns: turns || kind === "time", pace, still: turns ? STILL_STEP : length / 24, least: from, span: length, unit, scale };
  const step = kind === "angle" ? 0.5 : length / scale / 1000;
  Object.assign(byId("angle-range"), { min: driver.least / driver.scale, max: (driver.least + driver.span) / driver.scale, step });
  byId("cursor-name").textContent = name;
  byId("angle-unit").textContent = driver.unit;
}

/** The figures in or near the window; null before the first answer. */
export function sight() {
  return answer && [...boxes].filter(([, { seen }]) => seen).map(([id]) => id);
}

function sighted(entries) {
  for (const { target, isIntersecting } of entries) {
    const kept = boxes.get(target.dataset.panel);
    if (kept?.box !== target) continue;
    kept.seen = isIntersecting;
    if (isIntersecting && kept.old) byId("panels").dispatchEvent(new CustomEvent("demand"));
  }
}

/** A figure of an earlier answer is dimmed until it is drawn anew, at once when it comes in sight. */
function mark(id, old) {
  const kept = boxes.get(id);
  if (old && !kept.old && kept.seen) byId("panels").dispatchEvent(new CustomEvent("demand"));
  kept.old = old;
  kept.box.classList.toggle("old", old);
  kept.box.setAttribute("aria-busy", String(old));
}

function clear() {
  watch.disconnect();
  boxes.clear();
  byId("panels").replaceChildren();
}

function arrange(order) {
  for (const [id, { box }] of boxes) {
    if (order.some((panel) => panel.id === id)) continue;
    watch.unobserve(box);
    box.remove();
    boxes.delete(id);
  }
  let last = null;
  for (const panel of order) {
    if (!boxes.has(panel.id)) {
      boxes.set(panel.id, boxOf(panel));
      watch.observe(boxes.get(panel.id).box);
    }
    const { box } = boxes.get(panel.id);
    const place = last ? last.nextElementSibling : byId("panels").firstElementChild;
    if (place !== box) byId("panels").insertBefore(box, place);
    last = box;
  }
}

function boxOf(panel) {
  const name = `panel-${panel.id}`;
  const heading = element("h3", { id: name }, panel.title);
  const host = element("div", { class: "host" });
  const why = element("p", { class: "why", hidden: true });
  const files = ["SVG", "PNG", "CSV"].map((kind) =>
    element("button", { type: "button", class: "quiet", "aria-label": `${kind}: ${panel.title}`, onclick: () => file(panel.id, kind) }, kind),
  );
  const head = element("div", { class: "panel-head" }, heading, element("div", { class: "files", role: "group", "aria-label": text("{title} as a file", { title: panel.title }) }, files));
  return { box: element("section", { class: "panel", "data-panel": panel.id, "aria-labelledby": name }, head, host, why), heading, host, why, figure: null, seen: true, old: false };
}

function drawn(panel) {
  const kept = boxes.get(panel.id);
  mark(panel.id, false);
  if (kept.heading.textContent !== panel.title) kept.heading.textContent = panel.title;
  if (panel.why) {
    kept.figure = null;
    kept.host.replaceChildren();
  } else if (kept.figure) kept.figure.update(answer);
  else {
    kept.figure = draw(kept.host, panel.id, answer, { text, number });
    kept.figure.move(at);
  }
  kept.why.textContent = panel.why ?? "";
  kept.why.hidden = !panel.why;
  kept.host.hidden = Boolean(panel.why);
  kept.box.querySelector(".files").hidden = Boolean(panel.why);
}

function choices(all, whole) {
  const place = byId("choice");
  if (!whole && place.dataset.of === all.map((panel) => panel.id).join()) return;
  place.dataset.of = all.map((panel) => panel.id).join();
  place.replaceChildren(
    ...all.map((panel) => {
      const box = element("input", { type: "checkbox", checked: !hidden.has(panel.id) });
      box.addEventListener("change", () => {
        if (box.checked) hidden.delete(panel.id);
        else hidden.add(panel.id);
        remember("hidden", [...hidden]);
        showPanels(answer, units);
      });
      return element("label", {}, box, " ", panel.title);
    }),
  );
}

// -- files ------------------------------------------------------------------------------------------------------------

async function file(id, kind) {
  const { figure, heading } = boxes.get(id);
  if (!figure) return null;
  const name = fileName(`${answer.title ?? ""} ${heading.textContent}`, kind.toLowerCase());
  if (kind === "CSV") return download(name, new Blob([figure.csv()], { type: "text/csv" }));
  const svg = figure.svg();
  const { width, height } = svg.viewBox.baseVal;
  const source = `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(svg)}`;
  const drawing = new Blob([source], { type: "image/svg+xml" });
  return download(name, kind === "SVG" ? drawing : await raster(drawing, width, height));
}

async function raster(drawing, width, height) {
  const address = URL.createObjectURL(drawing);
  const image = new Image();
  await new Promise((loaded, failed) => Object.assign(image, { onload: loaded, onerror: failed, src: address }));
  const canvas = element("canvas", { width: PNG_SCALE * width, height: PNG_SCALE * height });
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  URL.revokeObjectURL(address);
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}
