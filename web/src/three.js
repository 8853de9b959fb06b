// A three.js mesh that is a tissue: its surface follows, and so do meshes that it carries. Positions are the bundle's: mm.
import { BufferAttribute, BufferGeometry, Mesh, MeshStandardMaterial, Vector3 } from "three";

/** The surface of a `Tissue` of libupt/worker. */
export class SoftTissue extends Mesh {
  #tissue;
  #rest;
  #attached = []; // {mesh, at, count}: a render mesh, and where its vertices begin in the points
  #points = []; // at rest
  #asked = false;
  #slots = new Uint32Array(0); // triangles of a body that was cut; three equal corners: none
  #inside = new Uint8Array(0);

  constructor(tissue, material = new MeshStandardMaterial({ color: 0xb5533c, roughness: 0.55 }), inside = new MeshStandardMaterial({ color: 0x7d1f1c, roughness: 0.5 })) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(tissue.positions.slice(), 3));
    geometry.setIndex(new BufferAttribute(tissue.faces, 1));
    geometry.computeVertexNormals();
    super(geometry, [material, inside]);
    geometry.addGroup(0, tissue.faces.length, 0);
    this.frustumCulled = false;
    this.#tissue = tissue;
    this.#rest = tissue.positions;
  }

  /** The frame that was taken last. */
  frame;

  /**
   * Asks for the tissue of this moment, unless an answer is still awaited, and shows it once it is there. Call it for each picture.
   * Instruments are in the bundle's coordinates.
   */
  async update(instruments) {
    if (this.#asked) return this.frame;
    this.#asked = true;
    try {
      this.show(await this.#tissue.frame(instruments));
    } finally {
      this.#asked = false;
    }
    return this.frame;
  }

  /** Shows a frame. */
  show(frame) {
    this.frame = frame;
    if (frame.surface) this.#follow(frame.surface);
    const { position } = this.geometry.attributes;
    for (let i = 0; i < frame.displacement.length; i += 1) position.array[i] = this.#rest[i] + frame.displacement[i];
    position.needsUpdate = true;
    this.geometry.computeVertexNormals();
    if (frame.points) for (const one of this.#attached) this.#move(one, frame.points);
  }

  // The surface of a body that a tool has changed: faces that were there, then those that were inside, with the other material.
  #follow({ isNew, vertices, slots, firstVertex, rest, changed, corners, inside }) {
    const longer = (list, length) => {
      const made = new list.constructor(length);
      made.set(isNew ? [] : list);
      return made;
    };
    this.#rest = longer(this.#rest, 3 * vertices);
    this.#rest.set(rest, 3 * firstVertex);
    this.#slots = longer(this.#slots, 3 * slots);
    this.#inside = longer(this.#inside, slots);
    changed.forEach((slot, i) => {
      this.#slots.set(corners.subarray(3 * i, 3 * i + 3), 3 * slot);
      this.#inside[slot] = inside[i];
    });
    const lists = [[], []];
    this.#inside.forEach((which, slot) => {
      const [a, b, c] = this.#slots.subarray(3 * slot, 3 * slot + 3);
      if (a !== b) lists[which].push(a, b, c);
    });
    this.geometry.dispose();
    this.geometry = new BufferGeometry();
    this.geometry.setAttribute("position", new BufferAttribute(this.#rest.slice(), 3));
    this.geometry.setIndex(new BufferAttribute(Uint32Array.from(lists.flat()), 1));
    this.geometry.addGroup(0, lists[0].length, 0);
    this.geometry.addGroup(lists[0].length, lists[1].length, 1);
  }

  /** A render mesh follows the tissue, whose vertices lie in it or near it. */
  async carry(mesh) {
    const { position } = mesh.geometry.attributes;
    mesh.updateWorldMatrix(true, false);
    this.updateWorldMatrix(true, false);
    const toTissue = this.matrixWorld.clone().invert().multiply(mesh.matrixWorld);
    const place = new Vector3();
    const at = this.#points.length / 3;
    for (let i = 0; i < position.count; i += 1) this.#points.push(...place.fromBufferAttribute(position, i).applyMatrix4(toTissue).toArray());
    await this.#tissue.attach(this.#points);
    this.#attached.push({ mesh, at, count: position.count });
    mesh.frustumCulled = false;
  }

  #move({ mesh, at, count }, displacement) {
    const { position } = mesh.geometry.attributes;
    const toMesh = mesh.matrixWorld.clone().invert().multiply(this.matrixWorld);
    const place = new Vector3();
    for (let i = 0; i < count; i += 1) {
      const k = 3 * (at + i);
      place.set(...[0, 1, 2].map((axis) => this.#points[k + axis] + displacement[k + axis])).applyMatrix4(toMesh);
      position.setXYZ(i, place.x, place.y, place.z);
    }
    position.needsUpdate = true;
    mesh.geometry.computeVertexNormals();
  }

  /** Ends the worker and frees the geometry. */
  dispose() {
    this.#tissue.close();
    this.geometry.dispose();
  }
}
