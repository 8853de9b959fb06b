// When to step between frames (docs/guide/frames-and-haptics.md): crates/cli/src/view/clock.rs for any number of instruments.
// Poses of the last frames are kept with their times; a step has the poses of its own moment, which lies between two frames.
const MOST_POSES = 256;
const LOST_S = 0.1; // what was lost for longer is not made up for
const PUT_MM = 40; // an instrument that is farther away than this was put there and did not pass between

export class Clock {
  #dt;
  #next = 0; // the moment of the next step
  #published = 0; // and of the last one
  #started = false;
  #poses = []; // [s, instruments]

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
    if (this.#poses.length === MOST_POSES) this.#poses.shift();
    this.#poses.push([now, instruments]);
  }

  due(now) {
    return this.#poses.length > 0 && now + 1e-9 >= this.#next;
  }

  /** A step is made: the instruments at its moment. */
  step(now) {
    if (now - this.#next > Math.max(2 * this.#dt, LOST_S)) this.#next = now;
    const moment = this.#next;
    this.#next += this.#dt;
    this.#published = moment;
    const poses = this.#poses;
    while (poses.length > 2 && poses[1][0] <= moment) poses.shift();
    const [from, to] = poses;
    if (!to || moment <= from[0]) return from[1];
    return between(from[1], to[1], Math.min((moment - from[0]) / Math.max(to[0] - from[0], 1e-9), 1));
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

/** Instruments on their way from one place to another. */
export function between(from, to, part) {
  if (part >= 1 || from.length !== to.length) return to;
  return to.map((end, i) => {
    const start = from[i];
    if (start.kind !== end.kind) return end;
    if (start.position.some((x, k) => Math.abs(x - end.position[k]) > PUT_MM)) return end;
    const position = start.position.map((x, k) => x + part * (end.position[k] - x));
    const [p, q] = [start.rotation ?? [0, 0, 0, 1], end.rotation ?? [0, 0, 0, 1]];
    const sign = p.reduce((sum, x, k) => sum + x * q[k], 0) < 0 ? -1 : 1;
    const turned = p.map((x, k) => sign * x + part * (q[k] - sign * x));
    const length = Math.hypot(...turned);
    return { ...end, position, rotation: turned.map((x) => x / length) };
  });
}
