import type { BundleSource, Instrument, ModelInfo, Reading, SceneOptions, Stats, Timing } from "./index.js";

export interface TissueOptions {
  /** By default: the bundle's step for frames, a budget of 30 % of it, a guard that reports. */
  scene?: SceneOptions;
  wasm?: string | URL | WebAssembly.Module;
  /** The module and the bundle lie on the host as `NAME.gz`, for hosts that compress nothing. */
  gzip?: boolean;
  progress?: (done: number, total: number) => void;
  /** In place of the package's own, for bundlers that need to see `new Worker(...)`. */
  worker?: Worker;
}

export interface Frame {
  /** Of the surface's nodes [n,3], mm. */
  displacement: Float32Array;
  /** Of the attached points [p,3], mm. */
  points?: Float32Array;
  /** Where they are in this frame. */
  instruments: Instrument[];
  /** Of the last step. */
  readings: Reading[];
  stats: Stats;
  timing: Timing;
  /** That the frame took to make. */
  frameMs: number;
  recording: boolean;
  replaying: boolean;
}

/** A tissue that a worker steps at the clock's pace. */
export class Tissue {
  static open(source: BundleSource, options?: TissueOptions): Promise<Tissue>;
  readonly info: ModelInfo & { name: string };
  /** The surface's nodes [n]. */
  readonly nodes: Uint32Array;
  /** At rest [n,3], mm. */
  readonly positions: Float32Array;
  /** Triangles [m,3], places in `nodes`. */
  readonly faces: Uint32Array;
  /** 1 where the bundle was made to be touched [n]. */
  readonly domain: Uint32Array;
  readonly stepSeconds: number;
  /** The tissue of this moment. Ask for one for each picture; without frames there are no steps. */
  frame(instruments?: Instrument[]): Promise<Frame>;
  /** Points [p,3] at rest, mm, whose displacements each frame has from here on. */
  attach(points: Iterable<number>): Promise<void>;
  reset(): Promise<void>;
  /** Keeps the instruments of each step; false: no longer. */
  record(on: boolean): Promise<void>;
  /** From rest, makes the recorded steps again. */
  replay(): Promise<void>;
  close(): void;
}
