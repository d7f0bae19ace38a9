// The figures of an answer: which there are, why others are not, and each drawn in its place.

import { area } from "./area.js";
import { rowsOf } from "./curves.js";
import { figureIn } from "./panel.js";
import { mechanismIn } from "./mechanism.js";
import { powerFlow } from "./power_flow.js";
import { reactionsIn } from "./reactions.js";
import { wittenbauer } from "./wittenbauer.js";

const FORMS = { area: area, loop: wittenbauer, power_flow: powerFlow };

/**
 * Every figure of an answer by its id and title; `why` tells why it cannot be drawn, null where it can; `later` that the
 * answer says nothing of it, as it was not asked for.
 */
export function panels(answer) {
  return Object.entries(answer.titles)
    .filter(([id]) => answer.figures.includes(id) || answer.why[id] || answer.later.includes(id))
    .map(([id, title]) => ({ id, title, why: answer.why[id] ?? null, later: answer.later.includes(id) }));
}

/** Draw a figure in its place; see `figureIn` for what it can do. */
export function draw(host, id, answer, tools) {
  const own = { mechanism: mechanismIn, reactions: reactionsIn }[id];
  if (own) return own(host, answer, tools);
  return figureIn(host, answer, tools, FORMS[answer[id].diagram.form] ?? rowsOf(id));
}
