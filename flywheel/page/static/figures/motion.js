// Position, velocity or acceleration of a body, a joint or a point, or the reaction of a joint, against the driver.

import { figure, scaled } from "./svg.js";
import { curvesOf, extremeWords } from "./curves.js";
import { driverOf } from "./panel.js";

const FAR = 0.4; // of the largest value: a curve that comes no nearer to zero is drawn without it
const LINES = {
  "": { colour: "blue", line: 2 },
  x: { colour: "blue", line: 2 },
  y: { colour: "vermillion", dash: "7 3", line: 2 },
  amount: { colour: "ink", dash: "2 3" },
};

export const motion = {
  draw(answer, width, tools) {
    const { text } = tools;
    const data = answer.motion;
    const driver = driverOf(answer, tools);
    const names = {
      position: text("Position of {name}", { name: data.of }), velocity: text("Velocity of {name}", { name: data.of }),
      acceleration: text("Acceleration of {name}", { name: data.of }), reaction: text("Reaction in {name}", { name: data.of }),
    };
    const parts = { "": data.of, x: `${data.of} x`, y: `${data.of} y`, amount: text("amount") };
    const largest = Math.max(...data.curves.flatMap((curve) => [curve.least, curve.greatest]).map((each) => Math.abs(each?.value ?? 0)));
    const unit = scaled(data.unit, largest);
    const ends = data.curves.flatMap((curve) => [curve.least?.value ?? 0, curve.greatest?.value ?? 0]);
    const far = Math.min(...ends) > FAR * largest || Math.max(...ends) < -FAR * largest;
    const lines = data.curves.map((curve) => ({ ...LINES[curve.part], name: parts[curve.part], values: curve.values }));
    const marks = data.curves.flatMap((curve) => ["greatest", "least"]
      .filter((which) => curve[which] && curve.greatest.value !== curve.least.value)
      .map((which) => ({ ...curve[which], kind: which === "greatest" ? "up" : "down", colour: LINES[curve.part].colour, words: extremeWords(curve[which], unit, driver, tools, { figure }) })));
    const told = data.curves.map((curve) => `${parts[curve.part]}: ${["least", "greatest"].map((which) => extremeWords(curve[which], unit, driver, tools, { figure })).join(" … ")}`);
    return curvesOf(answer, width, tools, {
      title: names[data.quantity],
      about: `${condition(data.condition, driver, tools)} ${told.join("; ")}.`,
      notes: [condition(data.condition, driver, tools)],
      rows: [{ name: names[data.quantity], unit, height: Math.round(Math.min(Math.max(0.42 * width, 160), 230)), zero: data.quantity !== "position" && !far, room: 0.14, curves: lines, marks }],
      columns: lines.map((curve) => ({ name: curve.name, unit: data.unit, values: curve.values })),
    });
  },
};

/** How the driver moves, in words. */
function condition({ kind, speed, acceleration, without_inertia: still }, driver, { text, number }) {
  if (still) return text("Without inertia forces, as no speed is given.");
  if (kind === "steady") return text("In the steady regime, at {speed} rpm in the mean of extremes.", { speed: number(figure((speed * 30) / Math.PI, 5)) });
  if (kind === "unit") return text("Per unit of the driver, as no speed is given.");
  const told = driver.sliding ? `${number(figure(speed, 5))} m/s` : `${number(figure((speed * 30) / Math.PI, 5))} rpm`;
  if (acceleration) return text("At {speed}, with an acceleration of {acceleration}.", { speed: told, acceleration: `${number(figure(acceleration, 5))} ${driver.sliding ? "m/s²" : "rad/s²"}` });
  return text("At a constant {speed}.", { speed: told });
}
