/** What the library refuses, in its own words. */
export class UptError extends Error {
  /** The name of a status of the C ABI, such as "UPT_ERR_BUNDLE". */
  readonly status: string;
}

/** How the library is loaded. */
export interface LoadOptions {
  /** The module; by default `upt.wasm` beside the package's files. */
  wasm?: WebAssembly.Module | BufferSource | Response | Promise<Response>;
}

/** Loads the library. Each call makes an instance with a memory of its own; a panic ends that instance and nothing else. */
export function load(options?: LoadOptions): Promise<Upt>;

/** Where a bundle is: the address of its folder, `File`s, or bytes by name. */
export type BundleSource = string | URL | Iterable<File> | Record<string, ArrayBuffer | ArrayBufferView>;

/** Where what has come of bundles is kept by name; a `Map` is one. */
export interface Store {
  /** What is kept under a name. */
  get(name: string): Uint8Array | undefined | Promise<Uint8Array | undefined>;
  /** Keeps it. */
  set(name: string, bytes: Uint8Array): unknown;
  /** Keeps it no longer. */
  delete(name: string): unknown;
}

/** Forgets the bundles that this browser keeps. */
export function forgetBundles(): Promise<void>;

/** How a bundle is opened. */
export interface OpenOptions {
  /** In place of the browser's `fetch`. */
  fetch?: (url: URL, options?: RequestInit) => Promise<Response>;
  /** Where the files of an address are kept, by their hashes; by default the browser's Cache API, in Node nowhere. false: nowhere. */
  cache?: boolean | Store;
  /** The files lie there as `NAME.gz`, for hosts that compress nothing. */
  gzip?: boolean;
  /** What `bundle.json` must have, such as the entry of an index. */
  sha256?: string;
  /** Called as files come: bytes so far, and of all. */
  progress?: (done: number, total: number) => void;
  /** The same bits as on every other machine, for replays and lockstep. */
  portable?: boolean;
}

/** The library, loaded. */
export interface Upt {
  /** Its version. */
  readonly version: string;
  /** A bundle made ready to step. */
  open(source: BundleSource, options?: OpenOptions): Promise<Model>;
}

/** The nodes or triangles of a mesh that `Model.indices` gives. */
export type IndexSet = "surfaceNodes" | "domainNodes" | "fixedNodes" | "surfaceFaces" | "domainFaces" | "tets";

/** The fields of `upt_model_info`. */
export interface ModelInfo {
  /** K, the nodes of the mesh. */
  node_count: number;
  /** Tetrahedra. */
  tet_count: number;
  /** Triangles of the boundary. */
  surface_face_count: number;
  /** Nodes that instruments may touch. */
  domain_node_count: number;
  /** Nodes held where they are. */
  held_node_count: number;
  /** Length of a step, s. */
  dt: number;
  /** Longest push that it was made for, mm. */
  max_push_mm: number;
  /** Memory of the model. */
  memory_bytes: number;
  /** Time to open it. */
  load_seconds: number;
  /** The length of a step that suits hosts that show frames, s. */
  frame_step_s: number;
  [field: string]: number;
}

/** What a scene is made with. */
export interface SceneOptions {
  /** Length of a step, 0.01 to 0.05 s; by default the bundle's. */
  stepSeconds?: number;
  /** By the elements, while there is contact: a number of them, 1 to 64. */
  corrections?: "recommended" | "none" | "auto" | number;
  /** Corrections stop below this estimated error, mm. */
  targetMm?: number;
  /** No correction starts later than this in a step, µs, but the first of a step without tools. */
  budgetUs?: number;
  /** The flag UPT_FLAG_ERROR rises above this estimated error, mm. */
  errorLimitMm?: number;
  /** Damping of the tissue, 1/s; by default the bundle's. */
  dampingPerSecond?: number;
  /** The most substeps of a step that would miss the target, 1 for none, up to 8; by default the bundle's. */
  substeps?: number;
  /** What is done with a state that is no longer plausible. */
  guard?: "hold" | "report" | "blend";
  /** Tissue at rest is stepped too. */
  neverSleeps?: boolean;
}

/** A rigid instrument where it is at the end of the step. */
export interface Instrument {
  /** Centre, mm, in the mesh's frame. */
  position: ArrayLike<number> & Iterable<number>;
  /** Unit quaternion x, y, z, w. */
  rotation?: ArrayLike<number> & Iterable<number>;
  /** A capsule by default; along its local y. */
  shape?: "sphere" | "capsule" | "box" | "spatula";
  /** Of a ball or capsule, or a spatula's corners, mm. */
  radius?: number;
  /** Half length of a capsule's axis, its local y, mm. */
  halfLength?: number;
  /** Half sizes of a box or spatula, mm. */
  halfExtents?: ArrayLike<number>;
  /** Slides by default; a grasp holds what was near when it began. */
  mode?: "slide" | "grasp";
  /** Coulomb's coefficient. */
  friction?: number;
  /** A grasp tears off at this pull, mN. */
  tearOff?: number;
}

/** A force at a point of the tissue; `Model.locate` finds the nodes. */
export interface PointForce {
  /** Four nodes around the point. */
  nodes: ArrayLike<number> & Iterable<number>;
  /** 0 or more, with the sum 1. */
  weights: ArrayLike<number> & Iterable<number>;
  /** mN. */
  force: ArrayLike<number>;
}

/** A spring from a point of the tissue to something else; its place in the list is its identity. */
export interface Tie {
  /** One node, or a point of a face: three. */
  nodes: number[];
  /** Of three nodes, with the sum 1. */
  weights?: number[];
  /** What it is tied to; the mesh's frame, which goes with the support, by default. */
  to?: "support" | "world" | "instrument" | "tissue";
  /** The far end, mm; of an instrument in its frame. */
  place?: number[];
  /** Its place among the step's instruments. */
  instrument?: number;
  /** The other point of the tissue. */
  otherNodes?: number[];
  /** Its weights, as those of `nodes`. */
  otherWeights?: number[];
  /** N/m. */
  stiffness: number;
  /** It pulls where it is longer than this, mm. */
  slack?: number;
  /** N s/m. */
  damping?: number;
  /** It breaks under more than this, mN; 0: never. */
  breakForce?: number;
  /** It pushes where it is shorter. */
  pushes?: boolean;
}

/** Where a support is. */
export interface Pose {
  /** mm. */
  position?: ArrayLike<number>;
  /** Unit quaternion x, y, z, w. */
  rotation?: ArrayLike<number>;
}

/** What acts on the tissue at the end of a step, beside instruments; in scenes with corrections. */
export interface Loads {
  /** m/s², in the mesh's frame; with a support in the world's. */
  gravity?: ArrayLike<number>;
  /** That under which the mesh was scanned: the difference acts. By default the bundle's. */
  gravityAtRest?: ArrayLike<number>;
  /** On the nodes [K,3], mN. */
  forces?: ArrayLike<number>;
  /** At points of the tissue, at most 256. */
  pointForces?: PointForce[];
  /** From outside, Pa, on the boundary triangles with all corners among the nodes; without nodes on the domain. */
  pressures?: { pascal: number; nodes?: ArrayLike<number> }[];
  /** Every tie in every step, in the same order. */
  ties?: Tie[];
  /** Where what holds the body is, in every step where it moves. */
  support?: Pose;
  /** What support groups of the bundle do, in every step. */
  supports?: (Pose & { group: number; letGo?: boolean; displacements?: ArrayLike<number> })[];
}

/** A region whose nodes are tied by one call; stiffness, damping and strength are those of all ties together. */
export interface BedOptions {
  /** Of the region, mm. */
  centre?: ArrayLike<number>;
  /** Of the region, mm. */
  radius?: number;
  /** The region as nodes instead. */
  nodes?: ArrayLike<number>;
  /** N/m. */
  stiffness: number;
  /** mN; 0: none breaks. */
  breakForce?: number;
  /** N s/m. */
  damping?: number;
  /** Of each tie, mm. */
  slack?: number;
  /** From each node to where it is tied, mm. */
  offset?: ArrayLike<number>;
}

/** The fields of `upt_tie_reading`. */
export interface TieReading {
  /** 1 where it holds no more. */
  broken: number;
  /** 1 where it broke in this step. */
  broke: number;
  /** On the tissue, mN. */
  force: [number, number, number];
  /** Between its ends. */
  length_mm: number;
}

/** The fields of `upt_instrument_reading`. */
export interface Reading {
  /** Points of the tissue that push or hold it. */
  contact_count: number;
  /** On the instrument, mN. */
  force: [number, number, number];
  /** About its position, mN mm. */
  torque: [number, number, number];
  /** How deep tissue lies inside of it, mm. */
  penetration_mm: number;
  /** 1 where its grasp tore off in this step. */
  torn: number;
  /** What is left of the contact problem, mm. */
  residual_mm: number;
}

/** The fields of `upt_scene_stats`. */
export interface Stats {
  /** UPT_FLAG_*. */
  flags: number;
  /** Steps since creation or reset. */
  step_count: number;
  /** Largest displacement, mm. */
  max_displacement_mm: number;
  /** Corrections that the last step made. */
  corrections: number;
  /** Its estimated error, mm; 0 without corrections. */
  error_mm: number;
  /** Above 1: outside of what the model was made for. */
  indicator: number;
  /** 1 where the tissue is at rest and steps cost nothing. */
  sleeping: number;
  [field: string]: number;
}

/** The fields of `upt_scene_timing`: what the last step and its stages took, ms. */
export interface Timing {
  /** Steps since creation or reset, the last of which this is of. */
  step_count: number;
  /** The whole step. */
  step_ms: number;
  /** Corrections. */
  corrections_ms: number;
  /** Contact with instruments, a part of the corrections. */
  contact_ms: number;
  [field: string]: number;
}

/** A bundle made ready to step. */
export interface Model {
  /** For the C ABI. */
  readonly handle: number;
  /** Counts and the length of a step. */
  readonly info: ModelInfo;
  /** Name, hash and more. */
  describe(): { name: string; bundle_sha256: string; instruction_set: string; [field: string]: unknown };
  /** At rest [K,3], mm. */
  positions(): Float32Array;
  /** Nodes, three for each face, or four for each tetrahedron. */
  indices(set: IndexSet): Uint32Array;
  /** The points of the mesh at places at rest [n, 3], mm. */
  locate(places: number[][]): { nodes: number[]; weights: number[] }[];
  /** A tissue at rest. */
  scene(options?: SceneOptions): Scene;
  /** Its scenes stay usable. */
  close(): void;
}

/** What an operation did: the fields of `upt_cut`. */
export interface Cut {
  /** 1 where the body is another one: its surface wants an update. */
  is_changed: number;
  /** Nodes of the body now. */
  node_count: number;
  /** Nodes that the operation has added. */
  copied_count: number;
  /** New area, mm². */
  area_mm2: number;
  /** What the body has lost, mm³. */
  removed_mm3: number;
  /** Pieces that nothing holds. */
  fragment_count: number;
  /** On the blade, mN. */
  force: [number, number, number];
}

/** How a blade cuts. */
export interface CutOptions {
  /** Calls with the same number are one blade that goes on. */
  stroke?: number;
  /** Points of the edge. */
  points?: number;
  /** What new area takes, J/m². */
  fractureEnergy?: number;
  /** With how much the blade must be pushed before it cuts, mN. */
  threshold?: number;
  /** How much it is pushed, mN. */
  pushed?: number;
  /** Where the edge is sharp; zeros: everywhere. */
  ahead?: ArrayLike<number>;
}

/** The closed surface of a body. Vertices and slots of triangles keep their numbers. */
export interface Surface {
  /** All of it: the first surface, and after another body was put back. */
  isNew: boolean;
  /** The first vertex that is new. */
  firstVertex: number;
  /** [vertices,3], mm. */
  rest: Float32Array;
  /** [slots,3]: three zeros where there is none. */
  triangles: Uint32Array;
  /** 1 where the triangle was inside of the intact body [slots]. */
  inside: Uint8Array;
  /** Slots with other corners than before. */
  changed: Uint32Array;
}

/** One tissue that is stepped. Arrays that a call returns are views of the module's memory, good until the next call. */
export interface Scene {
  /** For the C ABI. */
  readonly handle: number;
  /** Displacements [n,3] of the region after a step with the instruments where they are at its end, mm. */
  step(instruments?: Instrument[], timeSeconds?: number, loads?: Loads): Float32Array;
  /** The ties of a bed, from where its nodes are in the last state. */
  bed(options: BedOptions): Tie[];
  /** Of the last step's ties, in their order. */
  tieReadings(count: number): TieReading[];
  /** The tissue `when` seconds after the last step, with the instruments there: of the region, of the attached points, or of the surface's vertices. */
  present(when: number, instruments?: Instrument[], options?: { points?: boolean; surface?: boolean; loads?: Loads }): Float32Array;
  /** The last published state, as `step` gives it, or of the attached points, [p,3], mm. */
  read(options?: { points?: boolean }): Float32Array;
  /** Of the last step's instruments, in their order. */
  readings(): Reading[];
  /** What the last step was. */
  stats(): Stats;
  /** What it took. */
  timing(): Timing;
  /** The nodes that are shown from here on; none means all. */
  setRegion(nodes?: ArrayLike<number> & Iterable<number>): void;
  /** Points [p,3] at rest, mm, that `read` and `present` show with `points`. */
  attachPoints(points: ArrayLike<number> & Iterable<number>): void;
  /** Of the body: copies that cuts have made included. */
  readonly nodeCount: number;
  /** A blade's edge goes from pose to pose, [n, points, 3] mm, and cuts what it passes. */
  cut(poses: number[][][], options?: CutOptions): Cut;
  /** Takes tissue inside of an instrument, up to so many mm³, the deepest first. */
  remove(instrument: Instrument, mostMm3: number): Cut;
  /** Parts tissue that is longer than so many times its length at rest, before a step: a tear grows from step to step. */
  tear(stretch: number, options?: { most?: number; stroke?: number }): Cut;
  /** Multiplies the stiffness of elements of the intact mesh. */
  scaleStiffness(elements: ArrayLike<number> & Iterable<number>, factor: number): Cut;
  /** Takes the pieces that nothing holds out of the body. */
  dropFragments(): Cut;
  /** The surface of the body as it is now, and what has changed since the last call. */
  updateSurface(): Surface;
  /** State and body. */
  save(): Uint8Array;
  /** Back to what `save` gave, to the bit. */
  restore(snapshot: Uint8Array): void;
  /** Begins to record what the scene is given, for `upt replay --verify`, with a hash after every so many steps (1); 0 ends it. */
  record(every?: number): void;
  /** The lines of the recording that were not taken before; together they make the file. */
  takeRecord(): string;
  /** Back to rest, with the intact body. */
  reset(): void;
  /** Frees it. */
  close(): void;
}
