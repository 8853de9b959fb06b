import type { BundleSource, Instrument, ModelInfo, Reading, SceneOptions, Stats, Timing } from "./index.js";

/** How a tissue is opened. */
export interface TissueOptions {
  /** By default: the bundle's step for frames, a budget of 30 % of it, a guard that reports. */
  scene?: SceneOptions;
/** The module; by default `upt.wasm` beside the package's files. */
  wasm?: string | URL | WebAssembly.Module;
  /** The module and the bundle lie on the host as `NAME.gz`, for hosts that compress nothing. */
  gzip?: boolean;
/** Called as files come: bytes so far, and of all. */
  progress?: (done: number, total: number) => void;
  /** false: each frame has arrays of its own, also where the page is isolated and they could be shared. */
  shared?: boolean;
  /** false: nothing is kept for the next visit. */
  cache?: boolean;
  /** What `bundle.json` must have, such as the entry of an index. */
  sha256?: string;
  /** The same bits as on every other machine, for replays and lockstep. */
  portable?: boolean;
  /** In place of the package's own, for bundlers that need to see `new Worker(...)`. */
  worker?: Worker;
}

/** What a tool does: it touches the tissue, or changes the body at each step. The blade's edge is 20 mm from the tool's tip up; the others reach the ball at it. */
export interface Tool extends Instrument {
/** By default it presses. */
  kind?: "press" | "blade" | "aspirator" | "coagulator";
}

/** What is new of the surface. Vertices and slots of triangles keep their numbers. */
export interface SurfaceNews {
  /** All of it. */
  isNew: boolean;
/** Vertices of the whole surface. */
  vertices: number;
/** Slots of triangles of the whole surface. */
  slots: number;
/** The first vertex that is new. */
  firstVertex: number;
  /** At rest, of the vertices from `firstVertex` on [.,3], mm. */
  rest: Float32Array;
  /** Slots with other corners. */
  changed: Uint32Array;
  /** These corners [.,3]: three zeros where there is no triangle. */
  corners: Uint32Array;
  /** 1 for each changed slot whose triangle was inside of the intact body. */
  inside: Uint32Array;
  /** Vertices that were coagulated. */
  hardened: Uint32Array;
}

/** What strokes have done so far. */
export interface SurgeryState {
/** New surface, mm². */
  areaMm2: number;
/** What the body has lost, mm³. */
  removedMm3: number;
  /** Nodes that cuts have added. */
  copies: number;
  /** Strokes that can be undone. */
  undos: number;
  /** On the blade, mN. */
  force: number[];
  /** What the last change of the body took, ms. */
  changeMs: number;
  /** Why the last operation was refused. */
  refused?: string;
}

/** The tissue of one picture. Where the page is isolated (COOP, COEP), `displacement` and `points` are in memory that the worker writes again three frames later. */
export interface Frame {
  /** Of the surface's nodes [n,3], mm; from the first stroke of a tool that cuts on, of the vertices of `surface`. */
  displacement: Float32Array;
  /** Of the attached points [p,3], mm. */
  points?: Float32Array;
  /** What has changed of the surface since the last frame. */
  surface?: SurfaceNews;
/** Cuts, aspiration and coagulation so far. */
  surgery: SurgeryState;
  /** Where they are in this frame. */
  instruments: Tool[];
  /** Of the last step. */
  readings: Reading[];
/** Of the last step. */
  stats: Stats;
/** Of the last step. */
  timing: Timing;
  /** What the frame took to make, ms. */
  frameMs: number;
/** Whether instruments are kept, for `replay`. */
  recording: boolean;
/** Whether recorded steps are made again. */
  replaying: boolean;
}

/** A tissue that a worker steps at the clock's pace. */
export class Tissue {
/** Opens a bundle in a worker of its own. */
  static open(source: BundleSource, options?: TissueOptions): Promise<Tissue>;
/** Counts and the bundle's name. */
  readonly info: ModelInfo & { name: string };
  /** The surface's nodes [n]. */
  readonly nodes: Uint32Array;
  /** At rest [n,3], mm. */
  readonly positions: Float32Array;
  /** Triangles [m,3], places in `nodes`. */
  readonly faces: Uint32Array;
  /** 1 where the bundle was made to be touched [n]. */
  readonly domain: Uint32Array;
/** Length of a step, s. */
  readonly stepSeconds: number;
  /** Whether frames lie in memory that the worker shares. */
  readonly isShared: boolean;
  /** The tissue of this moment. Ask for one for each picture; without frames there are no steps. */
  frame(instruments?: Tool[]): Promise<Frame>;
  /** Points [p,3] at rest, mm, whose displacements each frame has from here on. */
  attach(points: Iterable<number>): Promise<void>;
  /** The body before the last stroke; false where there is none. */
  undo(): Promise<boolean>;
/** Back to rest, with the intact body. */
  reset(): Promise<void>;
  /** Keeps the instruments of each step; false: no longer. */
  record(on: boolean): Promise<void>;
  /** From rest, makes the recorded steps again. */
  replay(): Promise<void>;
/** Ends the worker. */
  close(): void;
}
