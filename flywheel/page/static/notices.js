// Notices across the page: what happened to the file or the server, each until it is settled or put away.

import { byId, element } from "./elements.js";
import { text } from "./language.js";

const timers = new Map();

/** Tell something under a name, in the place of what was told under it; `actions` are buttons: {words, act}. */
export function notice(name, words, actions = [], milliseconds = 0) {
  drop(name);
  const close = element("button", { type: "button", class: "quiet", onclick: () => drop(name) }, text("Put away"));
  const buttons = actions.map(({ words: label, act }) => element("button", { type: "button", onclick: act }, label));
  byId("notices").append(element("div", { class: "notice", "data-notice": name }, element("p", { role: "status" }, words), element("div", { class: "tools" }, buttons, close)));
  if (milliseconds) timers.set(name, setTimeout(() => drop(name), milliseconds));
}

/** Take a notice away. */
export function drop(name) {
  clearTimeout(timers.get(name));
  byId("notices").querySelector(`[data-notice="${name}"]`)?.remove();
}
