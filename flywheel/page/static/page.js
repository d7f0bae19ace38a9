// The page of a scene: what its controls do, and what is shown of the server's answers.

import { help } from "./dialogs.js";
import { editorIn, leadToLine, nameEditor, showText } from "./editor.js";
import { byId, download, element } from "./elements.js";
import * as files from "./files.js";
import { formIn, leadTo, renewForm, showForm } from "./form.js";
import { language, speak, text } from "./language.js";
import { remember, remembered } from "./memory.js";
import { drop, notice } from "./notices.js";
import { reachable, secondRoute, showNumbers } from "./numbers.js";
import { cursorIn, play, sight, showPanels } from "./panels.js";
import * as model from "./scene.js";
import { call, onContact, reach } from "./server.js";
import { viewIn } from "./view.js";
import "./timings.js";

const { scene } = model;
let examples = [];
let asText = false;
let renew = false; // the next answer comes in another language or other units: everything is made anew
let spoken = ""; // the last thing said to a screen reader
let copying = 0;

await begin();

async function begin() {
  document.documentElement.dataset.theme = byId("theme").value = remembered("theme", "auto");
  scene.units = byId("units").value = remembered("units", "si");
  asText = remembered("asText", false);
  const { data } = await call("scene");
  examples = data.examples;
  await choose_language(remembered("language", data.language ?? "en"));
  formIn(byId("form"), model.edit);
  editorIn(byId("editor"), model.write);
  cursorIn();
  byId("panels").addEventListener("view", (event) => choose_view(event.detail));
  byId("panels").addEventListener("demand", () => model.ask());
  model.inSight(sight);
  controls();
  model.onScene(show);
  onContact(contact);
  model.open({ text: data.text, path: data.path, name: data.name, seen: data.seen });
  form_or_text(asText);
  files.offerCopy();
  files.guard();
  files.watch();
  if (!data.path && !data.text) files.start(examples);
}

function controls() {
  const clicks = {
    new: () => files.start(examples),
    save: () => files.save(),
    "save-as": () => files.saveAs(),
    report: () => files.report(),
    undo: model.undo,
    redo: model.redo,
    help: () => help(window.flywheelTimings.median),
    "as-form": () => form_or_text(false),
    "as-text": () => form_or_text(true),
  };
  for (const [id, act] of Object.entries(clicks)) byId(id).addEventListener("click", act);
  byId("theme").addEventListener("change", () => {
    document.documentElement.dataset.theme = byId("theme").value;
    remember("theme", byId("theme").value);
  });
  byId("units").addEventListener("change", () => {
    scene.units = byId("units").value;
    remember("units", scene.units);
    anew();
  });
  byId("language").addEventListener("change", async () => {
    remember("language", byId("language").value);
    await choose_language(byId("language").value);
    anew();
  });
  document.addEventListener("keydown", keys);
}

function keys(event) {
  const control = (event.ctrlKey || event.metaKey) && !event.altKey;
  const name = event.key.toLowerCase();
  const action = {
    f1: () => help(window.flywheelTimings.median),
    ...(control && {
      s: () => files.save(),
      z: () => (event.shiftKey ? model.redo() : model.undo()),
      y: model.redo,
      enter: play,
    }),
    ...(event.altKey && !control && { 1: () => form_or_text(false, true), 2: () => form_or_text(true, true) }),
  }[name];
  if (!action || (document.querySelector("dialog[open]") && name !== "s")) return;
  event.preventDefault();
  if (document.querySelector("dialog[open]")) return;
  if (control && document.activeElement.matches?.("#form input[type=text], #form textarea")) document.activeElement.dispatchEvent(new Event("change", { bubbles: true }));
  action();
}

async function choose_language(name) {
  const texts = name === "en" ? {} : (await call(`language?of=${name}`)).data;
  speak(name, texts);
  byId("language").value = name;
}

/** Make everything anew: another language, or other units. */
function anew() {
  renew = true;
  nameEditor();
  for (const name of ["changed", "copy", "gone"]) drop(name);
  model.ask();
  show();
}

function form_or_text(chosen, focus = false) {
  asText = chosen;
  remember("asText", asText);
  byId("form").hidden = asText;
  byId("editor").hidden = !asText;
  byId("scene").classList.toggle("as-text", asText);
  byId("as-form").setAttribute("aria-pressed", String(!asText));
  byId("as-text").setAttribute("aria-pressed", String(asText));
  if (asText) showText(scene.text, scene.faults, scene.remarks);
  if (focus) (asText ? byId("text") : byId("form").querySelector("summary"))?.focus();
}

// -- what is shown ----------------------------------------------------------------------------------------------------

/** Show the scene as it stands; `reply` is the server's where one has just come. */
function show(_scene = scene, reply = null) {
  names();
  state();
  clearTimeout(copying);
  copying = setTimeout(files.copy, 200);
  if (asText) showText(scene.text, scene.faults, scene.remarks);
  if (!reply) return;
  if (renew) renewForm(scene.form, scene.id);
  else showForm(scene.form, scene.id, new Set(model.pending().map((change) => change.path)));
  faults();
  if (asText) showText(scene.text, scene.faults, scene.remarks);
  if (scene.current) {
    const height = `${byId("numbers").offsetHeight}px`; // kept while a hand moves: some rows come at rest alone
    byId("numbers").style.minHeight = scene.confirmed === "done" ? "" : height;
    showNumbers(byId("numbers"), scene.answer.numbers ?? []);
    viewIn(byId("view"), scene.answer, renew, choose_view);
    showPanels(scene.answer, scene.units, renew);
    names();
    renew = false;
  }
  if (scene.confirmed === "done") reachable(byId("numbers"));
  if (scene.confirmed === "done" || scene.faults.length) say();
}

function choose_view(view) {
  scene.view = { ...scene.answer?.views?.chosen, ...scene.view, ...view };
  model.ask();
}

function names() {
  const title = scene.answer?.title || scene.name || "Flywheel";
  byId("title").textContent = title;
  document.title = `${model.unsaved() ? "• " : ""}${title} – Flywheel`;
  byId("file").textContent = scene.path ? scene.name : text("no file yet");
  byId("file").title = scene.path ?? "";
  byId("unsaved").textContent = model.unsaved() ? text("not saved") : "";
  byId("undo").disabled = !model.canUndo();
  byId("redo").disabled = !model.canRedo();
}

function state() {
  const words = { waiting: text("being confirmed …"), done: scene.answer ? secondRoute(scene.answer.numbers ?? []) : "", "": "" };
  const away = reach() !== "yes";
  const old = !scene.current && scene.answer !== null && (away || scene.faults.length > 0 || scene.error !== null);
  byId("state").textContent = scene.current ? words[scene.confirmed] : "";
  byId("state").dataset.state = scene.confirmed;
  byId("state").classList.toggle("good", scene.confirmed === "done" && confirmed(scene.answer));
  byId("results").classList.toggle("old", old);
  const none = scene.answer === null && scene.faults.length > 0;
  const faulty = away && scene.answer ? earlier() : none
    ? text("There are no results: the scene has faults.")
    : text("These are the results of the earlier scene. The present scene has faults and no results.");
  byId("earlier").replaceChildren(...(old || none || scene.error ? [element("p", { class: "warning" }, scene.error ?? faulty)] : []));
  for (const tools of ["cursor", "choices"]) byId(tools).hidden = none;
}

/** Of what scene the results are that stand there while nobody computes others. */
function earlier() {
  const values = { title: scene.answer.title || scene.name, time: scene.answered.at.toLocaleTimeString(language()) };
  return text("These are the results of {title} at {time}. Later changes are not computed.", values);
}

/** Whether a second route found the irregularity that was asked for. */
function confirmed({ speed }) {
  const confirmation = speed?.confirmed;
  return Boolean(confirmation) && (!speed.asked || Math.abs(confirmation.irregularity / speed.asked - 1) < 1e-3 + 2 * (confirmation.error ?? 0));
}

function faults() {
  const list = (items, kind) => items.map((item) => element("li", { class: kind }, element("button", { type: "button", class: "lead", onclick: () => lead(item) }, element("strong", {}, place(item)), ` ${item.message}`)));
  const parts = [];
  if (scene.faults.length) {
    const heading = scene.faults.length === 1 ? text("One fault") : text("{n} faults", { n: scene.faults.length });
    parts.push(element("h3", {}, heading), element("ul", { class: "faults" }, list(scene.faults, "fault")));
  }
  if (scene.remarks.length) {
    const heading = scene.remarks.length === 1 ? text("One remark") : text("{n} remarks", { n: scene.remarks.length });
    parts.push(element("h3", {}, heading), element("ul", { class: "faults" }, list(scene.remarks, "remark")));
  }
  byId("faults").replaceChildren(...parts);
}

function place(item) {
  return item.line ? text("{path}, line {line}:", { path: item.path, line: item.line }) : `${item.path}:`;
}

function lead(item) {
  if (!asText && leadTo(item.path)) return;
  form_or_text(true);
  leadToLine(item.line ?? 1);
}

/** Say to a screen reader what the answer is, once the hand rests. */
function say() {
  const wheel = scene.answer?.numbers?.find((block) => block.name === "flywheel");
  const message = scene.faults.length
    ? text("The scene has {n} faults. First: {first}", { n: scene.faults.length, first: `${scene.faults[0].path}: ${scene.faults[0].message}` })
    : [wheel?.title, wheel?.table?.[0]?.slice(0, 2).join(" ") ?? [wheel?.rows?.[0]?.label, wheel?.rows?.[0]?.value, wheel?.rows?.[0]?.unit].join(" "), byId("state").textContent].filter(Boolean).join(". ");
  if (message === spoken) return;
  spoken = message;
  byId("said").textContent = message;
}

function contact(reached) {
  const words = {
    no: text("The program no longer responds. Your edits are kept in this page; start it again with flywheel open, or copy the text."),
    other: text("This page belongs to an earlier run of the program. Open the address that the new run has printed; it offers your unsaved edits."),
  }[reached];
  files.copy();
  state();
  if (words) return notice("gone", words, [{ words: text("Download the text"), act: () => download(scene.name || "scene.toml", new Blob([scene.text])) }]);
  drop("gone");
  return model.retry();
}
