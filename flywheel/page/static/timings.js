// How long the figures take to follow a hand: from the event of a slider to the figures drawn anew. For tests and people.

const MOST = 2000;
const samples = [];

/** Note one redraw: times (performance.now) of the newest event it shows, of the request, of the reply, of the figures. */
export function note(event, sent, received, drawn, server) {
  samples.push({ total: drawn - event, call: received - sent, draw: drawn - received, server });
  if (samples.length > MOST) samples.shift();
}

function share(part) {
  const sorted = samples.map((sample) => sample.total).sort((a, b) => a - b);
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.ceil(part * sorted.length) - 1)] : null;
}

window.flywheelTimings = {
  samples,
  reset: () => samples.splice(0),
  get count() {
    return samples.length;
  },
  get median() {
    return share(0.5);
  },
  get p95() {
    return share(0.95);
  },
};
