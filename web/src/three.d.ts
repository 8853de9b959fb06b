import type { BufferGeometry, Material, Mesh } from "three";
import type { Instrument } from "./index.js";
import type { Frame, Tissue } from "./worker.js";

/** A mesh that is a tissue's surface and follows it. Its coordinates are the bundle's, mm. */
export class SoftTissue extends Mesh<BufferGeometry> {
  constructor(tissue: Tissue, material?: Material);
  /** The one that is shown. */
  readonly frame?: Frame;
  /** Call it for each picture, with the instruments where they are. */
  update(instruments?: Instrument[]): Promise<Frame | undefined>;
  show(frame: Frame): void;
  /** A render mesh follows too: its vertices lie in the tissue or near it. */
  carry(mesh: Mesh<BufferGeometry>): Promise<void>;
  dispose(): void;
}
