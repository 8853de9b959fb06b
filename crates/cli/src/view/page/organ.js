// The organ as it is shown: its surface and, once it has been cut, what was inside of it. Vertices and slots of triangles keep their numbers, so that
// a change brings only what is new (protocol.rs).
import * as three from "./three.js";
import { insideMaterial, tissueMaterial, turnNormals } from "./drawing.js";

const PALE = new three.Color(0xd8bfb0);
const GREY = new three.Color(0x8f9399); // where the model was not trained to be touched
const RED = new three.Color(0xc8402a); // where it is displaced
const HARD = new three.Color(0x6e5a45); // coagulated
const FLESH = [new three.Color(0x7d1f1c), new three.Color(0xb4504a)]; // what was inside
const SPARE = 1024; // vertices and slots that there is room for beyond those that there are

// A pattern that fills the tissue, 0 to 1: on new faces it goes on through the depth.
function grain(x, y, z) {
  const bend = 1.7 * Math.sin(0.31 * x + 0.17 * y) + 1.3 * Math.sin(0.23 * y - 0.29 * z);
  return 0.5 + 0.3 * Math.sin(0.9 * z + bend) + 0.2 * Math.sin(1.9 * x - 1.3 * y + bend);
}

export class Organ {
  #count; // vertices
  #rest; // their places at rest [n,3]
  #outer; // colours at rest, of the surface that there was
  #slots; // corners of each triangle; three equal ones: none
  #inside; // 1 for the triangles that were inside of the intact body
  shown; // the meshes that are drawn
  picked; // at rest, where the mouse finds its place

  constructor(rest, faces, domain) {
    this.shown = [new three.Mesh(new three.BufferGeometry(), tissueMaterial()), new three.Mesh(new three.BufferGeometry(), insideMaterial())];
    this.picked = new three.Mesh(new three.BufferGeometry(), this.shown[0].material);
    for (const mesh of this.shown) mesh.frustumCulled = false;
    this.#count = 0;
    this.#slots = Uint32Array.from(faces);
    this.#inside = new Uint8Array(faces.length / 3);
    this.#grow(rest, domain);
    this.#order();
  }

  get vertices() {
    return this.#count;
  }

  /** The surface as three.js's geometry, whole: for files. */
  get whole() {
    const part = (name, size) => ({ array: this.shown[0].geometry.attributes[name].array.subarray(0, size * this.#count), count: this.#count });
    return { attributes: { position: part("position", 3), normal: part("normal", 3) }, index: { array: this.#slots.filter((_, i) => !this.#empty(i)) } };
  }

  /** Middle of the vertices that the bundle was made to be touched at. */
  static middle(rest, domain) {
    const middle = new three.Vector3();
    for (let i = 0; i < domain.length; i += 1) if (domain[i]) middle.add(new three.Vector3().fromArray(rest, 3 * i));
    return middle.divideScalar(domain.reduce((sum, x) => sum + x, 0));
  }

  /** What has changed; `data` as protocol.rs says. */
  take({ vertices, slots, first_vertex: first, changed, hardened, is_new: isNew }, data) {
    let at = 0;
    const next = (Kind, count) => {
      const part = new Kind(data, at, count);
      at += 4 * count;
      return part;
    };
    const added = vertices - first;
    const rest = next(Float32Array, 3 * added);
    const domain = next(Uint32Array, added);
    const list = next(Uint32Array, changed);
    const corners = next(Uint32Array, 3 * changed);
    const inside = next(Uint32Array, changed);
    const hard = next(Uint32Array, hardened);
    if (isNew) this.#count = 0;
    this.#grow(rest, domain);
    const [before, flags] = isNew ? [[], []] : [this.#slots, this.#inside];
    if (isNew || 3 * slots > before.length) {
      this.#slots = new Uint32Array(3 * slots);
      this.#inside = new Uint8Array(slots);
      this.#slots.set(before);
      this.#inside.set(flags);
    }
    list.forEach((slot, i) => {
      this.#slots.set(corners.subarray(3 * i, 3 * i + 3), 3 * slot);
      this.#inside[slot] = inside[i];
    });
    this.#paint(hard);
    this.#order();
  }

  /** The frame's displacements; false where they are of another surface. */
  move(displacement, most) {
    if (displacement.length !== 3 * this.#count) return false;
    const { position, color } = this.shown[0].geometry.attributes;
    const [positions, colours, rest, base] = [position.array, color.array, this.#rest, this.#outer];
    for (let i = 0; i < displacement.length; i += 3) {
      const x = displacement[i];
      const y = displacement[i + 1];
      const z = displacement[i + 2];
      positions[i] = rest[i] + x;
      positions[i + 1] = rest[i + 1] + y;
      positions[i + 2] = rest[i + 2] + z;
      const share = Math.min(Math.sqrt(x * x + y * y + z * z) / most, 1);
      colours[i] = base[i] + share * (RED.r - base[i]);
      colours[i + 1] = base[i + 1] + share * (RED.g - base[i + 1]);
      colours[i + 2] = base[i + 2] + share * (RED.b - base[i + 2]);
    }
    position.needsUpdate = true;
    color.needsUpdate = true;
    for (const mesh of this.shown) if (mesh.visible) turnNormals(mesh.geometry);
    return true;
  }

  /** What holds the organ is so far up. */
  lift(height) {
    for (const mesh of [...this.shown, this.picked]) {
      mesh.position.z = height;
      mesh.updateMatrixWorld();
    }
  }

  #empty(i) {
    const first = i - (i % 3);
    return this.#slots[first] === this.#slots[first + 1];
  }

  // Takes vertices after those that there are.
  #grow(rest, domain) {
    const before = this.#count;
    this.#count += domain.length;
    const room = this.#rest ? this.#rest.length / 3 : 0;
    if (this.#count > room) {
      const size = 3 * (before === 0 ? this.#count + SPARE : Math.ceil(1.25 * this.#count) + SPARE);
      const wider = (array) => {
        const made = new Float32Array(size);
        if (array) made.set(array.subarray(0, 3 * before));
        return made;
      };
      this.#rest = wider(this.#rest);
      this.#outer = wider(this.#outer);
      const [outer, inner] = this.shown.map((mesh) => mesh.geometry);
      const attribute = (from) => new three.BufferAttribute(wider(from), 3);
      const { position, normal, color } = outer.attributes;
      for (const geometry of [outer, inner, this.picked.geometry]) geometry.dispose();
      outer.setAttribute("position", attribute(position?.array));
      outer.setAttribute("normal", attribute(normal?.array));
      outer.setAttribute("color", attribute(color?.array));
      inner.setAttribute("position", outer.attributes.position);
      inner.setAttribute("normal", attribute());
      inner.setAttribute("color", attribute(inner.attributes.color?.array));
      this.picked.geometry.setAttribute("position", new three.BufferAttribute(this.#rest, 3));
      this.picked.geometry.setAttribute("normal", attribute());
    }
    this.#rest.set(rest, 3 * before);
    this.shown[0].geometry.attributes.position.array.set(rest, 3 * before);
    for (let i = 0; i < domain.length; i += 1) this.#colour(before + i, domain[i] ? PALE : GREY);
  }

  #colour(vertex, colour, inner) {
    const [x, y, z] = this.#rest.subarray(3 * vertex, 3 * vertex + 3);
    const flesh = inner ?? FLESH[0].clone().lerp(FLESH[1], grain(x, y, z));
    colour.toArray(this.#outer, 3 * vertex);
    flesh.toArray(this.shown[1].geometry.attributes.color.array, 3 * vertex);
    this.#soft[vertex] = colour === HARD ? this.#soft[vertex] : colour;
  }

  #soft = []; // colours of the vertices before coagulation

  // Coagulated are these and no others.
  #paint(hard) {
    for (const vertex of this.#hard) this.#colour(vertex, this.#soft[vertex] ?? PALE);
    this.#hard = Array.from(hard);
    for (const vertex of this.#hard) this.#colour(vertex, HARD, HARD);
    this.shown[1].geometry.attributes.color.needsUpdate = true;
  }

  #hard = [];

  // Which triangles each mesh draws.
  #order() {
    const slots = this.#slots;
    const lists = [[], [], []];
    for (let i = 0; i < slots.length; i += 3) {
      if (this.#empty(i)) continue;
      for (const list of [lists[this.#inside[i / 3]], lists[2]]) list.push(slots[i], slots[i + 1], slots[i + 2]);
    }
    [...this.shown, this.picked].forEach((mesh, i) => {
      const { geometry } = mesh;
      if (!geometry.index || geometry.index.array.length < lists[i].length) {
        geometry.dispose();
        geometry.setIndex(new three.BufferAttribute(new Uint32Array(lists[i].length + 3 * SPARE), 1));
      }
      geometry.index.array.fill(0);
      geometry.index.array.set(lists[i]);
      geometry.index.needsUpdate = true;
      geometry.setDrawRange(0, lists[i].length);
      turnNormals(geometry);
      mesh.visible = lists[i].length > 0;
    });
    this.picked.geometry.computeBoundingSphere();
  }
}
