// When to step between frames (docs/guide/frames-and-haptics.md): crates/cli/src/view/clock.rs for any number of instruments.
// Poses of the last frames are kept with their times; a step has the poses of its own moment, which lies between two frames.
const MOST_POSES = 256;
const LOST_S = 0.1; // what was lost for longer is not made up for
const PUT_MM = 40; // an instrument that is farther away than this was put there and did not pass between
// A step's way of one that holds tissue: what is lost on a slow machine must not tear it off.
const HELD_MM = 5;
const HELD_RAD = 0.1;

export class Clock {
  #dt;
  #next = 0; // the moment of the next step
  #published = 0; // and of the last one
  #started = false;
  #poses = []; // [s, instruments]
  #last = []; // instruments of the last step
  #puts = []; // when an instrument was put elsewhere last, s

  constructor(dt) {
    this.#dt = dt;
  }

  /** The first step is due at `now`, s, unless there were others. */
  start(now) {
    if (this.#started) return;
    this.#started = true;
    this.#next = this.#published = now;
  }

  /** The instruments are here at `now`, s. */
  moved(now, instruments) {
    this.start(now);
    const [when, before] = this.#poses.at(-1) ?? [];
    instruments.forEach((end, i) => {
      if (before?.[i] && isPut(before[i], end)) this.#puts[i] = when;
    });
    if (this.#poses.length === MOST_POSES) this.#poses.shift();
    this.#poses.push([now, instruments]);
  }

  due(now) {
    return this.#poses.length > 0 && now + 1e-9 >= this.#next;
  }

  /** A step is made: the instruments at its moment. */
  step(now) {
    if (now - this.#next > Math.max(2 * this.#dt, LOST_S)) this.#next = now;
    const [before, moment] = [this.#published, this.#next];
    this.#next += this.#dt;
    this.#published = moment;
    const poses = this.#poses;
    while (poses.length > 2 && poses[1][0] <= moment) poses.shift();
    const [from, to] = poses;
    const part = to && moment > from[0] ? Math.min((moment - from[0]) / Math.max(to[0] - from[0], 1e-9), 1) : 0;
    const wanted = to ? between(from[1], to[1], part) : from[1];
    const was = (i) => before <= this.#puts[i] && this.#puts[i] < moment;
    this.#last = this.#last.length === wanted.length ? wanted.map((end, i) => (was(i) ? end : followed(this.#last[i], end))) : wanted;
    return this.#last;
  }

  /** Since the moment of the last step, s. */
  since(now) {
    return Math.max(now - this.#published, 0);
  }

  /** The share of a step since then, 0 to 1. */
  part(now) {
    return Math.min(this.since(now) / this.#dt, 1);
  }
}

/** Instruments on their way from one place to another. One that closes or opens there does so when it has come. */
export function between(from, to, part) {
  if (part >= 1 || from.length !== to.length) return to;
  return to.map((end, i) => {
    const start = from[i];
    if (start.kind !== end.kind) return end;
    if (isPut(start, end)) return end;
    return on(start, end, part);
  });
}

function isPut(start, end) {
  return start.position.some((x, k) => Math.abs(x - end.position[k]) > PUT_MM);
}

/** An instrument in the step after another: one that holds tissue goes no farther than the tissue can follow. */
function followed(start, end) {
  if (start.mode !== "grasp" || end.mode !== "grasp") return end;
  const way = Math.hypot(...end.position.map((x, k) => x - start.position[k]));
  const [p, q] = [start, end].map(({ rotation }) => rotation ?? [0, 0, 0, 1]);
  const turn = 2 * Math.acos(Math.min(Math.abs(p.reduce((sum, x, k) => sum + x * q[k], 0)), 1));
  const part = Math.min(HELD_MM / way, HELD_RAD / turn);
  return part < 1 ? on(start, end, part) : end;
}

/** An instrument at a part of its way. */
function on(start, end, part) {
  const position = start.position.map((x, k) => x + part * (end.position[k] - x));
  const [p, q] = [start.rotation ?? [0, 0, 0, 1], end.rotation ?? [0, 0, 0, 1]];
  const sign = p.reduce((sum, x, k) => sum + x * q[k], 0) < 0 ? -1 : 1;
  const turned = p.map((x, k) => sign * x + part * (q[k] - sign * x));
  const length = Math.hypot(...turned);
  return { ...end, mode: start.mode, position, rotation: turned.map((x) => x / length) };
}
