// The hand that holds the tool: it goes where the mouse points, as fast as a hand does. Behind a fissure the mouse is elsewhere at once.
import { Quaternion, Vector3 } from "./three.js";

export const HALF_LENGTH = 25; // of the tool, mm
const PRESS = 250; // ms until the tool is at its depth
const SPEED = 0.1; // at which the tip follows the mouse at most, mm/ms: the bundles know tools of about this speed
const TURN = 0.004; // at which the tool turns at most, rad/ms
const UP = new Vector3(0, 1, 0); // the tool's axis
const SIDE = new Vector3(1, 0, 0); // along a blade's edge goes its axis, across it this

export class Hand {
  #since; // when it began to press
  #when; // it was moved last
  #wanted; // {point, normal}: where the mouse points
  #heading = new Vector3(); // where it goes
  point; // where it is
  normal;

  constructor(found, now) {
    this.#wanted = found;
    this.#since = now;
    this.#when = now;
    this.point = found.point.clone();
    this.normal = found.normal.clone();
  }

  aim(found) {
    this.#wanted = found;
  }

  /** Whether the tool is at its depth, where it can take hold. */
  pressed(now) {
    return now - this.#since >= PRESS;
  }

  /** The tool: its tip `depth` below the place at rest where the hand is, its axis along the normal there. */
  pose(now, { depth, radius }) {
    const { point, normal } = this.#wanted;
    const passed = now - this.#when;
    this.#when = now;
    const way = point.clone().sub(this.point).clampLength(0, SPEED * passed);
    this.point.add(way);
    this.#heading.multiplyScalar(0.9).add(way);
    const angle = this.normal.angleTo(normal);
    if (angle > 0) this.normal.lerp(normal, Math.min((TURN * passed) / angle, 1)).normalize();
    const ramp = Math.min((now - this.#since) / PRESS, 1);
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
