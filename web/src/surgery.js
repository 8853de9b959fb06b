// What a blade, an aspirator and a coagulator do to the body of a scene from step to step, in strokes that can be undone: crates/cli/src/view/surgery.rs
// for the browser. Places are those of the tissue at rest that the hand points at. A blade's edge goes up from the tool's tip along its axis; an aspirator is the
// ball at the tip, and so is what a coagulator reaches.
import { UptError } from "./module.js";

const EDGE_MM = 20; // of a blade, from its tip
const FRACTURE_ENERGY = 10; // J/m²
const STILL_MM = 0.02; // a blade that goes less far since its last step waits
const PUT_MM = 40; // one that goes farther was put there
const RATE = 500; // of the aspirator, mm³/s
const HARDER = 4; // what coagulation multiplies stiffness by, once an element
const MOST_UNDONE = 16; // strokes, and the bytes that bodies before them hold: the last one stays, however large
const MOST_UNDONE_BYTES = 64 << 20;
const KINDS = ["blade", "aspirator", "coagulator"];
const NOTHING = { areaMm2: 0, removedMm3: 0, copies: 0 };

/** Whether a tool changes the body, in place of touching it. */
export function isCutting({ kind = "press" }) {
  if (kind !== "press" && !KINDS.includes(kind)) throw new UptError("UPT_ERR_ARGUMENT", `the tool's kind is ${kind}; it can be press, ${KINDS.join(", ")}`);
  return kind !== "press";
}

export class Surgery {
  #scene;
  #model;
  #elements; // {corners, middles}, once they are asked for
  #hard = new Set(); // elements that were coagulated
  #changed = false; // since the host was told of the surface
  #whole = false; // the host is told all of it
  #last; // the tool of the step before
  #stroke = 0;
  #waits = false; // until the tool is lifted: its stroke has been taken back
  #pending; // the body before the stroke that goes on, until it has done something
  #effective = false; // the stroke has done something
  #undone = [];
  /** The scene shows the vertices of its surface, not the region. */
  begun = false;
  /** What all strokes so far have done. */
  account = NOTHING;
  /** What the tissue does to a blade, mN, and how long the last change took, ms. */
  force = [0, 0, 0];
  changeMs = 0;
  /** Why the last operation was refused, until it is asked. */
  #refused;

  constructor(scene, model) {
    this.#scene = scene;
    this.#model = model;
  }

  /** For a frame: the account, strokes that can be undone, and what was refused since the last one. */
  told() {
    const refused = this.#refused;
    this.#refused = undefined;
    return { ...this.account, undos: this.#undone.length, force: this.force, changeMs: this.changeMs, refused };
  }

  /** What the cutting tool among some instruments does in the step of `seconds` that begins. */
  operate(instruments, seconds) {
    const [tool, more] = instruments.filter(isCutting);
    if (more) throw new UptError("UPT_ERR_ARGUMENT", "two tools that cut; one at a time changes the body");
    const last = this.#last;
    this.#last = tool;
    this.force = [0, 0, 0];
    this.#waits &&= tool !== undefined;
    if (this.#waits) {
      this.#last = undefined;
      return;
    }
    const goesOn = last !== undefined && tool !== undefined && last.kind === tool.kind;
    if (last && !goesOn) this.#end();
    if (!tool) return;
    if (!goesOn) this.#begin();
    const begun = performance.now();
    try {
      const made = this.#work(tool, goesOn ? last : undefined, seconds);
      if (made?.is_changed) this.#note(made, performance.now() - begun);
    } catch (error) {
      this.#refused = error.message;
    }
  }

  #work(tool, from, seconds) {
    const at = along(tool, -(tool.halfLength ?? 0));
    if (tool.kind === "blade") return from && this.#cut(from, tool);
    if (tool.kind === "aspirator") return this.#scene.remove({ shape: "sphere", position: at, radius: tool.radius }, RATE * seconds);
    return this.#coagulate(at, tool.radius);
  }

  #cut(from, to) {
    const edges = [from, to].map((tool) => {
      const tip = -(tool.halfLength ?? 0) - (tool.radius ?? 0);
      return [along(tool, tip), along(tool, tip + EDGE_MM)];
    });
    const most = Math.max(...[0, 1].map((end) => distance(edges[0][end], edges[1][end])));
    if (most < STILL_MM || most > PUT_MM || swept(edges) < STILL_MM * EDGE_MM) return undefined;
    return this.#scene.cut(edges, { stroke: this.#stroke, fractureEnergy: FRACTURE_ENERGY });
  }

  #coagulate(at, radius) {
    const { middles } = this.#tets();
    const own = [];
    for (let i = 0; 3 * i < middles.length; i += 1) {
      if (!this.#hard.has(i) && distance(middles.subarray(3 * i, 3 * i + 3), at) < radius) own.push(i);
    }
    if (own.length === 0) return undefined;
    const made = this.#scene.scaleStiffness(own, HARDER);
    for (const element of own) this.#hard.add(element);
    return made;
  }

  #tets() {
    if (this.#elements) return this.#elements;
    const corners = this.#model.indices("tets");
    const positions = this.#model.positions();
    const middles = new Float32Array((3 * corners.length) / 4);
    corners.forEach((node, i) => {
      for (let k = 0; k < 3; k += 1) middles[3 * (i >> 2) + k] += 0.25 * positions[3 * node + k];
    });
    this.#elements = { corners, middles };
    return this.#elements;
  }

  #begin() {
    if (!this.begun) {
      this.#scene.setRegion();
      this.begun = true;
      this.#changed = true;
    }
    this.#stroke += 1;
    this.#effective = false;
    this.#pending = { snapshot: this.#scene.save(), account: this.account, hard: new Set(this.#hard) };
  }

  // The stroke is over: pieces that nothing holds leave.
  #end() {
    this.#pending = undefined;
    if (!this.#effective) return;
    this.#effective = false;
    const dropped = this.#scene.dropFragments();
    this.account = { ...this.account, removedMm3: this.account.removedMm3 + dropped.removed_mm3 };
    this.#changed ||= dropped.is_changed !== 0;
  }

  #note(made, ms) {
    this.changeMs = ms;
    this.force = made.force;
    this.account = {
      areaMm2: this.account.areaMm2 + made.area_mm2,
      removedMm3: this.account.removedMm3 + made.removed_mm3,
      copies: made.node_count - this.#model.info.node_count,
    };
    this.#changed = true;
    this.#effective = true;
    if (!this.#pending) return;
    this.#undone.push(this.#pending);
    this.#pending = undefined;
    const bytes = () => this.#undone.reduce((sum, { snapshot }) => sum + snapshot.length, 0);
    while (this.#undone.length > 1 && (this.#undone.length > MOST_UNDONE || bytes() > MOST_UNDONE_BYTES)) this.#undone.shift();
  }

  /** The body before the last stroke; false where there is none. */
  undo() {
    const before = this.#undone.pop();
    if (!before) return false;
    this.#scene.restore(before.snapshot);
    this.account = before.account;
    this.#hard = before.hard;
    this.#stop();
    return true;
  }

  /** The intact body is back. */
  reset() {
    this.account = NOTHING;
    this.#hard.clear();
    this.#undone = [];
    this.#stop();
    this.#waits = false; // the clock begins anew, without the poses before
  }

  #stop() {
    this.#waits ||= this.#last !== undefined;
    this.#last = undefined;
    this.#pending = undefined;
    this.#effective = false;
    this.force = [0, 0, 0];
    this.#changed = this.begun;
  }

  /** What was new has not arrived: the next news are of the whole surface. */
  repeat() {
    this.#changed = true;
    this.#whole = true;
  }

  /** What is new of the surface since it was last asked; nothing where the body is what it was. */
  news() {
    if (!this.#changed) return undefined;
    this.#changed = false;
    const updated = this.#scene.updateSurface();
    const { rest, triangles, inside } = updated;
    const isNew = updated.isNew || this.#whole;
    const firstVertex = isNew ? 0 : updated.firstVertex;
    const changed = isNew ? Uint32Array.from(inside.keys()) : updated.changed;
    this.#whole = false;
    const corners = new Uint32Array(3 * changed.length);
    changed.forEach((slot, i) => corners.set(triangles.subarray(3 * slot, 3 * slot + 3), 3 * i));
    const hardened = new Set();
    if (this.#hard.size > 0) {
      const { corners: nodes } = this.#tets();
      for (const element of this.#hard) for (let k = 0; k < 4; k += 1) hardened.add(nodes[4 * element + k]);
    }
    return {
      isNew,
      vertices: rest.length / 3,
      slots: inside.length,
      firstVertex,
      rest: rest.slice(3 * firstVertex),
      changed,
      corners,
      inside: changed.map((slot) => inside[slot]),
      hardened: Uint32Array.from(hardened),
    };
  }
}

// The point of the tool's axis, local y, so far from its middle.
function along({ position, rotation = [0, 0, 0, 1] }, far) {
  const [x, y, z, w] = rotation;
  const axis = [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)];
  return axis.map((part, k) => position[k] + far * part);
}

function distance(a, b) {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Area between two places of an edge, mm²: none where it goes along itself.
function swept([[a, b], [c, d]]) {
  const minus = (p, q) => p.map((x, k) => x - q[k]);
  const [p, q] = [minus(d, a), minus(c, b)];
  return 0.5 * Math.hypot(p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]);
}
