// The scene that is edited: its text, the steps back and forward, and what the server answers to it.
//
// The text is the one truth. An edit in the form is made in the text by the server; what comes back is the new text, the
// form, the faults and the answer. At most one request is under way, and the newest edit of every place wins. While a hand
// moves nothing is stepped in time; when it rests, one more request has the answer confirmed.

import { call } from "./server.js";
import { language } from "./language.js";
import { note } from "./timings.js";

const REST = 300; // ms after the last change
const STEPS = 300; // that can be taken back
const PAGE = Array.from(crypto.getRandomValues(new Uint32Array(3)), (part) => part.toString(36)).join("-"); // among other pages of the server

export const scene = {
  text: "", // as it is edited
  saved: "", // as it was read or saved
  id: 0, // another one for each scene that is opened or begun
  path: null, // of its file
  name: "", // shown, and proposed for files
  seen: "", // hash of the file as it was read or saved
  origin: "", // the example that the text comes from, beside which its tables lie
  form: [],
  faults: [],
  remarks: [],
  answer: null, // the last good one
  current: false, // the answer is that of the text
  answered: { text: null, at: null }, // the text of the answer, and when it came
  confirmed: "", // "": not asked yet; "waiting", "done"
  error: null, // what went wrong with the request itself
  view: {},
  units: "si",
};

let listener = () => {};
let seen = () => null;
let waiting = null; // the next request: {edits: Map path -> edit, step, event}
let flight = null; // the one under way: {rest, controller, asked}
let timer = 0;
let changed = 0; // time of the last change
let begun = 0; // scenes
let generation = 0; // of the text as a whole: replies to an earlier one are dropped
let past = [];
let future = [];
let formText = null; // the text in which the form's values stand at their spans
let step = null; // edits of one step (a whole drag) have one name

/** Call `heard(scene, reply)` after every reply, and after every change of the text. */
export function onScene(heard) {
  listener = heard;
}

/** `ids()` tells the figures that are in sight, which alone follow a hand that moves; null where all are wanted. */
export function inSight(ids) {
  seen = ids;
}

/** Whether the text differs from its file. */
export function unsaved() {
  return scene.text !== scene.saved || pending().length > 0;
}

/** Edits that no reply has taken up yet. */
export function pending() {
  return [...(flight?.batch?.edits.values() ?? []), ...(waiting?.edits.values() ?? [])];
}

/** Change the value at a place of the form; edits of one `name` are one step back. */
export function edit(change, name, event = performance.now()) {
  ask(event);
  const key = change.key ?? change.path;
  waiting.edits.delete(key);
  waiting.edits.set(key, change);
  waiting.step = name;
}

/** Put a whole text in the place of the present one. */
export function write(text, name) {
  if (text === scene.text) return;
  record(scene.text, name);
  replace(text);
}

/** Put another scene, which has a place of its own, in the place of this one: one step back leads to this one again. */
export function begin({ text, ...fields }) {
  const place = placeOf(scene);
  if (text !== scene.text) past.push({ text: scene.text, place });
  future = [];
  step = null;
  Object.assign(scene, { path: null, name: "", seen: "", saved: text, origin: "" }, fields, { id: (begun += 1) });
  replace(text);
}

/** Ask for the answer once more: another view, language or system of units. */
export function ask(event = null) {
  waiting ??= { edits: new Map(), step: null, event: null };
  waiting.event = event ?? waiting.event;
  changed = performance.now();
  if (scene.confirmed !== "") {
    scene.confirmed = "";
    listener(scene, null);
  }
  clearTimeout(timer);
  if (flight?.rest) flight.controller.abort();
  if (!flight) queueMicrotask(next);
}

/** Open another scene in the place of this one: its own file, no step back. */
export function open(fields) {
  past = [];
  future = [];
  step = null;
  Object.assign(scene, { path: null, name: "", seen: "", saved: fields.text, answer: null, current: false }, fields, { id: (begun += 1) });
  replace(fields.text);
}

export function canUndo() {
  return past.length > 0;
}

export function canRedo() {
  return future.length > 0;
}

/** One step back. */
export async function undo() {
  await settled();
  if (past.length) exchange(past, future);
}

/** One step forward. */
export async function redo() {
  await settled();
  if (future.length) exchange(future, past);
}

function exchange(from, to) {
  const { text, place } = from.pop();
  to.push({ text: scene.text, place: place && placeOf(scene) });
  step = null;
  Object.assign(scene, place);
  replace(text);
}

/** Where a scene comes from and is saved to. */
function placeOf({ id, path, name, seen, saved, origin }) {
  return { id, path, name, seen, saved, origin };
}

/** When every edit of the form stands in the text; at most two seconds, should the server be gone. */
export async function settled() {
  const until = performance.now() + 2000;
  while (pending().length && performance.now() < until) await new Promise((after) => setTimeout(after, 5));
}

/** Tell anew what there is: the file has changed its state. */
export function announce() {
  listener(scene, null);
}

/** Send again what was not answered: the server is back. */
export function retry() {
  ask();
}

function record(before, name) {
  if (name !== null && name === step) return;
  past.push({ text: before, place: null });
  if (past.length > STEPS) past.shift();
  future = [];
  step = name;
}

function replace(text) {
  generation += 1;
  waiting?.edits.clear();
  scene.text = text;
  ask();
  listener(scene, null);
}

function next() {
  if (flight) return;
  if (waiting) send(waiting, false);
  else timer = setTimeout(() => send(null, true), Math.max(0, changed + REST - performance.now()));
}

async function send(batch, rest) {
  if (flight) return;
  waiting = null;
  flight = { rest, batch, controller: new AbortController() };
  if (rest) {
    scene.confirmed = "waiting";
    listener(scene, null);
  }
  const of = generation;
  const sent = performance.now();
  const panels = batch?.event && scene.current ? seen() : null;
  const body = {
    text: scene.text,
    edits: batch ? [...batch.edits.values()].map(({ key, ...change }) => change) : [],
    view: panels ? { ...scene.view, panels } : scene.view,
    rest,
    language: language(),
    units: scene.units,
    origin: scene.origin,
    page: PAGE,
  };
  let reply = null;
  try {
    reply = await call("answer", body, flight.controller.signal);
  } catch {
    const aborted = flight.controller.signal.aborted;
    flight = null;
    return aborted ? next() : alone(batch, of);
  }
  const received = performance.now();
  flight = null;
  try {
    if (of === generation) take(reply, batch, rest);
    if (batch?.event && of === generation) note(batch.event, sent, received, performance.now(), reply.data?.milliseconds ?? null);
  } finally {
    if (waiting || !rest) next();
  }
  return undefined;
}

function lost(batch, of) {
  // Nobody answered, or the server dropped the request: its edits wait for the next one.
  if (batch && of === generation) {
    for (const [key, change] of waiting?.edits ?? []) batch.edits.set(key, change);
    waiting = batch;
  }
  scene.confirmed = "";
}

/** The server is gone: what was typed into fields goes into the text here; what only the server can do waits for it. */
function alone(batch, of) {
  lost(batch, of);
  if (waiting) enter(waiting);
  scene.current = scene.current && scene.text === scene.answered.text && !pending().length;
  listener(scene, null);
}

/** Put what a request has of typed values into the text, and leave it with the others. */
function enter({ edits, step: name }) {
  for (const [key, change] of edits) {
    const text = withTyped(change);
    if (text === null) continue;
    record(scene.text, name);
    scene.text = formText = text;
    edits.delete(key);
  }
}

/** The text with what was typed into a field, and the form's spans as they are then; null where that is not known here. */
function withTyped({ path, value, unit }) {
  const fields = scene.form.flatMap((group) => group.fields);
  const field = fields.find((one) => one.path === path);
  if (!field?.span || unit !== undefined || typeof value !== "string" || scene.text !== formText) return null;
  const [start, stop] = field.span;
  const characters = [...scene.text];
  const written = [...tomlOf(field, value, characters[start])];
  characters.splice(start, stop - start, ...written);
  const moved = (at) => (at >= stop ? at + written.length - (stop - start) : at);
  for (const one of fields) {
    const inside = one !== field && one.span && one.span[0] >= start && one.span[1] <= stop;
    one.span = one.span && !inside ? [moved(one.span[0]), moved(one.span[1])] : null;
  }
  field.value = value;
  return characters.join("");
}

/** What was typed, as TOML writes it in the place of a value that begins with this character. */
function tomlOf({ kind, unit }, typed, first) {
  const plain = typed.trim();
  if (kind === "boolean") return plain;
  if (kind === "list" || "[{".includes(first)) return /^[[{]/.test(plain) ? plain : `[${plain}]`;
  const numeric = kind !== "text" && /^[-+]?(0|[1-9]\d*)(\.\d+)?(e[-+]?\d+)?$/i.test(plain);
  if (numeric && !(unit && `"'`.includes(first))) return plain;
  return JSON.stringify(numeric ? `${plain} ${unit}` : kind === "text" ? typed : plain);
}

function take({ status, data }, batch, rest) {
  if (data?.reason === "overtaken") return lost(batch, generation);
  scene.error = status === 200 ? null : (data?.message ?? data?.error ?? `HTTP ${status}`);
  if (scene.error !== null) {
    if (batch) enter(batch); // an answer may be given up, what was typed not
    scene.current = false;
    scene.confirmed = "";
    return listener(scene, null);
  }
  if (data.text !== scene.text) {
    record(scene.text, batch?.step ?? null);
    scene.text = data.text;
  }
  if (data.form?.length) {
    scene.form = data.form;
    formText = scene.text;
  }
  scene.faults = data.faults ?? [];
  scene.remarks = data.remarks ?? [];
  scene.current = data.answer !== null && data.answer !== undefined;
  if (scene.current) Object.assign(scene, { answer: data.answer, answered: { text: scene.text, at: new Date() } });
  scene.confirmed = rest && scene.current ? "done" : "";
  listener(scene, data);
}
