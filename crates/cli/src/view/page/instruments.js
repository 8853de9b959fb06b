// What the mouse holds: a tool that presses, a blade, an aspirator, a coagulator, as they are shown.
import * as three from "./three.js";
import { ballMaterial, reachMaterial, steelMaterial } from "./drawing.js";
import { HALF_LENGTH } from "./hand.js";

export const KINDS = ["press", "blade", "aspirator", "coagulator"]; // in the order of protocol.rs
const BLADE = 1.5; // half of its breadth, mm
const FLAT = 0.12; // its thickness, of that
const SHAFT = 2; // radius, mm, of what has a reach

/** The radius of the tool that is sent: a blade has its own. */
export const radiusOf = (kind, chosen) => (kind === "blade" ? BLADE : chosen);

export class ShownTool {
  #body = new three.Mesh(new three.BufferGeometry(), steelMaterial());
  #reach = new three.Mesh(new three.BufferGeometry(), reachMaterial());
  #made = "";

  constructor(scene) {
    scene.add(this.#body, this.#reach);
    this.hide();
  }

  hide() {
    this.#body.visible = this.#reach.visible = false;
  }

  /** At a place, of a radius; `kind` is a place in `KINDS`. */
  place(kind, [x, y, z, qx, qy, qz, qw, radius]) {
    const made = `${kind} ${radius}`;
    if (made !== this.#made) this.#make(KINDS[kind], radius);
    this.#made = made;
    for (const part of [this.#body, this.#reach]) {
      part.position.set(x, y, z);
      part.quaternion.set(qx, qy, qz, qw);
    }
    this.#body.visible = true;
    this.#reach.visible = kind > 1;
    // The ball at the tip.
    this.#reach.position.add(new three.Vector3(0, -HALF_LENGTH, 0).applyQuaternion(this.#reach.quaternion));
  }

  #make(kind, radius) {
    const shaft = kind === "press" || kind === "blade" ? radius : Math.min(radius, SHAFT);
    this.#body.geometry.dispose();
    this.#body.geometry = new three.CapsuleGeometry(shaft, 2 * HALF_LENGTH, 8, 24);
    this.#body.scale.set(1, 1, kind === "blade" ? FLAT : 1);
    this.#reach.geometry.dispose();
    this.#reach.geometry = new three.CapsuleGeometry(radius, 0.01, 6, 16);
  }
}

/** A ball that hangs on the organ, as a gall bladder on the liver. */
export class Hanging {
  #ball = new three.Mesh(new three.BufferGeometry(), ballMaterial());
  #radius = 0;

  constructor(scene) {
    scene.add(this.#ball);
    this.#ball.visible = false;
  }

  /** Without a radius there is none. */
  place([x, y, z, radius]) {
    this.#ball.visible = radius > 0;
    this.#ball.position.set(x, y, z);
    if (radius === this.#radius || !(radius > 0)) return;
    this.#radius = radius;
    this.#ball.geometry.dispose();
    this.#ball.geometry = new three.CapsuleGeometry(radius, 0.01, 12, 32);
  }
}
