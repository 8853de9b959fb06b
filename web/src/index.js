// libupt in WebAssembly: soft tissue that instruments press, grasp and pull, in real time. Lengths are mm, forces mN.
import * as abi from "./abi.js";
import { files } from "./files.js";
import { get } from "./get.js";
import { choice, instrumentFields } from "./instruments.js";
import { bed, located, tieReadings, withLoads } from "./loads.js";
import { Module, UptError } from "./module.js";
export { forgetBundles } from "./store.js";
export { UptError };

const SETS = {
  surfaceNodes: abi.UPT_SET_SURFACE_NODES,
  domainNodes: abi.UPT_SET_DOMAIN_NODES,
  fixedNodes: abi.UPT_SET_FIXED_NODES,
  surfaceFaces: abi.UPT_SET_SURFACE_FACES,
  domainFaces: abi.UPT_SET_DOMAIN_FACES,
  tets: abi.UPT_SET_TETS,
};
const CORRECTIONS = { recommended: abi.UPT_CORRECTIONS_RECOMMENDED, none: abi.UPT_CORRECTIONS_NONE, auto: abi.UPT_CORRECTIONS_AUTO };
const GUARDS = { hold: abi.UPT_GUARD_HOLD, report: abi.UPT_GUARD_REPORT, blend: abi.UPT_GUARD_BLEND };

/** Loads the library. Each call makes an instance with a memory of its own. */
export async function load({ wasm = get(new URL("./upt.wasm", import.meta.url)), isa } = {}) {
  return new Upt(await Module.start(wasm, isa));
}

/** An instance of the library. */
class Upt {
  /** The module: for the C ABI itself. */
  module;

  constructor(module) {
    this.module = module;
  }

  get version() {
    return this.module.text(this.module.call("upt_version"));
  }

  /** Opens a bundle: the address of its folder, `File`s, or bytes by name. */
  async open(source, { portable = false, ...options } = {}) {
    const given = await files(source, options);
    const { module } = this;
    module.giveFiles(given);
    return new Model(module, module.openFiles({ portable: portable ? 1 : 0 }));
  }
}

/** A bundle made ready to step. */
class Model {
  #module;
  /** For the C ABI. */
  handle;
  #info;

  constructor(module, handle) {
    this.#module = module;
    this.handle = handle;
  }

  /** What the model is: the fields of `upt_model_info`. */
  get info() {
    this.#info ??= this.#module.filled(abi.upt_model_info, "upt_model_read_info", this.handle);
    return this.#info;
  }

  /** Name, hash of the bundle and more. */
  describe() {
    const bytes = this.#module.out("upt_model_describe", this.handle, 0, 0n);
    return this.#module.withRoom(bytes, (at) => {
      this.#module.run("upt_model_describe", this.handle, at, BigInt(bytes), 0);
      return JSON.parse(this.#module.text(at));
    });
  }

  /** Rest positions [K,3], mm. */
  positions() {
    const count = 3 * this.info.node_count;
    return this.#module.withRoom(4 * count, (at) => {
      this.#module.run("upt_model_read_positions", this.handle, at, BigInt(count));
      return this.#module.floats(at, count).slice();
    });
  }

  /** An index set, such as "surfaceFaces". */
  indices(set) {
    const number = choice(SETS, set, "the index set");
    const count = this.#module.out("upt_model_read_indices", this.handle, number, 0, 0n);
    return this.#module.withRoom(4 * count, (at) => {
      this.#module.run("upt_model_read_indices", this.handle, number, at, BigInt(count), 0);
      return this.#module.words(at, count).slice();
    });
  }

  /** The points of the mesh at places at rest [n, 3], mm: four nodes and their weights each, for `pointForces`. */
  locate(places) {
    return located(this.#module, this.handle, places);
  }

  /** A scene at rest. */
  scene(options) {
    return new Scene(this.#module, this.handle, this.info.node_count, options);
  }

  /** Frees the model. Its scenes stay usable. */
  close() {
    this.#module.run("upt_model_destroy", this.handle);
  }
}

/** One tissue that is stepped. */
class Scene {
  #module;
  /** For the C ABI. */
  handle;
  #room; // {at, floats}: for displacements
  #tools = { at: 0, room: 0, count: 0 };
  #input; // upt_input, then upt_view
  #shown; // nodes of the region
  #hasRegion = false;
  #points = 0;
  #vertices = 0; // of the surface as it was last updated
  #closed = false;

  constructor(module, model, nodes, options = {}) {
    const { corrections = "recommended", guard = "hold", stepSeconds = 0, ...more } = options;
    const values = {
      "corrections.mode": typeof corrections === "number" ? abi.UPT_CORRECTIONS_COUNT : choice(CORRECTIONS, corrections, "corrections"),
      "corrections.count": typeof corrections === "number" ? corrections : 0,
      "corrections.target_mm": more.targetMm ?? 0,
      "corrections.budget_us": more.budgetUs ?? 0,
      guard_policy: choice(GUARDS, guard, "guard"),
      step_s: stepSeconds,
      damping_per_s: more.dampingPerSecond ?? 0,
      error_limit_mm: more.errorLimitMm ?? 0,
      substeps: more.substeps ?? 0,
      sleep: more.neverSleeps ? abi.UPT_SWITCH_OFF : 0,
    };
    this.#module = module;
    this.handle = module.withRoom(abi.upt_scene_options.size, (at) => {
      module.write(at, abi.upt_scene_options, values);
      return module.out("upt_scene_create", model, at);
    });
    this.#shown = nodes;
    this.#input = module.alloc(abi.upt_input.size + abi.upt_view.size);
    this.#room = { at: module.alloc(12 * nodes), floats: 3 * nodes };
  }

  /** A step that instruments drive, and loads beside them: displacements [n,3] of the region, a view of the module's memory until the next call. */
  step(instruments = [], timeS = 0, loads = undefined) {
    return this.#driven(this.#shown, { instruments, timeS, loads }, (...given) => this.#module.run("upt_scene_step", this.handle, ...given));
  }

  /** The ties of a bed, to be passed in every step. */
  bed(options) {
    return bed(this.#module, this.handle, options);
  }

  /** What each of `count` ties of the last step does: the fields of `upt_tie_reading`. */
  tieReadings(count) {
    return tieReadings(this.#module, this.handle, count);
  }

  /** The tissue `when` seconds after the last step, with the instruments there; as `step`, or of the attached points, or of the surface's vertices. */
  present(when, instruments = [], { points = false, surface = false, loads = undefined } = {}) {
    const view = this.#viewed({ points, surface });
    const count = points ? this.#points : surface ? this.#vertices : this.#shown;
    const show = (input, ...out) => this.#module.run("upt_scene_present", this.handle, input, when, view, ...out);
    return this.#driven(count, { instruments, timeS: 0, loads }, show);
  }

  /** Displacements in the last state, of the region or of the attached points. */
  read({ points = false } = {}) {
    const view = this.#viewed({ points });
    return this.#filled(points ? this.#points : this.#shown, (at, floats) => this.#module.run("upt_scene_read", this.handle, view, at, floats));
  }

  // Where the view is that the calls take.
  #viewed({ points, surface = false }) {
    const view = this.#input + abi.upt_input.size;
    this.#refuseIfClosed();
    this.#module.write(view, abi.upt_view, { kind: points ? abi.UPT_VIEW_POINTS : surface ? abi.UPT_VIEW_SURFACE : abi.UPT_VIEW_REGION });
    return view;
  }

  /** What the last step did to its instruments: the fields of `upt_instrument_reading`. */
  readings() {
    const { size } = abi.upt_instrument_reading;
    const { count } = this.#tools;
    this.#refuseIfClosed();
    return this.#module.withRoom(size * count, (at) => {
      for (let i = 0; i < count; i += 1) this.#module.write(at + size * i, abi.upt_instrument_reading, {});
      this.#module.run("upt_scene_read_instruments", this.handle, at, BigInt(count));
      return Array.from({ length: count }, (_, i) => this.#module.read(at + size * i, abi.upt_instrument_reading));
    });
  }

  /** What the last step took, in milliseconds: the fields of `upt_scene_timing`. */
  timing() {
    return this.#module.filled(abi.upt_scene_timing, "upt_scene_read_timing", this.handle);
  }

  /** What the last step did: the fields of `upt_scene_stats`. */
  stats() {
    return this.#module.filled(abi.upt_scene_stats, "upt_scene_read_stats", this.handle);
  }

  /** The nodes that are shown from here on; none means all. */
  setRegion(nodes = []) {
    this.#withList(nodes, (at) => this.#module.run("upt_scene_set_region", this.handle, at, BigInt(nodes.length)));
    this.#hasRegion = nodes.length > 0;
    this.#shown = nodes.length || this.nodeCount;
  }

  /** Nodes of the body, copies that cuts have made included. */
  get nodeCount() {
    return this.#module.out("upt_scene_read_node_count", this.handle);
  }

  /**
   * A blade's edge goes from place to place, `poses` [n, points, 3] mm, and cuts what it passes. Calls with the same `stroke` are one blade that goes on. What it
   * did: the fields of `upt_cut`.
   */
  cut(poses, { stroke = 0, points = 2, fractureEnergy = 0, threshold = 0, pushed = 0, ahead = [0, 0, 0] } = {}) {
    const list = Float32Array.from(poses.flat(2));
    const count = BigInt(Math.floor(list.length / (3 * points)));
    return this.#module.withRoom(abi.upt_blade.size, (blade) => {
      this.#module.write(blade, abi.upt_blade, { fracture_energy: fractureEnergy, threshold, pushed, ahead });
      const run = (at, out) => this.#module.run("upt_scene_cut_with", this.handle, blade, stroke, at, count, BigInt(points), out);
      return this.#withList(list, (at) => this.#operate((out) => run(at, out)));
    });
  }

  /** Takes tissue that lies inside of an instrument, up to so many mm³, the deepest first. */
  remove(instrument, mostMm3) {
    this.#write([instrument], 0);
    return this.#operate((out) => this.#module.run("upt_scene_remove", this.handle, this.#tools.at, mostMm3, out));
  }

  /** Parts tissue that is longer than so many times its length at rest, before a step: a tear grows from step to step. */
  tear(stretch, { most = 16, stroke = 0 } = {}) {
    return this.#operate((out) => this.#module.run("upt_scene_tear", this.handle, stroke, stretch, most, out));
  }

  /** Multiplies the stiffness of elements of the intact mesh. */
  scaleStiffness(elements, factor) {
    const run = (at, out) => this.#module.run("upt_scene_scale_stiffness", this.handle, at, BigInt(elements.length), factor, out);
    return this.#withList(elements, (at) => this.#operate((out) => run(at, out)));
  }

  /** Takes the pieces that nothing holds out of the body. */
  dropFragments() {
    return this.#operate((out) => this.#module.run("upt_scene_drop_fragments", this.handle, out));
  }

  /** The closed surface of the body as it is now, and what of it is new since the last time. */
  updateSurface() {
    const module = this.#module;
    const found = module.filled(abi.upt_surface, "upt_scene_update_surface", this.handle);
    const [vertices, slots, changed] = [found.vertex_count, found.triangle_count, found.changed_count];
    const counts = [12 * vertices, 12 * slots, 4 * changed, slots];
    this.#vertices = vertices;
    return module.withRoom(counts.reduce((sum, bytes) => sum + bytes), (rest) => {
      const [triangles, changes] = [rest + counts[0], rest + counts[0] + counts[1]];
      const inside = changes + counts[2];
      module.run("upt_scene_read_surface", this.handle, rest, BigInt(vertices), triangles, inside, BigInt(slots), changes, BigInt(changed));
      return {
        isNew: found.is_new !== 0,
        firstVertex: found.first_vertex,
        rest: module.floats(rest, 3 * vertices).slice(),
        triangles: module.words(triangles, 3 * slots).slice(),
        inside: module.bytes(inside, slots).slice(),
        changed: module.words(changes, changed).slice(),
      };
    });
  }

  /** A snapshot: the state, of the body too. */
  save() {
    const count = this.#module.out("upt_scene_save", this.handle, 0, 0n);
    return this.#module.withRoom(count, (at) => {
      this.#module.run("upt_scene_save", this.handle, at, BigInt(count), 0);
      return this.#module.bytes(at, count).slice();
    });
  }

  /** Goes back to a snapshot of this scene's, or of another of its bundle and options. */
  restore(snapshot) {
    this.#module.withRoom(snapshot.length, (at) => {
      this.#module.bytes(at, snapshot.length).set(snapshot);
      this.#module.run("upt_scene_restore", this.handle, at, BigInt(snapshot.length));
    });
    if (!this.#hasRegion) this.#shown = this.nodeCount;
  }

  /** Points [p,3] at rest, mm, that follow the tissue from here on. */
  attachPoints(points) {
    const floats = Float32Array.from(points);
    this.#withList(floats, (at) => this.#module.run("upt_scene_attach_points", this.handle, at, BigInt(floats.length / 3)));
    this.#points = floats.length / 3;
  }

  /** Begins to record what the scene is given, for `upt replay --verify`, with a hash after every so many steps; 0 ends it. */
  record(every = 1) {
    this.#module.run("upt_scene_record", this.handle, every);
  }

  /** The lines of the recording that were not taken before; together they make the file. */
  takeRecord() {
    const size = this.#module.out("upt_scene_take_record", this.handle, 0, 0n);
    return this.#module.withRoom(8 + size, (at) => {
      this.#module.run("upt_scene_take_record", this.handle, at + 8, BigInt(size), at);
      return new TextDecoder().decode(this.#module.bytes(at + 8, size));
    });
  }

  /** Back to rest. */
  reset() {
    this.#module.run("upt_scene_reset", this.handle);
    if (!this.#hasRegion) this.#shown = this.nodeCount;
  }

  /** Frees the scene. */
  close() {
    this.#module.run("upt_scene_destroy", this.handle);
    this.#closed = true;
    this.#module.free(this.#room.at, 4 * this.#room.floats);
    this.#module.free(this.#tools.at, this.#tools.room);
    this.#module.free(this.#input, abi.upt_input.size + abi.upt_view.size);
  }

  // Changes the body; without a region, all its nodes are shown.
  #operate(run) {
    this.#refuseIfClosed();
    return this.#module.withRoom(abi.upt_cut.size, (out) => {
      this.#module.write(out, abi.upt_cut, {});
      run(out);
      const made = this.#module.read(out, abi.upt_cut);
      if (!this.#hasRegion) this.#shown = made.node_count;
      return made;
    });
  }

  // The library's own refusal, before anything is written to memory that has gone back.
  #refuseIfClosed() {
    if (this.#closed) this.reset();
  }

  // Calls with an input and room for `count` vectors, and looks at it.
  #driven(count, { instruments, timeS, loads }, call) {
    return withLoads(this.#module, loads, (fields) => {
      const input = this.#write(instruments, timeS, fields);
      return this.#filled(count, (at, floats) => call(input, at, floats));
    });
  }

  // Calls with room for `count` vectors, and looks at it.
  #filled(count, call) {
    this.#refuseIfClosed();
    const floats = 3 * count;
    if (floats > this.#room.floats) {
      this.#module.free(this.#room.at, 4 * this.#room.floats);
      this.#room = { at: this.#module.alloc(4 * floats), floats };
    }
    call(this.#room.at, BigInt(floats));
    return this.#module.floats(this.#room.at, floats);
  }

  // Numbers of 32 bits for the time of a call; NULL for none.
  #withList(list, use) {
    if (list.length === 0) return use(0);
    return this.#module.withRoom(4 * list.length, (at) => {
      const room = list instanceof Float32Array ? this.#module.floats(at, list.length) : this.#module.words(at, list.length);
      room.set(list);
      return use(at);
    });
  }

  #write(instruments, timeS, loads = {}) {
    this.#refuseIfClosed();
    const { size } = abi.upt_instrument;
    const needed = size * instruments.length;
    if (needed > this.#tools.room) {
      this.#module.free(this.#tools.at, this.#tools.room);
      this.#tools = { at: this.#module.alloc(needed), room: needed };
    }
    this.#tools.count = instruments.length;
    instruments.forEach((tool, i) => this.#module.write(this.#tools.at + size * i, abi.upt_instrument, instrumentFields(tool, i)));
    this.#module.write(this.#input, abi.upt_input, {
      ...loads,
      instruments: needed ? this.#tools.at : 0,
      instrument_count: instruments.length,
      time_s: timeS,
    });
    return this.#input;
  }
}
