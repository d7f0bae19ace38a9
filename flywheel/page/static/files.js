// The scene and its file: saved only when asked for, never over what somebody else has written, watched while it is open.

import { ask, askName, askReport, askStart, differences } from "./dialogs.js";
import { download, element, fileName } from "./elements.js";
import { language, text } from "./language.js";
import { copyOf, dropLeft, keepCopy } from "./memory.js";
import { drop, notice } from "./notices.js";
import { announce, begin, edit, pending, scene, settled, unsaved, write } from "./scene.js";
import { call, file, reach } from "./server.js";

const EVERY = 2000; // ms between two looks at the file

let sure = false; // the reader wants no question before the scene's own file is replaced
let key = ""; // of the copy of unsaved edits: the file with which the page was opened
let elsewhere = ""; // hash of a change on the disk that was told

/** Save the scene into its own file, or ask for a name where it has none. True where it was saved. */
export async function save() {
  await settled();
  if (!scene.path) return saveAs();
  if (!unsaved()) return inform(text("There is nothing to save."));
  const there = await onDisk();
  if (there?.changed && there.text) return conflict(scene.path, there);
  if (!sure && !(await mayReplace())) return false;
  return write_to(scene.path, true, scene.seen);
}

/** What stands in the scene's file, {changed, text, seen}; null where nobody answers. */
async function onDisk() {
  try {
    const { status, data } = await call(`watch?seen=${encodeURIComponent(scene.seen ?? "")}&path=${encodeURIComponent(scene.path ?? "")}`);
    return status === 200 ? data : null;
  } catch {
    return null; // that the program is gone is told elsewhere
  }
}

/** Save the scene under another name. True where it was saved. */
export async function saveAs(why = null) {
  await settled();
  const name = await askName(scene.name || "scene.toml", why);
  return name === null ? false : write_to(name.endsWith(".toml") ? name : `${name}.toml`, false, "");
}

async function mayReplace() {
  const box = element("input", { type: "checkbox", id: "sure" });
  const parts = [
    differences(scene.saved, scene.text, { theirs: text("in the file"), mine: text("in this page") }),
    element("p", {}, element("label", {}, box, " ", text("Do not ask again while this page is open"))),
  ];
  const chosen = await ask(text("Replace {name}?", { name: scene.name }), parts, [
    { value: "save", words: text("Save"), main: true },
    { value: "other", words: text("Save under another name …") },
    { value: "", words: text("Cancel") },
  ]);
  sure ||= chosen === "save" && box.checked;
  if (chosen === "other") await saveAs();
  return chosen === "save";
}

async function write_to(path, over, seen) {
  const written = scene.text;
  let reply;
  try {
    reply = await call("save", { text: written, path, over, seen });
  } catch {
    inform(text("The scene was not saved: the program does not answer."), "save");
    return false;
  }
  const { status, data } = reply;
  if (status === 409) return conflict(path, data);
  if (status !== 200) {
    inform(text("The scene was not saved: {why}", { why: data?.message ?? status }), "save");
    return false;
  }
  Object.assign(scene, { saved: written, seen: data.seen, path: data.path, name: data.name });
  copy();
  drop("changed");
  drop("save");
  elsewhere = "";
  inform(text("Saved as {name}.", { name: scene.name }), "saved", 6000);
  announce();
  return true;
}

/** There is another text where this one was to be written: show what differs, and let the reader choose. */
async function conflict(path, data) {
  const other = path !== null && path !== scene.path;
  const title = other ? text("{name} exists already", { name: path }) : text("{name} was changed outside this page", { name: scene.name });
  const parts = [differences(data.text ?? "", scene.text, { theirs: text("in the file"), mine: text("in this page") })];
  const chosen = await ask(title, parts, [
    { value: "mine", words: other ? text("Replace it") : text("Keep mine: replace the file") },
    other ? null : { value: "theirs", words: text("Take theirs") },
    { value: "other", words: text("Save under another name …"), main: true },
    { value: "", words: text("Cancel") },
  ].filter(Boolean));
  if (chosen === "mine") return write_to(path, true, data.seen);
  if (chosen === "theirs") take(data);
  if (chosen === "other") return saveAs();
  return false;
}

/** Take the file's text: the page's own becomes the step before it. */
function take({ text: theirs, seen }) {
  Object.assign(scene, { saved: theirs, seen });
  drop("changed");
  elsewhere = "";
  write(theirs, null);
  announce();
}

// -- the file on the disk ---------------------------------------------------------------------------------------------

/** Look at the file every two seconds: a change is told, never taken unasked. */
export function watch() {
  const look = async () => {
    const there = await onDisk();
    if (there && scene.path) seenOnDisk(there);
    setTimeout(look, EVERY);
  };
  setTimeout(look, EVERY);
}

function seenOnDisk(data) {
  if (!data.changed) {
    elsewhere = "";
    return drop("changed");
  }
  if (data.seen === elsewhere) return undefined;
  elsewhere = data.seen;
  const gone = data.seen === "" || data.seen === "unreadable" || data.text === undefined;
  const words = gone ? text("{name} no longer exists, or cannot be read. The scene in this page is kept.", { name: scene.name }) : text("{name} was changed outside this page. The scene in this page is kept.", { name: scene.name });
  const compare = { words: text("Show what differs"), act: () => differ(data) };
  return notice("changed", words, gone ? [] : [compare, { words: text("Take theirs"), act: () => take(data) }, { words: text("Keep mine"), act: () => keep(data) }]);
}

/** The reader keeps the page's own text although he has seen the file's: saving asks once more. */
function keep(data) {
  Object.assign(scene, { saved: data.text });
  drop("changed");
  announce();
}

async function differ(data) {
  const chosen = await ask(text("What differs"), [differences(data.text, scene.text, { theirs: text("in the file"), mine: text("in this page") })], [
    { value: "theirs", words: text("Take theirs") },
    { value: "mine", words: text("Keep mine") },
    { value: "", words: text("Close"), main: true },
  ]);
  if (chosen === "theirs") take(data);
  if (chosen === "mine") keep(data);
}

// -- unsaved edits ----------------------------------------------------------------------------------------------------

/** Keep a copy of unsaved edits in this tab, and ask before it is left with some. */
export function guard() {
  window.addEventListener("beforeunload", (event) => {
    copy();
    if (unsaved()) event.preventDefault();
  });
  window.addEventListener("pagehide", copy);
}

/** Keep a copy of the present text, where it differs from its file. */
export function copy() {
  const { text: words, path, name, seen, saved, origin } = scene;
  keepCopy(key, unsaved() ? { text: words, path, name, seen, saved, origin, edits: pending() } : null, reach() === "other");
}

/** Offer unsaved edits that this tab kept from before it was loaded anew. */
export function offerCopy() {
  key = scene.path ?? "";
  const kept = copyOf(key);
  if (!kept || (kept.text === scene.text && !kept.edits.length)) return dropLeft(key);
  return notice("copy", text("There are unsaved edits of this scene from an earlier visit."), [
    { words: text("Bring them back"), act: () => bring(kept) },
    { words: text("Show what differs"), act: () => ask(text("What differs"), [differences(scene.text, kept.text, { theirs: text("in this page"), mine: text("not saved") })], [{ value: "", words: text("Close"), main: true }]) },
    { words: text("Discard them"), act: () => { drop("copy"); dropLeft(key); copy(); } },
  ]);
}

/** Take what a tab kept: its text, then the edits of the form that no server has put into it yet. */
function bring({ edits, ...kept }) {
  drop("copy");
  dropLeft(key);
  begin(kept);
  for (const change of edits) edit(change, null);
}

// -- other scenes, reports --------------------------------------------------------------------------------------------

/** Begin with a starter or an example: its text takes the place of this one, which stays a step back. */
export async function start(examples) {
  await settled();
  const id = await askStart(examples, unsaved());
  if (id === null) return;
  const { status, data } = await call("start", { id }).catch(() => ({ status: 0 }));
  if (status !== 200) return void inform(text("The example could not be read."), "save");
  drop("changed");
  begin({ text: data.text, name: data.name, origin: data.origin ?? "" });
  return undefined;
}

/** Make the worked report and give it as a file. */
export async function report() {
  await settled();
  const chosen = await askReport(language());
  if (chosen === null) return;
  notice("report", text("The report is being made …"), []);
  try {
    const made = await file("report", { text: scene.text, units: scene.units, origin: scene.origin, ...chosen });
    const name = (scene.name || "scene").replace(/\.toml$/, "");
    download(fileName(chosen.cover_sheet ? `${name}-cover-sheet` : name, chosen.format), made);
    inform(text("The report was made."), "report", 6000);
  } catch (error) {
    inform(text("The report was not made: {why}", { why: error.message }), "report");
  }
}

function inform(words, name = "saved", milliseconds = 6000 * (name === "saved")) {
  notice(name, words, [], milliseconds);
  return false;
}
