// What of the motion is shown: position, velocity, acceleration or reaction, and of which body; the joints of which mechanism.

import { element } from "./elements.js";
import { text } from "./language.js";

/** Put the choices into an element; `choose(view)` is called with the view that was chosen. */
export function viewIn(host, answer, view, anew, choose) {
  const { motion, reactions } = answer;
  const known = motion ? [motion.quantity, motion.of, motion.quantity === "reaction" ? motion.joints : motion.choices] : null;
  const shape = JSON.stringify([known, reactions?.mechanisms, reactions?.mechanism]);
  if (!anew && host.dataset.shape === shape) return;
  host.dataset.shape = shape;
  const focus = host.contains(document.activeElement) ? document.activeElement.id : null;
  const parts = [...(motion ? ofMotion(motion, view, choose) : []), ...(reactions?.mechanisms.length > 1 ? ofReactions(reactions, view, choose) : [])];
  host.replaceChildren(...parts);
  if (focus) document.getElementById(focus)?.focus();
}

function ofMotion({ quantity, of, choices, joints }, view, choose) {
  const kinds = [["position", text("position")], ["velocity", text("velocity")], ["acceleration", text("acceleration")]];
  if (joints.length) kinds.push(["reaction", text("reaction")]);
  const names = quantity === "reaction" ? joints : choices.map((choice) => choice.name);
  return [
    selectOf("view-quantity", text("Motion:"), kinds, quantity, (chosen) => choose({ ...view, motion: { quantity: chosen, of } })),
    selectOf("view-of", text("of"), names.map((name) => [name, name]), of, (chosen) => choose({ ...view, motion: { quantity, of: chosen } })),
  ];
}

function ofReactions({ mechanism, mechanisms }, view, choose) {
  const choice = (chosen) => choose({ ...view, reactions: { mechanism: chosen } });
  return [selectOf("view-mechanism", text("Reactions of"), mechanisms.map((name) => [name, name]), mechanism, choice)];
}

function selectOf(id, label, options, chosen, act) {
  const select = element("select", { id }, options.map(([value, words]) => element("option", { value }, words)));
  select.value = chosen;
  select.addEventListener("change", () => act(select.value));
  return element("label", {}, `${label} `, select);
}
