// The C ABI for a program whose memory is another one: Unity's WebGL player, whose C# calls it by unity-plugin/Runtime/Plugins/WebGL/libupt.jslib. What a call's
// pointers show is copied into the module's memory before it, and back after it. Threads there are none: a submitted step is made at once.
import * as abi from "./abi.js";
import { files } from "./files.js";
import { get } from "./get.js";
import { Module, UptError } from "./module.js";

// A parameter is a name and, where it is no number that passes as it is: `l` a number of 64 bits, `s` a C string, `<` what is read, `>` what is written, `=` both: a
// type, of an array times its length. K: the nodes of the model's mesh.
const CALLS = parsed(`
upt_init options:<upt_init_options
upt_shutdown
upt_version
upt_abi_version
upt_last_error
upt_status_name status
upt_set_log callback user level
upt_providers out:>u8*capacity capacity:l needed:>u64
upt_model_create path:s options:<upt_model_options out:>u32
upt_model_destroy model
upt_model_read_info model out:=upt_model_info
upt_model_describe model out:>u8*capacity capacity:l needed:>u64
upt_model_read_positions model out:>u32*count count:l
upt_model_read_indices model set out:>u32*capacity capacity:l needed:>u64
upt_model_read_support model group name:>u8*name_capacity name_capacity:l nodes:>u32*node_capacity node_capacity:l needed:>u64
upt_model_read_region model region name:>u8*name_capacity name_capacity:l nodes:>u32*node_capacity node_capacity:l needed:>u64
upt_model_locate_points model places:<u32*3*count count:l nodes:>u32*4*count weights:>u32*4*count
upt_scene_create model options:<upt_scene_options out:>u32
upt_scene_destroy scene
upt_scene_reset scene
upt_scene_step scene input:<upt_input out:>u32*out_count out_count:l
upt_scene_step_field scene displacement:<u32*3*K collision:<u32*3*K out:>u32*out_count out_count:l
upt_scene_read scene view:<upt_view out:>u32*out_count out_count:l
upt_scene_submit scene input:<upt_input
upt_scene_poll scene
upt_scene_wait scene timeout_ms
upt_scene_sample scene alpha view:<upt_view out:>u32*out_count out_count:l
upt_scene_set_region scene nodes:<u32*count count:l
upt_scene_decode scene view:<upt_view out:>u32*out_count out_count:l
upt_scene_attach_points scene points:<u32*3*count count:l
upt_scene_read_instruments scene out:=upt_instrument_reading*count count:l
upt_scene_read_instrument_contacts scene out:=upt_instrument_contact*capacity capacity:l needed:>u64
upt_hull_create points:<u32*3*point_count point_count:l faces:<u32*3*face_count face_count:l out:>u32
upt_hull_destroy hull
upt_scene_read_ties scene out:=upt_tie_reading*count count:l
upt_scene_tie_points scene places:<u32*3*count count:l nodes:>u32*3*count weights:>u32*3*count
upt_scene_bed scene bed:<upt_bed ties:=upt_tie*capacity capacity:l needed:>u64
upt_scene_cut scene stroke points:<u32*3*pose_count*edge_count pose_count:l edge_count:l out:=upt_cut
upt_scene_cut_with scene blade:<upt_blade stroke points:<u32*3*pose_count*edge_count pose_count:l edge_count:l out:=upt_cut
upt_scene_remove scene instrument:<upt_instrument most_mm3 out:=upt_cut
upt_scene_tear scene stroke stretch most out:=upt_cut
upt_scene_scale_stiffness scene elements:<u32*count count:l factor out:=upt_cut
upt_scene_drop_fragments scene out:=upt_cut
upt_scene_read_node_count scene out:>u64
upt_scene_update_surface scene out:=upt_surface
upt_scene_read_surface scene rest:>u32*3*vertex_count vertex_count:l triangles:>u32*3*triangle_count inside:>u8*triangle_count triangle_count:l changed:>u32*changed_count changed_count:l
upt_scene_read_surface_positions scene out:>u32*out_count out_count:l
upt_scene_present scene input:<upt_input when view:<upt_view out:>u32*out_count out_count:l
upt_haptics_create scene options:<upt_haptics_options out:>u32
upt_haptics_render haptics pose:<upt_haptic_pose out:=upt_haptic_force
upt_haptics_destroy haptics
upt_scene_contacts_from_instruments scene instruments:<upt_instrument*instrument_count instrument_count:l contact_nodes:>u32*capacity contact_vectors:>u32*3*capacity capacity:l contact_count:>u64
upt_scene_read_contact_force scene out:>u32*out_count out_count:l
upt_scene_read_stats scene out:=upt_scene_stats
upt_scene_read_timing scene out:=upt_scene_timing
upt_scene_save scene out:>u8*capacity capacity:l needed:>u64
upt_scene_restore scene bytes:<u8*count count:l
upt_scene_record scene every
upt_scene_take_record scene out:>u8*capacity capacity:l needed:>u64
`);

// What pointers in structs show; those that are not here are of native builds alone, and become NULL.
const INNER = {
  upt_init_options: { onnxruntime_path: undefined },
  upt_scene_options: { mesh_path: undefined },
  upt_haptics_options: { tool: "upt_instrument" },
  upt_input: {
    instruments: "upt_instrument*instrument_count",
    contact_nodes: "u32*contact_count",
    contact_vectors: "u32*3*contact_count",
    collision: "u32*3*K",
    displacement: "u32*3*K",
    forces: "u32*3*K",
    pressures: "upt_pressure*pressure_count",
    ties: "upt_tie*tie_count",
    supports: "upt_support*support_count",
    point_forces: "upt_point_force*point_force_count",
  },
  upt_pressure: { nodes: "u32*node_count" },
  upt_bed: { nodes: "u32*node_count" },
  upt_support: { displacements: "u32*displacement_count" },
  upt_view: { nodes: "u32*node_count" },
};
const SIZES = { u8: 1, u32: 4, u64: 8 };

function parsed(text) {
  const parameter = (word) => {
    const [name, kind = "i"] = word.split(":");
    return { name, kind: kind[0], what: kind.slice(1) };
  };
  const lines = text.trim().split("\n").map((line) => line.split(" "));
  return new Map(lines.map(([name, ...words]) => [name, words.map(parameter)]));
}

/** Calls that this passes on: every one of upt.h. */
export const names = [...CALLS.keys()];

/** Begins: the module beside this file, and a program's memory, `{buffer(), malloc(bytes), free(at)}`. */
export async function start(program, wasm = get(new URL("./upt.wasm", import.meta.url))) {
  return new Bridge(await Module.start(wasm), program);
}

class Bridge {
  #module;
  #program;
  #bundles = new Map(); // address: {files, done, total, error}
  #nodes = new Map(); // scene: K
  #shown = new Map(); // scene: nodes of the region
  #finished = new Set(); // scenes with a step that was submitted, and made
  #texts = new Map(); // text: where it lies in the program's memory
  #said; // an error that was not the module's

  constructor(module, program) {
    this.#module = module;
    this.#program = program;
  }

  /** Fetches a bundle, for `upt_model_create` with the same address; asks how far that is. */
  bundle(address) {
    const known = this.#bundles.get(address);
    if (known) return known;
    const coming = { done: 0, total: 0, files: undefined, error: undefined };
    const progress = (done, total) => Object.assign(coming, { done, total });
    this.#bundles.set(address, coming);
    files(address, { progress }).then(
      (list) => Object.assign(coming, { files: list }),
      (error) => Object.assign(coming, { error: error.message }),
    );
    return coming;
  }

  /** A call of the C ABI: numbers of 64 bits are one BigInt, or two numbers as older tools pass them. */
  call(name, given) {
    const parameters = CALLS.get(name);
    const values = {};
    let at = 0;
    const isSplit = given.length > parameters.length;
    for (const { name: own, kind } of parameters) {
      values[own] = given[at];
      if (kind === "l" && isSplit) values[own] = (given[at] >>> 0) + 2 ** 32 * (given[(at += 1)] >>> 0);
      if (kind === "l") values[own] = Number(values[own]);
      at += 1;
    }
    values.K = this.#nodes.get(values.scene) ?? 0;
    try {
      const own = this[name];
      const status = own ? own.call(this, values) : this.#pass(name, parameters, values);
      if (name !== "upt_last_error") this.#said = undefined;
      return status;
    } catch (error) {
      if (!(error instanceof UptError)) throw error;
      this.#said = error.message;
      return abi[error.status];
    }
  }

  upt_version() {
    return this.#text(this.#module.text(this.#module.call("upt_version")));
  }

  upt_status_name({ status }) {
    return this.#text(this.#module.text(this.#module.call("upt_status_name", status)));
  }

  // Good until the next error, as in the library.
  upt_last_error() {
    const text = this.#said ?? this.#module.text(this.#module.call("upt_last_error"));
    const before = this.#texts.get("");
    if (before) this.#program.free(before);
    this.#texts.delete("");
    this.#texts.set("", this.#put(text));
    return this.#texts.get("");
  }

  upt_set_log({ callback, level }) {
    if (callback) throw new UptError("UPT_ERR_UNSUPPORTED", "upt_set_log: the module cannot call back into Unity");
    return this.#module.call("upt_set_log", 0, 0, level);
  }

  upt_model_create({ path, options, out }) {
    const address = this.#read(path);
    const bundle = this.#bundles.get(address);
    if (!bundle?.files) throw new UptError("UPT_ERR_IO", `upt_model_create: ${address} ${bundle?.error ? `was not to be had: ${bundle.error}` : "has not been fetched: wait until UptModel.IsReady"}`);
    const portable = options ? new Uint8Array(this.#program.buffer())[options + abi.upt_model_options.fields.portable[1]] : 0;
    this.#module.giveFiles(bundle.files);
    const handle = this.#module.openFiles({ portable });
    new DataView(this.#program.buffer()).setUint32(out, handle, true);
    return abi.UPT_OK;
  }

  upt_scene_create(values) {
    const status = this.#pass("upt_scene_create", CALLS.get("upt_scene_create"), values);
    if (status < 0) return status;
    const scene = new DataView(this.#program.buffer()).getUint32(values.out, true);
    this.#nodes.set(scene, this.#module.filled(abi.upt_model_info, "upt_model_read_info", values.model).node_count);
    this.#shown.set(scene, 0);
    return status;
  }

  upt_scene_destroy({ scene }) {
    for (const list of [this.#nodes, this.#shown, this.#finished]) list.delete(scene);
    return this.#module.call("upt_scene_destroy", scene);
  }

  upt_scene_set_region(values) {
    const status = this.#pass("upt_scene_set_region", CALLS.get("upt_scene_set_region"), values);
    if (status >= 0) this.#shown.set(values.scene, values.nodes ? values.count : 0);
    return status;
  }

  upt_scene_submit(values) {
    if (this.#finished.has(values.scene)) throw new UptError("UPT_ERR_BUSY", "upt_scene_submit: the step before is not collected; poll or wait first");
    const { scene } = values;
    const floats = 3 * (this.#shown.get(scene) || this.#module.out("upt_scene_read_node_count", scene));
    const step = [...CALLS.get("upt_scene_submit"), { name: "out", kind: "i" }, { name: "out_count", kind: "l" }];
    const status = this.#module.withRoom(4 * floats, (out) => this.#pass("upt_scene_step", step, { ...values, out, out_count: floats }));
    if (status >= 0) this.#finished.add(scene);
    return status;
  }

  upt_scene_poll({ scene }) {
    return this.#finished.delete(scene) ? abi.UPT_OK : this.#module.call("upt_scene_poll", scene);
  }

  upt_scene_wait({ scene, timeout_ms: most }) {
    return this.#finished.delete(scene) ? abi.UPT_OK : this.#module.call("upt_scene_wait", scene, most);
  }

  #pass(name, parameters, values) {
    const rooms = []; // [place, bytes, place in the program where it goes back to]
    try {
      const passed = parameters.map(({ name: own, kind, what }) => {
        const value = values[own];
        if (kind === "i") return value;
        if (kind === "l") return BigInt(value);
        return value ? this.#carried(value, kind, what, values, rooms) : 0;
      });
      const status = this.#module.call(name, ...passed);
      const [to, from] = [new Uint8Array(this.#program.buffer()), this.#module.bytes(0)];
      for (const [at, bytes, back] of rooms) if (back) to.set(from.subarray(at, at + bytes), back);
      return status;
    } finally {
      for (const [at, bytes] of rooms) this.#module.free(at, bytes);
    }
  }

  // A pointer's target, in the module's memory.
  #carried(from, kind, what, values, rooms) {
    const [type, ...lengths] = what.split("*");
    const count = lengths.reduce((product, length) => product * Number(values[length] ?? length), 1);
    const size = SIZES[type] ?? abi[type].size;
    const at = this.#module.alloc(size * count);
    rooms.push([at, size * count, kind === "<" ? 0 : from]);
    this.#module.bytes(at, size * count).set(new Uint8Array(this.#program.buffer(), from, size * count));
    for (const [field, shows] of Object.entries(INNER[type] ?? {})) {
      for (let i = 0; i < count; i += 1) this.#inner(at + size * i, type, field, shows, values, rooms);
    }
    return at;
  }

  #inner(at, type, field, shows, values, rooms) {
    const place = at + abi[type].fields[field][1];
    const from = this.#module.view.getUint32(place, true);
    const within = { ...this.#module.read(at, abi[type]), K: values.K };
    const to = from && shows ? this.#carried(from, "<", shows, within, rooms) : 0;
    this.#module.view.setUint32(place, to, true);
  }

  #read(at) {
    const bytes = new Uint8Array(this.#program.buffer(), at);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }

  #text(text) {
    if (!this.#texts.has(text)) this.#texts.set(text, this.#put(text));
    return this.#texts.get(text);
  }

  #put(text) {
    const bytes = new TextEncoder().encode(`${text}\0`);
    const at = this.#program.malloc(bytes.length);
    new Uint8Array(this.#program.buffer()).set(bytes, at);
    return at;
  }

  /** A text in the program's memory, until `free`. */
  put(text) {
    return this.#put(text);
  }
}

globalThis.libuptForUnity = { start, names };
