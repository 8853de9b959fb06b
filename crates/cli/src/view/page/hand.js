// The hand that holds the tool: it goes where the mouse points, as fast as a hand does. Behind a fissure the mouse is elsewhere at once.
import { Quaternion, Vector3 } from "./three.js";

export const HALF_LENGTH = 25; // of the tool, mm
const PRESS = 250; // ms until the tool is at its depth
const SPEED = 0.1; // at which the tip follows the mouse at most, mm/ms: the bundles know tools of about this speed
const TURN = 0.004; // at which the tool turns at most, rad/ms
const SETTLED = 2; // steps until the tissue has followed it there
const LATE = 100; // ms: where pictures come later the hand waits, and goes no farther than the tissue can be seen to follow
const UP = new Vector3(0, 1, 0); // the tool's axis
const SIDE = new Vector3(1, 0, 0); // along a blade's edge goes its axis, across it this

export class Hand {
  #pressed = 0; // how long, ms
  #deep; // the step at which it had come to its depth
  #when; // it was moved last
  #wanted; // {point, normal}: where the mouse points
  #heading = new Vector3(); // where it goes
  point; // where it is
  normal;

  constructor(found, now) {
    this.#wanted = found;
    this.#when = now;
    this.point = found.point.clone();
    this.normal = found.normal.clone();
  }

  aim(found) {
    this.#wanted = found;
  }

  /** Whether the tool can take hold: it is at its depth, and the tissue around it, after `steps` of the scene. */
  pressed(steps) {
    if (this.#pressed < PRESS) return false;
    if (this.#deep === undefined || steps < this.#deep) this.#deep = steps;
    return steps > this.#deep + SETTLED;
  }

  /** The tool: its tip `depth` below the place at rest where the hand is, its axis along the normal there. What holds tissue does not turn around its axis. */
  pose(now, { depth, radius, grasp }) {
    const { point, normal } = this.#wanted;
    const passed = Math.min(now - this.#when, LATE);
    this.#when = now;
    const way = point.clone().sub(this.point).clampLength(0, SPEED * passed);
    this.point.add(way);
    if (!grasp) this.#heading.multiplyScalar(0.9).add(way);
    const angle = this.normal.angleTo(normal);
    if (angle > 0) this.normal.lerp(normal, Math.min((TURN * passed) / angle, 1)).normalize();
    this.#pressed += passed;
    const ramp = Math.min(this.#pressed / PRESS, 1);
    const position = this.point.clone().addScaledVector(this.normal, HALF_LENGTH + radius - ramp * depth);
    return { position: position.toArray(), rotation: this.#rotation().toArray() };
  }

  // Its axis along the normal, its side turned to where it goes.
  #rotation() {
    const upright = new Quaternion().setFromUnitVectors(UP, this.normal);
    const ahead = this.#heading.clone().projectOnPlane(this.normal);
    if (ahead.length() < 0.05) return upright;
    const side = SIDE.clone().applyQuaternion(upright);
    const angle = Math.atan2(side.clone().cross(ahead).dot(this.normal), side.dot(ahead));
    return new Quaternion().setFromAxisAngle(this.normal, angle).multiply(upright);
  }
}
