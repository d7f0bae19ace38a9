// What of the motion is shown: position, velocity, acceleration or reaction, and of which body; the joints of which mechanism.

import { element } from "./elements.js";
import { text } from "./language.js";

/** Put the choices into an element; `choose(part)` is called with the part of the view that was chosen. */
export function viewIn(host, answer, anew, choose) {
  const { views, reactions, later } = answer;
  if (later.includes("motion") || later.includes("reactions")) return; // what can be chosen comes with the whole answer
  const shape = JSON.stringify([views, reactions?.mechanisms, reactions?.mechanism]);
  if (!anew && host.dataset.shape === shape) return;
  host.dataset.shape = shape;
  const focus = host.contains(document.activeElement) ? document.activeElement.id : null;
  const several = reactions?.mechanisms?.length > 1;
  host.replaceChildren(...(views ? ofMotion(views, choose) : []), ...(several ? [ofReactions(reactions, choose)] : []));
  if (focus) document.getElementById(focus)?.focus();
}

function ofMotion({ kinds, of, chosen }, choose) {
  const words = { position: text("position"), velocity: text("velocity"), acceleration: text("acceleration"), reaction: text("reaction") };
  const kind = selectOf("view-kind", text("Motion:"), kinds.map((name) => [name, words[name] ?? name]), chosen.kind, (name) => choose({ kind: name }));
  const body = selectOf("view-of", text("of"), of.map(({ id, label }) => [id, label]), chosen.of, (name) => choose({ of: name }));
  return [kind, body];
}

function ofReactions({ mechanism, mechanisms }, choose) {
  const options = mechanisms.map((name) => [name, name]);
  return selectOf("view-mechanism", text("Reactions of"), options, mechanism, (name) => choose({ mechanism: name }));
}

function selectOf(id, label, options, chosen, act) {
  const select = element("select", { id }, options.map(([value, words]) => element("option", { value }, words)));
  select.value = chosen;
  select.addEventListener("change", () => act(select.value));
  return element("label", {}, `${label} `, select);
}
