// The figures of an answer: which there are, why others are not, and each drawn in its place.

import { figureIn } from "./panel.js";
import { inertia } from "./inertia.js";
import { mechanismIn } from "./mechanism.js";
import { moment } from "./moment.js";
import { motion } from "./motion.js";
import { powerFlow } from "./power_flow.js";
import { reactionsIn } from "./reactions.js";
import { speed } from "./speed.js";
import { wittenbauer } from "./wittenbauer.js";
import { text } from "../language.js";

const KINDS = { moment, inertia, wittenbauer, speed, motion, power_flow: powerFlow };

/**
 * Every figure of an answer by its id and title; `why` tells why it cannot be drawn, null where it can; `later` that the
 * answer says nothing of it, as it was not asked for.
 */
export function panels(answer) {
  const titles = {
    mechanism: text("Mechanism"),
    moment: text("Turning moment"),
    inertia: text("Reduced inertia by body"),
    wittenbauer: text("Wittenbauer's diagram"),
    speed: text("Speed over the cycle"),
    power_flow: text("Power flow"),
    reactions: text("Reactions in the joints"),
    motion: text("Motion"),
  };
  return Object.keys(titles)
    .filter((id) => answer.figures.includes(id) || answer.why[id] || answer.later.includes(id))
    .map((id) => ({ id, title: titles[id], why: answer.why[id] ?? null, later: answer.later.includes(id) }));
}

/** Draw a figure in its place; see `figureIn` for what it can do. */
export function draw(host, id, answer, tools) {
  const own = { mechanism: mechanismIn, reactions: reactionsIn }[id];
  return own ? own(host, answer, tools) : figureIn(host, answer, tools, KINDS[id]);
}
