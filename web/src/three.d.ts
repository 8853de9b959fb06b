import type { BufferGeometry, Material, Mesh } from "three";
import type { Frame, Tissue, Tool } from "./worker.js";

/** A mesh that is a tissue's surface and follows it. Its coordinates are the bundle's, mm. */
export class SoftTissue extends Mesh<BufferGeometry, Material[]> {
  /** `inside` is what a tool that cuts lays open. */
  constructor(tissue: Tissue, material?: Material, inside?: Material);
  /** The frame that is shown. */
  readonly frame?: Frame;
  /** Call it for each picture, with the instruments where they are; one of another `kind` than press changes the body. */
  update(instruments?: Tool[]): Promise<Frame | undefined>;
/** Shows a frame that was asked for elsewhere. */
  show(frame: Frame): void;
  /** A render mesh follows too: its vertices lie in the tissue or near it. */
  carry(mesh: Mesh<BufferGeometry>): Promise<void>;
/** Frees its geometry and closes the tissue. */
  dispose(): void;
}
