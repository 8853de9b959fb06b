/* libupt: real-time soft tissue for game engines and simulators.
 *
 * Written by `cargo xtask header` from src/ffi/; conventions: docs/reference/abi.md.
 * SPDX-License-Identifier: Apache-2.0 OR MIT
 */

#ifndef UPT_H
#define UPT_H

#include <stdint.h>

/* An enumeration of a fixed width: `enum` in C++ and C23, where debuggers name its values and compilers
 * check them, else an integer of this name beside an `enum` of the values. */
#if (defined(__cplusplus) && (__cplusplus >= 201103L || defined(_MSC_VER))) || (defined(__STDC_VERSION__) && __STDC_VERSION__ >= 202311L)
#define UPT_ENUM(name, integer) \
  enum name : integer; \
  typedef enum name name; \
  enum name : integer
#else
#define UPT_ENUM(name, integer) \
  typedef integer name; \
  enum name##_values
#endif

/**
 * What a call returns: 0 is success, positive values are not errors, negative values are errors.
 */
UPT_ENUM(upt_status, int32_t) {
  /**
   * Success.
   */
  UPT_OK = 0,
  /**
   * The submitted step has not finished.
   */
  UPT_PENDING = 1,
  /**
   * A required pointer is NULL.
   */
  UPT_ERR_NULL = -1,
  /**
   * A size, index, enum or range is wrong.
   */
  UPT_ERR_ARGUMENT = -2,
  /**
   * This library does not know this `struct_size`.
   */
  UPT_ERR_STRUCT_SIZE = -3,
  /**
   * Not a live handle of this type.
   */
  UPT_ERR_HANDLE = -4,
  /**
   * The scene is in use by another thread or has a step in flight.
   */
  UPT_ERR_BUSY = -5,
  /**
   * An input holds NaN or Inf.
   */
  UPT_ERR_NON_FINITE = -6,
  /**
   * The call does not fit the state (for instance: wait without submit).
   */
  UPT_ERR_STATE = -7,
  /**
   * This build or this bundle cannot do it.
   */
  UPT_ERR_UNSUPPORTED = -8,
  /**
   * There is not enough memory for the call.
   */
  UPT_ERR_OUT_OF_MEMORY = -9,
  /**
   * ONNX Runtime is missing, too old or broken; the message lists what was tried.
   */
  UPT_ERR_RUNTIME = -20,
  /**
   * No provider of the list can run the model.
   */
  UPT_ERR_PROVIDER = -21,
  /**
   * A file cannot be read.
   */
  UPT_ERR_IO = -30,
  /**
   * A bundle is invalid; the message names the file and the field.
   */
  UPT_ERR_BUNDLE = -31,
  /**
   * The version of a bundle or snapshot is not supported.
   */
  UPT_ERR_VERSION = -32,
  /**
   * A snapshot is damaged or belongs to another model.
   */
  UPT_ERR_SNAPSHOT = -33,
  /**
   * The guard refused the new state; the last good state stays.
   */
  UPT_ERR_GUARD = -40,
  /**
   * A bug in the library; the scene can only be destroyed.
   */
  UPT_ERR_PANIC = -90
};

/**
 * What runs the networks of a model.
 */
UPT_ENUM(upt_provider, int32_t) {
  /**
   * ONNX Runtime's CPU provider and the native kernels.
   */
  UPT_PROVIDER_CPU = 0,
  /**
   * NVIDIA CUDA.
   */
  UPT_PROVIDER_CUDA = 1,
  /**
   * NVIDIA TensorRT.
   */
  UPT_PROVIDER_TENSORRT = 2,
  /**
   * NVIDIA TensorRT-RTX (a plugin provider).
   */
  UPT_PROVIDER_TENSORRT_RTX = 3
};

/**
 * What a model is.
 */
UPT_ENUM(upt_kind, int32_t) {
  /**
   * A Universal Physics Transformer.
   */
  UPT_KIND_UPT = 0,
  /**
   * A linear-elastic response with a learned correction in a static basis.
   */
  UPT_KIND_REDUCED = 1
};

/**
 * How much the log tells.
 */
UPT_ENUM(upt_log_level, int32_t) {
  /**
   * No messages.
   */
  UPT_LOG_OFF = 0,
  /**
   * Failures.
   */
  UPT_LOG_ERROR = 1,
  /**
   * Fallbacks, and each flag once when it rises: contacts outside the envelope, states that the guard refuses.
   */
  UPT_LOG_WARN = 2,
  /**
   * Loading: what was opened and which provider runs it.
   */
  UPT_LOG_INFO = 3,
  /**
   * Stage times.
   */
  UPT_LOG_DEBUG = 4,
  /**
   * Everything.
   */
  UPT_LOG_TRACE = 5
};

/**
 * Arithmetic of the heavy stages.
 */
UPT_ENUM(upt_precision, int32_t) {
  /**
   * 32-bit floats: the reference. In a scene's options: the model's precision.
   */
  UPT_PRECISION_F32 = 0,
  /**
   * bfloat16 products where the CPU is faster with them, 32-bit floats elsewhere; the statistics say which.
   */
  UPT_PRECISION_BF16 = 1,
  /**
   * 16-bit floats: the bundle's `*.f16.onnx`, or a GPU provider's own.
   */
  UPT_PRECISION_F16 = 2,
  /**
   * 8-bit integers: the bundle's `*.int8.onnx`.
   */
  UPT_PRECISION_INT8 = 3,
  /**
   * In options only: 32-bit floats, even in a scene of a model that was opened with another precision.
   */
  UPT_PRECISION_FORCE_F32 = 4
};

/**
 * What decodes.
 */
UPT_ENUM(upt_kernel, int32_t) {
  /**
   * The library chooses the decoder.
   */
  UPT_KERNEL_AUTO = 0,
  /**
   * The fused native decoder.
   */
  UPT_KERNEL_NATIVE = 1,
  /**
   * ONNX Runtime sessions in node tiles.
   */
  UPT_KERNEL_ONNX = 2,
  /**
   * ONNX Runtime, all nodes in one run with the query table resident on the device.
   */
  UPT_KERNEL_RESIDENT = 3
};

/**
 * Who makes a step of a `UPT_KIND_UPT` bundle.
 */
UPT_ENUM(upt_step_path, int32_t) {
  /**
   * On the CPU: split. On a device: the faster of split and whole, timed while the scene is created.
   */
  UPT_STEP_AUTO = 0,
  /**
   * Native encoder and message mean, then `latent.onnx` and the decoder.
   */
  UPT_STEP_SPLIT = 1,
  /**
   * The bundle's `step.onnx`, which decodes every node in every step.
   */
  UPT_STEP_WHOLE = 2,
  /**
   * The faster of split and whole, timed while the scene is created.
   */
  UPT_STEP_MEASURED = 3
};

/**
 * How many corrections a step gets.
 */
UPT_ENUM(upt_corrections_mode, int32_t) {
  /**
   * As many as the bundle recommends, until its own target is reached.
   */
  UPT_CORRECTIONS_RECOMMENDED = 0,
  /**
   * None.
   */
  UPT_CORRECTIONS_NONE = 1,
  /**
   * `count` of them; with a target or a budget at most so many.
   */
  UPT_CORRECTIONS_COUNT = 2,
  /**
   * As many as the target needs and the budget allows, up to 64.
   */
  UPT_CORRECTIONS_AUTO = 3
};

/**
 * A switch, for what is usually on.
 */
UPT_ENUM(upt_switch, uint8_t) {
  /**
   * A switch: as usual, which its field says.
   */
  UPT_SWITCH_DEFAULT = 0,
  /**
   * A switch: on.
   */
  UPT_SWITCH_ON = 1,
  /**
   * A switch: off.
   */
  UPT_SWITCH_OFF = 2
};

/**
 * What happens to a state that the guard refuses.
 */
UPT_ENUM(upt_guard_policy, int32_t) {
  /**
   * Keep the last good state and return `UPT_ERR_GUARD`. A step without contact, which the host cannot change, is treated as
   * under `UPT_GUARD_BLEND`.
   */
  UPT_GUARD_HOLD = 0,
  /**
   * Publish finite states and set flags.
   */
  UPT_GUARD_REPORT = 1,
  /**
   * Replace a refused state by the prior's or by rest, and set flags.
   */
  UPT_GUARD_BLEND = 2
};

/**
 * Bits of `flags`.
 */
UPT_ENUM(upt_flag, uint32_t) {
  /**
   * A push is longer than the model was trained on.
   */
  UPT_FLAG_PUSH = 1,
  /**
   * A contact area is outside the trained range.
   */
  UPT_FLAG_CONTACT_AREA = 2,
  /**
   * A contact lies outside the domain.
   */
  UPT_FLAG_SITE = 4,
  /**
   * A push changes faster than trained.
   */
  UPT_FLAG_RATE = 8,
  /**
   * More separate contact sites than trained.
   */
  UPT_FLAG_SITES = 16,
  /**
   * Guard: a displacement passes the bound.
   */
  UPT_FLAG_BOUND = 32,
  /**
   * Guard: the state is not finite.
   */
  UPT_FLAG_NON_FINITE = 64,
  /**
   * An element at the contact is inverted; with `check_inversion` any element, and the guard refuses the state.
   */
  UPT_FLAG_INVERTED = 128,
  /**
   * Guard: the displacement grew too much in one step.
   */
  UPT_FLAG_GROWTH = 256,
  /**
   * The learned correction was bounded.
   */
  UPT_FLAG_CLAMPED = 512,
  /**
   * The contact block was nearly singular and was regularised.
   */
  UPT_FLAG_REGULARISED = 1024,
  /**
   * The corrections ended with inverted elements, or had lost the contact of an instrument: the step's first guess or the linear response
   * took their place.
   */
  UPT_FLAG_FELL_BACK = 2048,
  /**
   * The estimated error is above the scene's `error_limit_mm`.
   */
  UPT_FLAG_ERROR = 4096,
  /**
   * Tissue lies more than 1 mm inside an instrument, or an instrument in the tissue.
   */
  UPT_FLAG_DEEP = 8192,
  /**
   * The contact solve was cut short by its bounds or the budget and left more than 0.01 mm (`residual_mm` of the readings).
   */
  UPT_FLAG_UNSOLVED = 16384,
  /**
   * The bundle's tissue relaxes, and this scene makes no corrections, which alone know of it: what it shows and feels is elastic.
   */
  UPT_FLAG_ELASTIC = 32768
};

/**
 * A static set of indices of a mesh.
 */
UPT_ENUM(upt_index_set, int32_t) {
  /**
   * Nodes of the surface.
   */
  UPT_SET_SURFACE_NODES = 0,
  /**
   * Nodes that instruments may touch.
   */
  UPT_SET_DOMAIN_NODES = 1,
  /**
   * Nodes held at zero under the bundle's boundary condition.
   */
  UPT_SET_FIXED_NODES = 2,
  /**
   * Surface triangles, 3 node indices each, outward.
   */
  UPT_SET_SURFACE_FACES = 3,
  /**
   * Triangles that instruments may touch, 3 node indices each, outward.
   */
  UPT_SET_DOMAIN_FACES = 4,
  /**
   * Tetrahedra, 4 node indices each, positive volume.
   */
  UPT_SET_TETS = 5
};

/**
 * What is shown of a state.
 */
UPT_ENUM(upt_view_kind, int32_t) {
  /**
   * The region's nodes in its order; all nodes where there is no region.
   */
  UPT_VIEW_REGION = 0,
  /**
   * The attached points.
   */
  UPT_VIEW_POINTS = 1,
  /**
   * The vertices of the surface as the last `upt_scene_update_surface` left it, each from its place at rest: the lips of cuts too.
   */
  UPT_VIEW_SURFACE = 2,
  /**
   * The view's own `nodes`, in the region or not. Only `upt_scene_decode` takes it.
   */
  UPT_VIEW_NODES = 3
};

/**
 * Shape of an instrument.
 */
UPT_ENUM(upt_shape, int32_t) {
  /**
   * An instrument's shape: a capsule along local y.
   */
  UPT_SHAPE_CAPSULE = 0,
  /**
   * An instrument's shape: a box.
   */
  UPT_SHAPE_BOX = 1,
  /**
   * An instrument's shape: a box with rounded corners.
   */
  UPT_SHAPE_SPATULA = 2,
  /**
   * An instrument's shape: a hull from `upt_hull_create`.
   */
  UPT_SHAPE_HULL = 3,
  /**
   * An instrument's shape: a ball of `radius`.
   */
  UPT_SHAPE_SPHERE = 4
};

/**
 * What an instrument does to the tissue.
 */
UPT_ENUM(upt_mode, uint8_t) {
  /**
   * An instrument pushes, with Coulomb friction.
   */
  UPT_MODE_SLIDE = 0,
  /**
   * An instrument grasps what lies within 0.5 mm of it when the mode changes to this, and holds it until the mode changes back
   * or the grasp tears off.
   */
  UPT_MODE_GRASP = 1
};

/**
 * What a tie is tied to.
 */
UPT_ENUM(upt_end, int32_t) {
  /**
   * A tie's far end is in the mesh's frame, which goes with the support.
   */
  UPT_END_SUPPORT = 0,
  /**
   * A tie's far end is in the world, which is the mesh's frame where no support moves.
   */
  UPT_END_WORLD = 1,
  /**
   * A tie's far end is on an instrument.
   */
  UPT_END_INSTRUMENT = 2,
  /**
   * A tie's far end is another point of the tissue: a suture.
   */
  UPT_END_TISSUE = 3
};

#undef UPT_ENUM


/**
 * Version of the C ABI that `upt_abi_version` returns. Bindings compare it at load.
 */
#define UPT_ABI_VERSION 1

/**
 * A tool that a hand feels. One thread at a time may use it; a second one gets `UPT_ERR_BUSY`.
 */
typedef struct upt_haptics upt_haptics;

/**
 * The convex hull of a tool's points. Immutable; any number of threads may use it at once.
 */
typedef struct upt_hull upt_hull;

/**
 * A bundle made ready to step. Immutable; any number of threads may use it at once.
 */
typedef struct upt_model upt_model;

/**
 * One deforming body. One thread at a time may change it; a second one gets `UPT_ERR_BUSY`. Any thread may read and sample
 * published states and statistics at any time.
 */
typedef struct upt_scene upt_scene;

/**
 * Options of `upt_init`.
 */
typedef struct upt_init_options {
  /**
   * `sizeof(upt_init_options)`.
   */
  uint32_t struct_size;
  /**
   * Default number of threads of a model; 0 means 1.
   */
  uint32_t threads;
  /**
   * Path of ONNX Runtime's shared library; NULL searches the folder of libupt, then `ORT_DYLIB_PATH`, then the system.
   */
  const char *onnxruntime_path;
} upt_init_options;

/**
 * Receives log messages (UTF-8, valid during the call) on the host's threads, during their calls. It must not call
 * the library: such a call returns `UPT_ERR_STATE`.
 */
typedef void (*upt_log_fn)(upt_log_level level,
                           const char *message,
                           void *user);

/**
 * Options of `upt_model_create`.
 */
typedef struct upt_model_options {
  /**
   * `sizeof(upt_model_options)`.
   */
  uint32_t struct_size;
  /**
   * Threads that a step may use, the caller's included; 0: the default of `upt_init`.
   */
  uint32_t threads;
  /**
   * `UPT_PROVIDER_*` in order of preference; NULL: CPU.
   */
  const upt_provider *providers;
  /**
   * Entries in `providers`.
   */
  uint64_t provider_count;
  /**
   * Device of GPU providers, from 0.
   */
  int32_t device_id;
  /**
   * `UPT_PRECISION_*`.
   */
  upt_precision precision;
  /**
   * Bytes; 0: no limit. Needs a GPU provider in `providers`.
   */
  uint64_t gpu_memory_limit;
  /**
   * Folder for compiled engines; NULL: they are not kept.
   */
  const char *cache_dir;
  /**
   * 1: TF32 products allowed (CUDA; errors near 1e-3).
   */
  uint8_t allow_tf32;
  /**
   * 1: capture CUDA graphs.
   */
  uint8_t cuda_graph;
  /**
   * `UPT_SWITCH_*`: the next provider is tried where one cannot run the model, usually on; off: `UPT_ERR_PROVIDER`.
   */
  upt_switch fallback;
  /**
   * 1: the same bits on every processor, for replays and lockstep; steps take longer. Reduced bundles without a network.
   */
  uint8_t portable;
  /**
   * A `cudaStream_t` of `device_id` that runs the graphs and must outlive the model and its scenes; NULL: ONNX Runtime makes its own.
   */
  void *user_stream;
} upt_model_options;

/**
 * What a model is; filled by `upt_model_read_info`.
 */
typedef struct upt_model_info {
  /**
   * `sizeof(upt_model_info)`, set by the caller.
   */
  uint32_t struct_size;
  /**
   * `UPT_KIND_*`.
   */
  upt_kind kind;
  /**
   * K, the nodes of the bundle's mesh.
   */
  uint64_t node_count;
  /**
   * Tetrahedra.
   */
  uint64_t tet_count;
  /**
   * Boundary triangles.
   */
  uint64_t surface_face_count;
  /**
   * Nodes that instruments may touch.
   */
  uint64_t domain_node_count;
  /**
   * Nodes held at zero.
   */
  uint64_t held_node_count;
  /**
   * Supernodes (kind `UPT_KIND_UPT`), else 0.
   */
  uint64_t supernode_count;
  /**
   * Length of a step, seconds.
   */
  float dt;
  /**
   * Longest push that the model was trained on, mm.
   */
  float max_push_mm;
  /**
   * `UPT_PROVIDER_*` that runs the latent stage.
   */
  upt_provider provider;
  /**
   * `UPT_PRECISION_*`.
   */
  upt_precision precision;
  /**
   * Host memory of the model.
   */
  uint64_t memory_bytes;
  /**
   * Wall time of `upt_model_create`.
   */
  double load_seconds;
  /**
   * The `step_s` of `upt_scene_options` that the bundle recommends to a host that shows frames (`upt_scene_present`), seconds; `dt` where it
   * recommends no other. For scenes with the corrections that the bundle recommends.
   */
  double frame_step_s;
} upt_model_info;

/**
 * How many corrections by the elements a step gets while there is contact, in `upt_scene_options`.
 */
typedef struct upt_corrections {
  /**
   * `UPT_CORRECTIONS_*`.
   */
  upt_corrections_mode mode;
  /**
   * With `UPT_CORRECTIONS_COUNT` 1 to 64; otherwise 0.
   */
  uint32_t count;
  /**
   * No correction starts later than this in a step, µs, but the first of a step without tools; 0: no budget. Not with `UPT_CORRECTIONS_NONE`.
   */
  uint32_t budget_us;
  /**
   * Corrections stop once the estimated error is below this, mm; 0: no target. Only with `UPT_CORRECTIONS_COUNT` and `UPT_CORRECTIONS_AUTO`.
   */
  float target_mm;
} upt_corrections;

/**
 * Options of `upt_scene_create`.
 */
typedef struct upt_scene_options {
  /**
   * `sizeof(upt_scene_options)`.
   */
  uint32_t struct_size;
  /**
   * Threads of a step; 0: the model's.
   */
  uint32_t threads;
  /**
   * `UPT_KERNEL_*`: who decodes.
   */
  upt_kernel kernel;
  /**
   * `UPT_PRECISION_*` of the native decoder; 0: the model's; `UPT_PRECISION_FORCE_F32`: float32, whatever the model's is.
   */
  upt_precision precision;
  /**
   * `UPT_GUARD_*`.
   */
  upt_guard_policy guard_policy;
  /**
   * A mesh of the host's own (`*.mesh.safetensors`); NULL: the bundle's.
   */
  const char *mesh_path;
  /**
   * `UPT_SWITCH_*`: held nodes and nodes in contact are where they belong, usually on; off: where the networks put them.
   */
  upt_switch boundary;
  /**
   * `UPT_SWITCH_*`: tissue at rest sleeps, usually on.
   */
  upt_switch sleep;
  /**
   * 1: the guard looks for inverted elements in each step.
   */
  uint8_t check_inversion;
  /**
   * 1: a submit while a step is in flight replaces the waiting contact and does not return `UPT_ERR_BUSY`.
   */
  uint8_t latest_wins;
  /**
   * 1: sample with a cubic through the last states instead of a line.
   */
  uint8_t cubic_sampling;
  /**
   * 1: attached points are interpolated between nodes, not decoded (kind `upt`).
   */
  uint8_t interpolate_points;
  /**
   * The most substeps of a step that instruments drive, where one step would miss the corrections' target: 1 for none, up to 8; 0: as
   * many as the bundle recommends. 2 or more need a target.
   */
  uint8_t substeps;
  /**
   * Zero.
   */
  uint8_t reserved[1];
  /**
   * `UPT_STEP_*`: who makes a step of a `UPT_KIND_UPT` bundle.
   */
  upt_step_path step_path;
  /**
   * Corrections by the elements while there is contact; all zero: as many as the bundle recommends.
   */
  struct upt_corrections corrections;
  /**
   * `UPT_FLAG_ERROR` rises if the estimated error is above this, mm; 0: never.
   */
  float error_limit_mm;
  /**
   * Length of a step, s: 0.01 to 0.05, or 0 for the bundle's. A length other than the bundle's needs corrections
   * (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out.
   */
  double step_s;
  /**
   * Mass-proportional damping of the tissue, 1/s: 0.01 to 1000, or 0 for the bundle's. A damping other than the bundle's
   * needs corrections (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out.
   */
  double damping_per_s;
} upt_scene_options;

/**
 * A rigid instrument, as `upt_input` and `upt_scene_contacts_from_instruments` take it.
 */
typedef struct upt_instrument {
  /**
   * `sizeof(upt_instrument)`, the same in every element of an array.
   */
  uint32_t struct_size;
  /**
   * `UPT_SHAPE_*`.
   */
  upt_shape shape;
  /**
   * Centre, mm, in the mesh's frame.
   */
  float position[3];
  /**
   * Unit quaternion x, y, z, w; all zero is no rotation.
   */
  float rotation[4];
  /**
   * Half sizes along the local axes, mm; a capsule's half length is `[1]` (local y). A sphere has none.
   */
  float half_extents[3];
  /**
   * A sphere's or a capsule's radius or a spatula's corner radius, mm.
   */
  float radius;
  /**
   * Only for `upt_scene_contacts_from_instruments`. 1: touched nodes move with the instrument until it leaves; 0: they slide.
   */
  uint8_t sticking;
  /**
   * Only for `upt_input`: `UPT_MODE_*`.
   */
  upt_mode mode;
  /**
   * Zero.
   */
  uint8_t reserved[2];
  /**
   * Only for `upt_input`: Coulomb's coefficient, 0 or more.
   */
  float friction;
  /**
   * A grasp tears off when its points together pull harder than this, mN; 0: never.
   */
  float tear_off_mn;
  /**
   * `UPT_SHAPE_HULL`: the `upt_hull`; otherwise NULL.
   */
  const struct upt_hull *hull;
} upt_instrument;

/**
 * A pressure on a part of the surface, which follows the surface as it moves. A face in several of them takes their sum.
 */
typedef struct upt_pressure {
  /**
   * `sizeof(upt_pressure)`, the same in every element of an array.
   */
  uint32_t struct_size;
  /**
   * From outside on the body, Pa, at most 1000000; negative for suction.
   */
  float pascal;
  /**
   * `[node_count]`: it acts on the boundary triangles with all three corners among these nodes; where the scene has been cut, on what is left of them.
   */
  const uint32_t *nodes;
  /**
   * At most K; 0: it acts on the domain, and on all that cuts and removal have laid bare.
   */
  uint64_t node_count;
} upt_pressure;

/**
 * A tie: a spring between a point of the tissue and something else, an element of `upt_input.ties`.
 */
typedef struct upt_tie {
  /**
   * `sizeof(upt_tie)`, the same in every element of an array.
   */
  uint32_t struct_size;
  /**
   * What it is tied to: `UPT_END_*`.
   */
  upt_end to;
  /**
   * The point of the tissue: nodes, of which one at least is free and near the domain, ...
   */
  uint32_t nodes[3];
  /**
   * ... and their weights, 0 or more, with the sum 1; all zero: the first node alone. `upt_scene_tie_points` finds both.
   */
  float weights[3];
  /**
   * Where its far end is at the end of the step, mm: in the mesh's frame, in the world, or in the instrument's frame. It comes there on a line within the step; one
   * that goes farther than 40 mm is put there.
   */
  float place[3];
  /**
   * Tied to an instrument: its place in `upt_input.instruments`.
   */
  uint32_t instrument;
  /**
   * Tied to the tissue: the other point, as `nodes` and `weights`.
   */
  uint32_t other_nodes[3];
  /**
   * See `other_nodes`.
   */
  float other_weights[3];
  /**
   * N/m, which is mN/mm, at most 1000000; 0: it does not pull.
   */
  float stiffness;
  /**
   * It pulls where it is longer than this, mm.
   */
  float slack_mm;
  /**
   * N s/m, which is mN s/mm.
   */
  float damping;
  /**
   * It breaks under a larger tension at the end of a step, mN; 0: never. Where several would, those break first that are pulled hardest for what they bear.
   */
  float break_mn;
  /**
   * 1: it pushes where it is shorter than `slack_mm`, as a rod does; 0: it is a thread.
   */
  uint8_t pushes;
  /**
   * Zero.
   */
  uint8_t reserved[3];
} upt_tie;

/**
 * What a support group of the bundle does at the end of a step, an element of `upt_input.supports`. `upt_model_read_support` names the groups.
 */
typedef struct upt_support {
  /**
   * `sizeof(upt_support)`, the same in every element of an array.
   */
  uint32_t struct_size;
  /**
   * Its place among the bundle's groups, from 0.
   */
  uint32_t group;
  /**
   * As a rigid body in the mesh's frame: a node `x` of the group ends at `R x + position`, mm; at most 40 mm from where it is.
   */
  float position[3];
  /**
   * `R` as a unit quaternion x, y, z, w; all zero is no rotation.
   */
  float rotation[4];
  /**
   * 1: the group holds nothing, and its nodes move as all free ones do. Held again, it holds them where they are then. 0: it holds.
   */
  uint8_t let_go;
  /**
   * Zero.
   */
  uint8_t reserved[3];
  /**
   * `[n,3]`, mm, instead of a pose: the displacement of each of the group's nodes at the end of the step; NULL: the pose.
   */
  const float *displacements;
  /**
   * 3 n, or 0.
   */
  uint64_t displacement_count;
} upt_support;

/**
 * A force at a point of the tissue, an element of `upt_input.point_forces`; `upt_model_locate_points` finds the point.
 */
typedef struct upt_point_force {
  /**
   * `sizeof(upt_point_force)`, the same in every element of an array.
   */
  uint32_t struct_size;
  /**
   * Nodes of the model's mesh around the point, which share the force (where the scene has been cut, the tissue at their places does), ...
   */
  uint32_t nodes[4];
  /**
   * ... and their weights, 0 or more, with the sum 1; all zero: the first node alone.
   */
  float weights[4];
  /**
   * mN, at most 1000000 in each direction, in the mesh's frame.
   */
  float force[3];
} upt_point_force;

/**
 * The input of a step, submitted or not, and of a frame between steps. All zero but `struct_size`: the tissue moves on by itself.
 *
 * One thing drives a step: `instruments`, the nodes in contact, or `collision`; two at once are `UPT_ERR_ARGUMENT`. Later versions add
 * fields at the end.
 */
typedef struct upt_input {
  /**
   * `sizeof(upt_input)`.
   */
  uint32_t struct_size;
  /**
   * Zero.
   */
  uint8_t reserved[4];
  /**
   * `[instrument_count]`: where rigid instruments are at the end of the step, all with the same `struct_size`. Pass every instrument
   * every time, in the same order.
   */
  const struct upt_instrument *instruments;
  /**
   * At most 64.
   */
  uint64_t instrument_count;
  /**
   * `[contact_count]` nodes in contact, each at most once, in any order; of a scene that has been cut also copies.
   */
  const uint32_t *contact_nodes;
  /**
   * `[contact_count,3]`, mm: the displacement of these nodes at the end of the step.
   */
  const float *contact_vectors;
  /**
   * At most K.
   */
  uint64_t contact_count;
  /**
   * `[K,3]` of the model's mesh, also where the scene has been cut, mm; zero except at nodes in contact, where it is their displacement at the end of
   * the step; NULL: no such field.
   */
  const float *collision;
  /**
   * `[K,3]`, mm, the displacement that the step starts from; NULL: the scene's own state. Not with `instruments`.
   */
  const float *displacement;
  /**
   * The moment of the end of the step on the host's clock, s, from which `upt_scene_present` counts; 0 for hosts that keep none.
   */
  double time_s;
  /**
   * `[K,3]`, mN: forces on the nodes of the model's mesh at the end of the step (where the scene has been cut, on the tissue at a node's place);
   * NULL: none. Loads (this field and those after it) act beside whatever drives the step, in scenes with corrections; they change on a line over the step, and a frame goes on from those of its step.
   */
  const float *forces;
  /**
   * `[pressure_count]`: pressure on parts of the surface at the end of the step, all with the same `struct_size`.
   */
  const struct upt_pressure *pressures;
  /**
   * At most 32.
   */
  uint64_t pressure_count;
  /**
   * `[tie_count]`: ties of the tissue, all with the same `struct_size`, beside instruments or alone. A tie's place in the array is its identity: pass every tie
   * every time, in the same order. A broken one stays broken in its place until it has a stiffness of 0 there, the array ends before it, or the scene is reset.
   */
  const struct upt_tie *ties;
  /**
   * At most 256.
   */
  uint64_t tie_count;
  /**
   * `[support_count]`: what support groups of the bundle do, each at most once, all with the same `struct_size`. A group that is not named is held where it was
   * meshed, or where it was held again. Pass them in every step.
   */
  const struct upt_support *supports;
  /**
   * At most 64.
   */
  uint64_t support_count;
  /**
   * `[point_force_count]`: forces at points of the tissue at the end of the step, beside `forces`, all with the same `struct_size`.
   */
  const struct upt_point_force *point_forces;
  /**
   * At most 256.
   */
  uint64_t point_force_count;
  /**
   * Gravity in the mesh's frame at the end of the step, m/s², at most 1000 in each direction.
   */
  float gravity[3];
  /**
   * Gravity under which the mesh was scanned, m/s²: what acts is `gravity - gravity_at_rest`, on the mass of each node. Zeros: the bundle's, where `gravity` is not zero.
   */
  float gravity_at_rest[3];
  /**
   * Where what holds the body is at the end of the step, mm: a point `x` of the mesh's frame is at `R x + support_position` in the world. All else stays in
   * the mesh's frame, which goes with the support, but `gravity`, which is the world's then; the body feels the support's motion as inertia. Pass it in every step; a
   * support that goes farther than 40 mm or half a radian in a step is put there.
   */
  float support_position[3];
  /**
   * `R` as a unit quaternion x, y, z, w; all zero is no rotation. Position and rotation all zero: there is no support that moves.
   */
  float support_rotation[4];
  /**
   * Zero.
   */
  uint8_t reserved_end[4];
} upt_input;

/**
 * What is shown of a state. Where a call takes one, NULL is the region.
 */
typedef struct upt_view {
  /**
   * `sizeof(upt_view)`.
   */
  uint32_t struct_size;
  /**
   * `UPT_VIEW_*`.
   */
  upt_view_kind kind;
  /**
   * `[node_count]`, only with `UPT_VIEW_NODES`: indices, in the order of the output; NULL with count 0: all nodes.
   */
  const uint32_t *nodes;
  /**
   * At most K.
   */
  uint64_t node_count;
} upt_view;

/**
 * What the tissue does to an instrument at the end of a step; filled by `upt_scene_read_instruments`.
 */
typedef struct upt_instrument_reading {
  /**
   * `sizeof(upt_instrument_reading)`, set by the caller, the same in every element of an array.
   */
  uint32_t struct_size;
  /**
   * Points of the surface that push or hold the instrument.
   */
  uint32_t contact_count;
  /**
   * On the instrument, mN.
   */
  float force[3];
  /**
   * On the instrument about its position, mN mm.
   */
  float torque[3];
  /**
   * Depth of the deepest point of the surface inside the instrument, mm.
   */
  float penetration_mm;
  /**
   * 1: its grasp tore off in this step.
   */
  uint8_t torn;
  /**
   * Zero.
   */
  uint8_t reserved[3];
  /**
   * What the last contact solve left unsolved, mm: 0 where it came to its end.
   */
  float residual_mm;
} upt_instrument_reading;

/**
 * A point of the surface that pushes or holds an instrument; filled by `upt_scene_read_instrument_contacts`.
 */
typedef struct upt_instrument_contact {
  /**
   * Place of the instrument in the step's array.
   */
  uint32_t instrument;
  /**
   * Position of the point, mm.
   */
  float position[3];
  /**
   * On the instrument, mN.
   */
  float force[3];
} upt_instrument_contact;

/**
 * What a tie does at the end of a step; filled by `upt_scene_read_ties`.
 */
typedef struct upt_tie_reading {
  /**
   * `sizeof(upt_tie_reading)`, set by the caller, the same in every element of an array.
   */
  uint32_t struct_size;
  /**
   * 1: it has broken, in this step or before.
   */
  uint8_t broken;
  /**
   * 1: it broke in this step.
   */
  uint8_t broke;
  /**
   * Zero.
   */
  uint8_t reserved[2];
  /**
   * On the tissue at the tie's point, mN.
   */
  float force[3];
  /**
   * From end to end, mm.
   */
  float length_mm;
} upt_tie_reading;

/**
 * A bed: what holds a region of the surface, for `upt_scene_bed`.
 */
typedef struct upt_bed {
  /**
   * `sizeof(upt_bed)`.
   */
  uint32_t struct_size;
  /**
   * mm: with no `nodes`, the region is what lies this close to `centre` in the last state.
   */
  float radius_mm;
  /**
   * mm, in the mesh's frame.
   */
  float centre[3];
  /**
   * From each node to where it is tied, mm; zeros: where it is in the last state.
   */
  float offset[3];
  /**
   * `[node_count]`: the nodes that it ties.
   */
  const uint32_t *nodes;
  /**
   * At most K; 0: those about `centre`.
   */
  uint64_t node_count;
  /**
   * Of all ties together, N/m.
   */
  float stiffness;
  /**
   * Of each tie, mm.
   */
  float slack_mm;
  /**
   * Of all ties together, N s/m.
   */
  float damping;
  /**
   * Of all ties together, mN; 0: it never breaks.
   */
  float break_mn;
  /**
   * As in `upt_tie`.
   */
  uint8_t pushes;
  /**
   * Zero.
   */
  uint8_t reserved[7];
} upt_bed;

/**
 * What an operation has made of the body of a scene; filled by `upt_scene_cut` and the calls beside it.
 */
typedef struct upt_cut {
  /**
   * `sizeof(upt_cut)`, set by the caller.
   */
  uint32_t struct_size;
  /**
   * Pieces that were dropped.
   */
  uint32_t fragment_count;
  /**
   * Nodes that the scene has now. Outputs have 3 floats for each.
   */
  uint64_t node_count;
  /**
   * New ones, the last of them.
   */
  uint64_t copied_count;
  /**
   * New area of the cut, mm².
   */
  float area_mm2;
  /**
   * Volume that the body has lost, mm³.
   */
  float removed_mm3;
  /**
   * What the tissue does to the blade of `upt_scene_cut_with`, mN.
   */
  float force[3];
  /**
   * 1: the body is another one, also where no area is new: its surface wants `upt_scene_update_surface` before it is read.
   */
  uint32_t is_changed;
} upt_cut;

/**
 * A blade that feels the tissue. All zero: it feels nothing, and cuts whatever way it goes.
 */
typedef struct upt_blade {
  /**
   * `sizeof(upt_blade)`.
   */
  uint32_t struct_size;
  /**
   * Fracture energy of the tissue, J/m², which is mN/mm: what new area takes.
   */
  float fracture_energy;
  /**
   * With how much it must be pushed before a stroke begins to cut, mN, ...
   */
  float threshold;
  /**
   * ... and is, mN: of the reading of the instrument that is its body, what points against `ahead`.
   */
  float pushed;
  /**
   * Where the edge is sharp, of any length; zeros: everywhere. It cuts where its way leans from there by less than 60 degrees.
   */
  float ahead[3];
  /**
   * 0.
   */
  uint32_t reserved;
} upt_blade;

/**
 * The surface of a scene's body, and what of it is new; filled by `upt_scene_update_surface`.
 */
typedef struct upt_surface {
  /**
   * `sizeof(upt_surface)`, set by the caller.
   */
  uint32_t struct_size;
  /**
   * 1: every vertex and triangle is new, so upload all. That is so at the first call, and at the first after `upt_scene_reset` or
   * `upt_scene_restore` has put another body back.
   */
  uint32_t is_new;
  /**
   * Vertices now.
   */
  uint64_t vertex_count;
  /**
   * Slots of triangles now, empty ones included.
   */
  uint64_t triangle_count;
  /**
   * Vertices from this one on are new.
   */
  uint64_t first_vertex;
  /**
   * Slots whose corners have changed.
   */
  uint64_t changed_count;
} upt_surface;

/**
 * Options of `upt_haptics_create`.
 */
typedef struct upt_haptics_options {
  /**
   * `sizeof(upt_haptics_options)`.
   */
  uint32_t struct_size;
  /**
   * The tool's place in the array of instruments that drives the steps.
   */
  uint32_t instrument;
  /**
   * Its shape, mode and friction, as in that array; position and rotation say where it starts.
   */
  const struct upt_instrument *tool;
  /**
   * Time over which the change that a new step brings is blended in, ms; 0: 25.
   */
  float blend_ms;
  /**
   * Age of a step when it arrives, ms: the time since its poses were taken; 0: as long as the step took.
   */
  float step_latency_ms;
  /**
   * Longest force, N; 0: no limit.
   */
  float force_limit_n;
  /**
   * The most that the passivity controller damps, N s/m; 0: 5.
   */
  float damping_limit_n_s_per_m;
  /**
   * `UPT_SWITCH_*`: passivity observer and controller, usually on.
   */
  upt_switch passivity;
  /**
   * Zero.
   */
  uint8_t reserved[7];
} upt_haptics_options;

/**
 * A tool's pose at a moment; the input of `upt_haptics_render`.
 */
typedef struct upt_haptic_pose {
  /**
   * `sizeof(upt_haptic_pose)`.
   */
  uint32_t struct_size;
  /**
   * 1: the velocities below are given; 0: they follow from the last two poses.
   */
  uint8_t has_velocity;
  /**
   * Zero.
   */
  uint8_t reserved[3];
  /**
   * The host's clock, s; never earlier than in the last call.
   */
  double time_s;
  /**
   * In the mesh's frame, metres.
   */
  float position_m[3];
  /**
   * Unit quaternion x, y, z, w; all zero is no rotation.
   */
  float rotation[4];
  /**
   * Of the tool's position.
   */
  float velocity_m_per_s[3];
  /**
   * About the axes of the mesh's frame.
   */
  float angular_velocity_rad_per_s[3];
} upt_haptic_pose;

/**
 * What a hand feels; filled by `upt_haptics_render`.
 */
typedef struct upt_haptic_force {
  /**
   * `sizeof(upt_haptic_force)`, set by the caller.
   */
  uint32_t struct_size;
  /**
   * Points of the surface that push or hold the tool.
   */
  uint32_t contact_count;
  /**
   * 1: there is a force.
   */
  uint8_t contact;
  /**
   * 1: the passivity controller damps.
   */
  uint8_t damped;
  /**
   * Zero.
   */
  uint8_t reserved[6];
  /**
   * States of the scene that this object has seen.
   */
  uint64_t step_count;
  /**
   * Watchdog: age of the last of these states, s.
   */
  double age_s;
  /**
   * Energy that the hand received, less what it gave, since the tool last touched, J; the controller takes it back.
   */
  double excess_energy_j;
  /**
   * On the tool, N, in the mesh's frame.
   */
  float force_n[3];
  /**
   * On the tool about its position, N m.
   */
  float torque_n_m[3];
  /**
   * `[3,3]`, row-major: how the force falls with the position, N/m. With the next two: a symmetric 6x6 stiffness of the contact alone.
   */
  float stiffness_n_per_m[9];
  /**
   * `[3,3]`, row-major: how the force falls with the rotation, N/rad; transposed, the torque with the position, N m/m.
   */
  float coupling_n_per_rad[9];
  /**
   * `[3,3]`, row-major: how the torque falls with the rotation, N m/rad.
   */
  float angular_stiffness_n_m_per_rad[9];
} upt_haptic_force;

/**
 * What the last step did; filled by `upt_scene_read_stats`.
 */
typedef struct upt_scene_stats {
  /**
   * `sizeof(upt_scene_stats)`, set by the caller.
   */
  uint32_t struct_size;
  /**
   * `UPT_FLAG_*` of the last step.
   */
  upt_flag flags;
  /**
   * Steps since creation or reset.
   */
  uint64_t step_count;
  /**
   * Nodes decoded in the last step.
   */
  uint64_t decoded_node_count;
  /**
   * Contact nodes of the last step.
   */
  uint64_t contact_count;
  /**
   * Bytes that the scene has allocated in addition to the model; pages that it has never touched are not resident.
   */
  uint64_t memory_bytes;
  /**
   * Threads of a step.
   */
  uint32_t threads;
  /**
   * `UPT_KERNEL_*` that decodes.
   */
  upt_kernel kernel;
  /**
   * `UPT_PROVIDER_*` that runs the latent stage.
   */
  upt_provider provider;
  /**
   * `UPT_PRECISION_*` of the decoder.
   */
  upt_precision precision;
  /**
   * Largest displacement among the decoded nodes, mm.
   */
  float max_displacement_mm;
  /**
   * Largest ratio of push, rate of push, contact area and number of sites to what the model was trained on; above 1: outside.
   */
  float indicator;
  /**
   * 1: the scene sleeps.
   */
  uint8_t sleeping;
  /**
   * 1: a bug was caught in an earlier call; only destroy is left.
   */
  uint8_t poisoned;
  /**
   * 1: `upt_scene_read_contact_force` gives the contact forces of the linear response; 0: the elements' elastic forces.
   */
  uint8_t prior_forces;
  /**
   * Substeps of the last step; 0 if it was not split.
   */
  uint8_t substeps;
  /**
   * Zero.
   */
  uint8_t reserved[4];
  /**
   * `UPT_STEP_SPLIT` or `UPT_STEP_WHOLE`.
   */
  upt_step_path step_path;
  /**
   * Corrections made in the last step.
   */
  uint32_t corrections;
  /**
   * Evaluations of the element forces in the last step.
   */
  uint32_t evaluations;
  /**
   * Residual force after the corrections divided by that before them; 0 without corrections.
   */
  float residual;
  /**
   * Estimated root mean square error of the corrected state over all nodes, mm; 0 without corrections.
   */
  float error_mm;
  /**
   * Smallest det F of the corrected state; without corrections, of the elements at the contact; 0 if there are neither.
   */
  float min_det;
} upt_scene_stats;

/**
 * What the last step took, in milliseconds; filled by `upt_scene_read_timing`.
 */
typedef struct upt_scene_timing {
  /**
   * `sizeof(upt_scene_timing)`, set by the caller.
   */
  uint32_t struct_size;
  /**
   * Zero.
   */
  uint8_t reserved[4];
  /**
   * Steps since creation or reset, the last of which this is of: as in `upt_scene_stats`.
   */
  uint64_t step_count;
  /**
   * The whole step, ms; the stages follow.
   */
  double step_ms;
  /**
   * Input checks, ms.
   */
  double check_ms;
  /**
   * Contact solve and linear response, ms.
   */
  double prior_ms;
  /**
   * Encoder, ms.
   */
  double encode_ms;
  /**
   * Message mean, ms.
   */
  double aggregate_ms;
  /**
   * Latent network, or the whole step's graph, ms.
   */
  double latent_ms;
  /**
   * Decoder, ms.
   */
  double decode_ms;
  /**
   * Guard and publishing, ms.
   */
  double guard_ms;
  /**
   * Corrections, ms.
   */
  double corrections_ms;
  /**
   * Contact solves of instruments, ms; part of `corrections_ms`, or of `check_ms` without corrections.
   */
  double contact_ms;
  /**
   * Part of the stages' times: copies to a device, ms; 0 on the CPU.
   */
  double upload_ms;
  /**
   * Part of the stages' times: copies back from a device, ms; 0 on the CPU.
   */
  double download_ms;
} upt_scene_timing;

#ifdef __cplusplus
extern "C" {
#endif

/**
 * Starts the library with options of your own. Optional: opening the first model starts it with the defaults.
 *
 * - `options`: NULL means the defaults.
 *
 * Threads: any.
 * Errors: `UPT_ERR_STATE` when the library was started with other options, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`.
 */
upt_status upt_init(const struct upt_init_options *options);

/**
 * Shuts the library down. Call it before the process exits if you used a GPU provider.
 *
 * Threads: any.
 * Errors: `UPT_ERR_STATE` while models or scenes exist.
 */
upt_status upt_shutdown(void);

/**
 * The library's version, for instance "0.1.0".
 *
 * Threads: any.
 */
const char *upt_version(void);

/**
 * The `UPT_ABI_VERSION` of the library that is loaded. Stop if it differs from the header's.
 *
 * Threads: any.
 */
uint32_t upt_abi_version(void);

/**
 * The message of the calling thread's last failed call (UTF-8), or "". It stays valid until that thread's next call.
 *
 * Threads: any.
 */
const char *upt_last_error(void);

/**
 * The name of a status, for instance "UPT_ERR_BUSY"; "UPT_UNKNOWN" for other numbers.
 *
 * Threads: any.
 */
const char *upt_status_name(upt_status status);

/**
 * Sets the function that receives log messages; NULL removes it. When the call returns, the former receiver is no longer
 * running. It runs on the host's threads only, during a call or at its end; messages of the library's own threads wait
 * for the next call.
 *
 * - `user`: passed to the receiver.
 * - `level`: `UPT_LOG_*`; less severe messages are not created.
 *
 * Threads: any.
 * Errors: `UPT_ERR_ARGUMENT` for an unknown level, `UPT_ERR_STATE` from the receiver itself, or in a Rust program with a
 * `tracing` subscriber of its own.
 */
upt_status upt_set_log(upt_log_fn callback,
                       void *user,
                       upt_log_level level);

/**
 * Lists the providers as JSON: `[{"name":"cpu","available":true,"reason":""}]`. Loads ONNX Runtime.
 *
 * - `out`: receives text with its NUL; NULL with capacity 0 only queries the size.
 * - `needed`: its size in bytes with the NUL, always written; may be NULL.
 *
 * Threads: any.
 * Errors: `UPT_ERR_RUNTIME`, `UPT_ERR_ARGUMENT` if capacity is too small, `UPT_ERR_NULL`.
 */
upt_status upt_providers(char *out,
                         uint64_t capacity,
                         uint64_t *needed);

/**
 * Opens a bundle, checks it (sizes, dtypes, the SHA-256 of the manifest and of every file that is read) and makes it
 * ready to step.
 *
 * - `path`: the bundle's folder, UTF-8.
 * - `options`: NULL means the defaults.
 * - `out`: the new model.
 *
 * Threads: any.
 * Errors: `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_VERSION`, `UPT_ERR_RUNTIME`, `UPT_ERR_PROVIDER`,
 * `UPT_ERR_UNSUPPORTED`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NULL`, `UPT_ERR_OUT_OF_MEMORY`.
 */
upt_status upt_model_create(const char *path,
                            const struct upt_model_options *options,
                            struct upt_model **out);

/**
 * Closes a model. Its scenes keep what they need and stay usable.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was closed before).
 */
upt_status upt_model_destroy(struct upt_model *model);

/**
 * Describes a model in numbers. Set `out->struct_size` first.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
 */
upt_status upt_model_read_info(const struct upt_model *model,
                               struct upt_model_info *out);

/**
 * Describes a model as JSON: name, bundle hash, the provider of each stage and why the others were not chosen.
 *
 * - `out`: receives text with its NUL; NULL with capacity 0 only queries the size.
 * - `needed`: its size in bytes with the NUL, always written; may be NULL.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` if capacity is too small.
 */
upt_status upt_model_describe(const struct upt_model *model,
                              char *out,
                              uint64_t capacity,
                              uint64_t *needed);

/**
 * Copies the rest positions.
 *
 * - `out`: `[K,3]` floats, mm.
 * - `count`: number of floats in `out`, 3 K.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` when count is not 3 K.
 */
upt_status upt_model_read_positions(const struct upt_model *model,
                                    float *out,
                                    uint64_t count);

/**
 * Copies a static index set.
 *
 * - `set`: `UPT_SET_*`.
 * - `out`: node indices; NULL with capacity 0 only queries the size.
 * - `capacity`: number of indices that fit in `out`.
 * - `needed`: number of indices in the set (3 per face, 4 per tetrahedron), always written; may be NULL.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (unknown set, capacity too small).
 */
upt_status upt_model_read_indices(const struct upt_model *model,
                                  upt_index_set set,
                                  uint32_t *out,
                                  uint64_t capacity,
                                  uint64_t *needed);

/**
 * Names a support group of a bundle, and copies its nodes: what `upt_input.supports` moves.
 *
 * - `group`: from 0; the groups end where this is `UPT_ERR_ARGUMENT` (`upt_model_describe` lists them).
 * - `name`: receives text with its NUL; NULL with capacity 0 leaves it out.
 * - `nodes`: node indices, ascending; NULL with capacity 0 only queries the size.
 * - `node_capacity`: number of indices that fit in `nodes`.
 * - `needed`: number of nodes of the group, always written; may be NULL.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (no such group, a capacity too small).
 */
upt_status upt_model_read_support(const struct upt_model *model,
                                  uint32_t group,
                                  char *name,
                                  uint64_t name_capacity,
                                  uint32_t *nodes,
                                  uint64_t node_capacity,
                                  uint64_t *needed);

/**
 * Names a region of the surface that the bundle names, and copies its nodes: what `upt_pressure.nodes` takes.
 *
 * - `region`: from 0; the regions end where this is `UPT_ERR_ARGUMENT` (`upt_model_describe` lists them).
 * - `name`: receives text with its NUL; NULL with capacity 0 leaves it out.
 * - `nodes`: node indices, ascending; NULL with capacity 0 only queries the size.
 * - `node_capacity`: number of indices that fit in `nodes`.
 * - `needed`: number of nodes of the region, always written; may be NULL.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (no such region, a capacity too small).
 */
upt_status upt_model_read_region(const struct upt_model *model,
                                 uint32_t region,
                                 char *name,
                                 uint64_t name_capacity,
                                 uint32_t *nodes,
                                 uint64_t node_capacity,
                                 uint64_t *needed);

/**
 * Finds points of the intact mesh: of each the tetrahedron that holds it, or of one outside of the mesh the closest combination. What `upt_point_force` takes; some milliseconds
 * for a large mesh, so find a point once, not in every step.
 *
 * - `places`: `[count,3]`, rest positions, mm.
 * - `count`: number of points.
 * - `nodes`: `[count,4]`, receives the corners of each one's tetrahedron.
 * - `weights`: `[count,4]`, receives their weights, 0 or more, with the sum 1.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` (a point 25 mm or more outside of the mesh), `UPT_ERR_OUT_OF_MEMORY`,
 * `UPT_ERR_PANIC`.
 */
upt_status upt_model_locate_points(const struct upt_model *model,
                                   const float *places,
                                   uint64_t count,
                                   uint32_t *nodes,
                                   float *weights);

/**
 * Creates a scene at rest.
 *
 * - `options`: NULL means the defaults.
 * - `out`: the new scene. The scene keeps what it needs of the model.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`,
 * `UPT_ERR_UNSUPPORTED`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_OUT_OF_MEMORY`.
 */
upt_status upt_scene_create(const struct upt_model *model,
                            const struct upt_scene_options *options,
                            struct upt_scene **out);

/**
 * Destroys a scene, after waiting for a step in flight. A poisoned scene accepts only this call and
 * `upt_scene_read_stats`.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before), `UPT_ERR_BUSY` while another thread is in
 * a call on it.
 */
upt_status upt_scene_destroy(struct upt_scene *scene);

/**
 * Returns the scene to rest, a cut body to the intact one. The region and the attached points stay.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`; of a cut body also `UPT_ERR_RUNTIME` and `UPT_ERR_OUT_OF_MEMORY`.
 */
upt_status upt_scene_reset(struct upt_scene *scene);

/**
 * One step of the scene's `dt`, as `input` drives it.
 *
 * Instruments are where they will be at the end of the step: each moves there on a straight line from its last pose, and their contact is
 * solved. An instrument that would move more than 40 mm in a step is placed there without a motion. Contact is unilateral, with
 * Coulomb friction, at points of the domain's surface at most 1.7 mm apart. A scene with corrections solves it inside each
 * correction, as a load; with `UPT_CORRECTIONS_NONE` it is solved once, on the linear response. The scene remembers
 * each place of the array: pass every instrument every time, in the same order.
 *
 * - `input`: what drives the step; NULL: nothing does, the tissue moves on by itself.
 * - `out`: `[n,3]`, mm (n: K, or the region's count; K of a cut body counts the copies of its nodes, `upt_scene_read_node_count`), may be NULL;
 *   it may be the memory of an input, at the cost of a copy.
 * - `out_count`: number of floats in `out`, 3 n; 0 when out is NULL.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_STRUCT_SIZE` for an input of another size; `UPT_ERR_ARGUMENT` also for two drives at once, for a displacement with
 * instruments and for a node beyond K or listed twice; `UPT_ERR_NON_FINITE`; for instruments `UPT_ERR_UNSUPPORTED` in a build without
 * feature "instruments" and for a bundle without a linear response, and `UPT_ERR_HANDLE` for a hull that was destroyed; `UPT_ERR_NULL`,
 * `UPT_ERR_BUSY`, `UPT_ERR_GUARD`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; the state does not change.
 */
upt_status upt_scene_step(struct upt_scene *scene,
                          const struct upt_input *input,
                          float *out,
                          uint64_t out_count);

/**
 * One step of dense fields, `u(t), c(t) -> u(t + dt)`, as the paper writes it: `upt_scene_step` with `displacement` and `collision`.
 *
 * - `displacement`: `[K,3]`, mm; NULL uses the scene's own state.
 * - `collision`: `[K,3]`, mm, zero except at nodes in contact, where it is the displacement that is imposed by the end of the step; NULL
 *   means no contact.
 * - `out`, `out_count`, threads: as in `upt_scene_step`.
 *
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`,
 * `UPT_ERR_UNSUPPORTED`, `UPT_ERR_GUARD`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; the state does
 * not change.
 */
upt_status upt_scene_step_field(struct upt_scene *scene,
                                const float *displacement,
                                const float *collision,
                                float *out,
                                uint64_t out_count);

/**
 * Copies the last published state.
 *
 * - `view`: the region (all nodes where there is none), or the attached points; NULL: the region.
 * - `out`: `[n,3]`, mm, in the view's order.
 * - `out_count`: number of floats in `out`, 3 n.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_STATE` for the points when none are attached, `UPT_ERR_UNSUPPORTED` for another view,
 * `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_read(struct upt_scene *scene,
                          const struct upt_view *view,
                          float *out,
                          uint64_t out_count);

/**
 * Starts a step on the scene's worker thread and returns at once. An error of an earlier step that was not reported yet
 * is still reported.
 *
 * - `input`: as in `upt_scene_step`; checked and copied before the call returns.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_BUSY` while a step is in flight (unless the scene was made with `latest_wins`), `UPT_ERR_NULL`,
 * `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` and `UPT_ERR_NON_FINITE` for the input, `UPT_ERR_UNSUPPORTED` for
 * instruments in a build without feature "instruments", `UPT_ERR_STATE` if no thread can be started, `UPT_ERR_OUT_OF_MEMORY`,
 * `UPT_ERR_PANIC`.
 */
upt_status upt_scene_submit(struct upt_scene *scene,
                            const struct upt_input *input);

/**
 * Asks whether the submitted step has finished. Never waits.
 *
 * Returns `UPT_OK`, `UPT_PENDING`, or the step's error (once, also after a later submit). With `latest_wins`, `UPT_OK`
 * means that a step has finished since the last `UPT_OK`, even if another is in flight: a host that submits in every
 * frame sees every new state.
 *
 * Threads: one at a time.
 * Errors: the step's; `UPT_ERR_STATE` when nothing was submitted, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`.
 */
upt_status upt_scene_poll(struct upt_scene *scene);

/**
 * Waits for the submitted step, at most `timeout_ms` milliseconds.
 *
 * Returns `UPT_OK` when no step is in flight, `UPT_PENDING` when the time is up, or the step's error (once).
 *
 * Threads: one at a time.
 * Errors: as `upt_scene_poll`.
 */
upt_status upt_scene_wait(struct upt_scene *scene,
                          uint32_t timeout_ms);

/**
 * Interpolates between the last two states, for frames between steps. Works while a step is in flight.
 *
 * - `alpha`: 0 is the state before, 1 the last state; values from 0 to 1.
 * - `view`: as in `upt_scene_read`.
 * - `out`: `[n,3]`, mm, in the view's order.
 * - `out_count`: number of floats in `out`, 3 n.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: as `upt_scene_read`, and `UPT_ERR_NON_FINITE`.
 */
upt_status upt_scene_sample(struct upt_scene *scene,
                            double alpha,
                            const struct upt_view *view,
                            float *out,
                            uint64_t out_count);

/**
 * Limits a step to these nodes: `upt_scene_step`, `_read` and `_sample` write them alone, in this order. Fewer nodes
 * make a cheaper step.
 *
 * - `nodes`: `[n]` indices, n at most K, in any order; NULL with count 0: all nodes.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for an index of K or more or too many of
 * them, `UPT_ERR_UNSUPPORTED` for a cut body, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_set_region(struct upt_scene *scene,
                                const uint32_t *nodes,
                                uint64_t count);

/**
 * Computes any nodes of the last state, in the region or not.
 *
 * - `view`: of kind `UPT_VIEW_NODES` its nodes; others as in `upt_scene_read`.
 * - `out`: `[n,3]`, mm, in the view's order.
 * - `out_count`: number of floats in `out`, 3 n.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_BUSY`, `UPT_ERR_STATE` for nodes before the first step, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, and as
 * `upt_scene_read`.
 */
upt_status upt_scene_decode(struct upt_scene *scene,
                            const struct upt_view *view,
                            float *out,
                            uint64_t out_count);

/**
 * Attaches points to the tissue, which views of kind `UPT_VIEW_POINTS` show. They replace those attached before. A bundle of kind `upt` decodes each point in every
 * step (unless the scene has `interpolate_points`); one of kind `reduced` interpolates between nodes.
 *
 * - `points`: `[n,3]`, rest positions, mm; NULL with count 0 detaches.
 * - `count`: number of points, n.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT`,
 * `UPT_ERR_UNSUPPORTED`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_attach_points(struct upt_scene *scene,
                                   const float *points,
                                   uint64_t count);

/**
 * Copies the force, torque and penetration of each instrument at the end of the last step.
 *
 * - `out`: `[count]`, in the order of the step's instruments; set `struct_size` of every element.
 * - `count`: instruments of that step.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
 * `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` if the last step had another number of instruments.
 */
upt_status upt_scene_read_instruments(struct upt_scene *scene,
                                      struct upt_instrument_reading *out,
                                      uint64_t count);

/**
 * Copies the points of the surface that pushed or held instruments at the end of the last step, ascending by instrument.
 *
 * - `out`: `[capacity]`; NULL with capacity 0 only queries the size.
 * - `needed`: number of points, always written; may be NULL.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
 * `UPT_ERR_ARGUMENT` if capacity is too small.
 */
upt_status upt_scene_read_instrument_contacts(struct upt_scene *scene,
                                              struct upt_instrument_contact *out,
                                              uint64_t capacity,
                                              uint64_t *needed);

/**
 * Creates the shape of a tool of your own, for `UPT_SHAPE_HULL`: a closed surface of triangles with all its hollows, or the convex hull of points.
 *
 * - `points`: `[n,3]`, mm, in the tool's own frame.
 * - `point_count`: n, 4 to 100,000.
 * - `faces`: `[m,3]`, points of each triangle, all clockwise or all anticlockwise; each edge belongs to two. NULL with `face_count` 0: the convex
 *   hull of the points.
 * - `face_count`: m, at most 200,000.
 * - `out`: the new hull.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_ARGUMENT` for points that are not finite, too many, or without volume, and for a surface that is not closed,
 * crosses itself, has a part inside out or a wall of less than 0.2 mm,
 * `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_OUT_OF_MEMORY`.
 */
upt_status upt_hull_create(const float *points,
                           uint64_t point_count,
                           const uint32_t *faces,
                           uint64_t face_count,
                           struct upt_hull **out);

/**
 * Destroys a hull. Steps that were submitted with it keep what they need.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before).
 */
upt_status upt_hull_destroy(struct upt_hull *hull);

/**
 * Copies what each tie of the last step does at its end.
 *
 * - `out`: `[count]`, in the order of the step's ties; set `struct_size` of every element.
 * - `count`: ties of that step.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
 * `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` if the last step had another number of ties.
 */
upt_status upt_scene_read_ties(struct upt_scene *scene,
                               struct upt_tie_reading *out,
                               uint64_t count);

/**
 * Finds the points of the tissue nearest to places, for ties: of the domain, the surface that instruments may touch, where it is in the last state.
 *
 * - `places`: `[count,3]`, mm, in the mesh's frame; at most 1,000,000.
 * - `nodes`: `[count,3]`, `weights`: `[count,3]`: of each the nodes of a face and the weights of its corners, for `upt_tie`.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` for too many and for a bundle without a domain,
 * `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_UNSUPPORTED` for a cut body and in a build without feature "instruments"; nothing is written then.
 */
upt_status upt_scene_tie_points(struct upt_scene *scene,
                                const float *places,
                                uint64_t count,
                                uint32_t *nodes,
                                float *weights);

/**
 * Makes a bed: a tie at each free node of the domain within a region, from where the node is in the last state. Pass them in every step; a bed tears node by node.
 *
 * - `bed`: its region, and what holds there altogether: stiffness, damping and break force are shared among the ties by the area of surface around each node.
 * - `ties`: `[capacity]`, ascending by node; set `struct_size` of every element. NULL with capacity 0 only queries the size.
 * - `needed`: number of ties, written whenever there is a bed.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` for a region without such nodes or with more than
 * 256, for a number that no tie can have, and if capacity is too small; `UPT_ERR_UNSUPPORTED` for a cut body and in a build without feature "instruments";
 * `UPT_ERR_OUT_OF_MEMORY`.
 */
upt_status upt_scene_bed(struct upt_scene *scene,
                         const struct upt_bed *bed,
                         struct upt_tie *ties,
                         uint64_t capacity,
                         uint64_t *needed);

/**
 * Cuts along the way of a blade's edge through the tissue as it is now. Elements that the blade touches become two, with copies of
 * nodes where they have come apart, so that the lips lie on the blade's path to a tenth of an element's edge; mass and volume stay, and nothing moves before the
 * next step.
 *
 * The scene has more nodes then (`out->node_count`): those that there were keep their numbers, and outputs have `3 * node_count` floats. The elements make each step from then on,
 * with instruments, nodes, loads or without. Frames between steps, regions, attached points (each goes with the side on which it lies) and haptics go on. A step that
 * starts from a displacement is `UPT_ERR_UNSUPPORTED` until `upt_scene_reset`, or until a snapshot from before is restored, which is undo.
 *
 * - `stroke`: calls with the same number are one blade that goes on; another number cuts anew.
 * - `points`: `[pose_count, edge_count, 3]`, mm: the edge as a line of points, at each pose.
 * - `pose_count`: 2 or more.
 * - `edge_count`: 2 for a straight edge, or more.
 * - `out`: what was done; set `struct_size`.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for a blade that sweeps no area or more copies than
 * nodes, `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` for a scene without corrections or one whose support moves,
 * `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
 */
upt_status upt_scene_cut(struct upt_scene *scene,
                         uint32_t stroke,
                         const float *points,
                         uint64_t pose_count,
                         uint64_t edge_count,
                         struct upt_cut *out);

/**
 * Cuts as `upt_scene_cut`, by a blade that feels the tissue and that the tissue feels.
 *
 * It cuts where it goes where its edge is sharp and, until its stroke has begun to cut, is pushed with the threshold at least. Else nothing changes and
 * `out->area_mm2` is 0: an instrument that is the blade's body presses meanwhile; leave it out while the blade cuts. What it lays open takes the fracture energy: `out->force` is
 * `-G dA / ds`, and the next step ends with its reaction on the tissue there. What goes over again what its stroke has laid open feels nothing.
 *
 * - `blade`: NULL: `upt_scene_cut`.
 * - `stroke`, `points`, `pose_count`, `edge_count`, `out`: as there.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` as there and for an energy or a threshold below 0,
 * `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` as there, `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The
 * scene is then what it was.
 */
upt_status upt_scene_cut_with(struct upt_scene *scene,
                              const struct upt_blade *blade,
                              uint32_t stroke,
                              const float *points,
                              uint64_t pose_count,
                              uint64_t edge_count,
                              struct upt_cut *out);

/**
 * Removes what lies inside of an instrument, the deepest first, up to a volume: an aspirator with a rate takes that times the step. Elements go in 64 parts
 * each. What `upt_scene_cut` says of a cut scene holds.
 *
 * - `instrument`: its shape and pose; friction and mode do not matter.
 * - `most_mm3`: largest volume.
 * - `out`: what was done; set `struct_size`.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for the instrument or where nothing would be
 * left, `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut` and in a build without feature "instruments",
 * `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
 */
upt_status upt_scene_remove(struct upt_scene *scene,
                            const struct upt_instrument *instrument,
                            float most_mm3,
                            struct upt_cut *out);

/**
 * Parts tissue that is longer than `stretch` times its length at rest in some direction, across that direction as a blade would: the most stretched elements
 * first. Nothing tears unless this is called; called once before each step, a tear grows from step to step. What `upt_scene_cut` says of a cut scene holds.
 *
 * - `stroke`: calls with the same number are one tear that goes on, as in `upt_scene_cut`: what it has parted it does not part again.
 * - `stretch`: the largest principal stretch that the tissue bears, above 1; it is a property of the tissue that no bundle states.
 * - `most`: elements at most whose stretch starts a tear in this call; those that it touches part with them.
 * - `out`: what was done; set `struct_size`. `area_mm2` is what has been laid open, 0 where nothing is stretched so far.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for a stretch that is not above 1 or more copies than
 * nodes, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`, `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then
 * what it was.
 */
upt_status upt_scene_tear(struct upt_scene *scene,
                          uint32_t stroke,
                          float stretch,
                          uint32_t most,
                          struct upt_cut *out);

/**
 * Multiplies the stiffness of elements of the model's mesh: coagulation, oedema, softening. What `upt_scene_cut` says of a cut scene holds.
 *
 * - `elements`: `[count]` rows of `UPT_INDICES_TETS`.
 * - `factor`: what an element has then must lie between 0.001 and 1000 times its own stiffness.
 * - `out`: what was done; set `struct_size`.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`,
 * `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
 */
upt_status upt_scene_scale_stiffness(struct upt_scene *scene,
                                     const uint32_t *elements,
                                     uint64_t count,
                                     float factor,
                                     struct upt_cut *out);

/**
 * Takes the pieces that nothing holds out of the body.
 *
 * - `out`: what was done; set `struct_size`.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`,
 * `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
 */
upt_status upt_scene_drop_fragments(struct upt_scene *scene,
                                    struct upt_cut *out);

/**
 * Writes how many nodes the scene has now: K, and the copies that cuts have made. Wherever this header says K of a scene, it is this number. It
 * changes with `upt_scene_cut` and the calls beside it, `upt_scene_restore` and `upt_scene_reset`.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` for a place that is not aligned, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_read_node_count(struct upt_scene *scene,
                                     uint64_t *out);

/**
 * Brings the closed surface of the body up to date: the mesh's own where nothing has happened, the lips of cuts, and what removal has laid
 * bare. Tells what has changed since the last call. Where the body has not changed since, it does nothing, so it may be called in every frame.
 *
 * Vertices and slots of triangles keep their numbers, so that a renderer uploads the vertices from `first_vertex` on and the slots that
 * `upt_scene_read_surface` lists, unless `is_new` is 1. The first vertices are the nodes of the mesh, also those inside, which no triangle has;
 * vertices that nothing uses any more stay. Works on an intact body, too.
 *
 * - `out`: counts; set `struct_size`.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_RUNTIME`,
 * `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_update_surface(struct upt_scene *scene,
                                    struct upt_surface *out);

/**
 * Copies the surface as the last `upt_scene_update_surface` left it, with the counts that it gave. An array that is NULL is not wanted.
 *
 * - `rest`: `[vertex_count, 3]`, mm: where each vertex lies in the tissue at rest, for textures, also on faces that a cut has opened.
 * - `triangles`: `[triangle_count, 3]` vertices, outward; 0, 0, 0 in slots that are empty.
 * - `inside`: `[triangle_count]`: 1 where the triangle was inside of the intact body, else 0.
 * - `changed`: `[changed_count]`: the slots that the last update has changed, ascending.
 *
 * Threads: one at a time in the calls of a scene's surface; another may step meanwhile.
 * Errors: `UPT_ERR_STATE` before the first update, `UPT_ERR_ARGUMENT` for other counts and an array that is not aligned, `UPT_ERR_HANDLE`,
 * `UPT_ERR_NULL` for the scene, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_read_surface(struct upt_scene *scene,
                                  float *rest,
                                  uint64_t vertex_count,
                                  uint32_t *triangles,
                                  uint8_t *inside,
                                  uint64_t triangle_count,
                                  uint32_t *changed,
                                  uint64_t changed_count);

/**
 * Copies where the vertices of the surface are in the last published state.
 *
 * - `out`: `[vertex_count, 3]`, mm.
 * - `out_count`: number of floats in `out`, 3 `vertex_count`.
 *
 * Threads: one at a time in the calls of a scene's surface; another may step meanwhile.
 * Errors: `UPT_ERR_STATE` where the body has changed since the last `upt_scene_update_surface`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` for a scene
 * with a region, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_read_surface_positions(struct upt_scene *scene,
                                            float *out,
                                            uint64_t out_count);

/**
 * The tissue at a moment between steps, with the instruments where they are at that moment: frames without lag.
 *
 * The velocities of the last published state continue as far as the instruments do, and contact is solved at the poses given here with
 * the compliance of that time. Any frame rate works, even an uneven one, and a submitted step may be in flight. When a step arrives, the
 * frames start from where they would have been without it. They blend into the new step within two fifths of a step, or at 25 mm/s where
 * that takes longer, but always within two steps.
 *
 * - `input`: what drives the tissue, where it is at `when`: instruments, or for scenes that nodes drive these nodes and where they are.
 *   Nodes of the last step that are no longer listed are released: they lose the force that held them. `supports` says where support
 *   groups are at `when`; without any, they go on as they went. A group is seen from the first step on that moves it. Other loads are
 *   those of the step. Neither `displacement` nor `time_s` may be set. NULL: nothing touches the tissue.
 * - `when`: the moment on the clock of the steps' `time_s`, s, not before that of the last published step; for hosts whose steps have
 *   no time, the time since the last published step. Velocities are followed for two steps at most.
 * - `view`: the region, the attached points, or the vertices of the surface, `rest + out` of `upt_scene_read_surface`; NULL: the region.
 * - `out`: `[n,3]`, mm, in the view's order.
 * - `out_count`: number of floats in `out`, 3 n.
 *
 * Threads: one thread at a time presents; another may step or submit meanwhile.
 * Errors: `UPT_ERR_BUSY` while another thread presents, and if a step is in flight at the first call;
 * `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", for a bundle without a linear response or corrections, and
 * for a scene without corrections; `UPT_ERR_STATE` for the points when none are attached, and for the
 * surface where the body has changed since the last `upt_scene_update_surface`; `UPT_ERR_UNSUPPORTED` for the surface of a scene with a region; `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
 * `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`, `UPT_ERR_RUNTIME`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`,
 * `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_present(struct upt_scene *scene,
                             const struct upt_input *input,
                             double when,
                             const struct upt_view *view,
                             float *out,
                             uint64_t out_count);

/**
 * Lets a hand feel a tool: from now on, each step of the scene prepares what `upt_haptics_render` needs.
 *
 * Drive the steps of the scene as before, with this tool among their instruments. The object does not keep the scene
 * alive.
 *
 * - `options`: required, for its tool.
 * - `out`: the new object. At most 8 per scene and 64 per process.
 *
 * Threads: one at a time on the scene.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also for a hull that was destroyed), `UPT_ERR_STRUCT_SIZE`,
 * `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`, `UPT_ERR_BUSY` also while a step is in flight, `UPT_ERR_UNSUPPORTED` in a
 * build without feature "instruments", for a bundle without a linear response or corrections, and for a scene without
 * corrections; `UPT_ERR_RUNTIME`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_haptics_create(struct upt_scene *scene,
                              const struct upt_haptics_options *options,
                              struct upt_haptics **out);

/**
 * The force on the tool at a pose, with contact solved on what the last step prepared. Made for 1,000 calls a second.
 *
 * Waits for nothing, whatever the scene does: no lock, and no allocation unless it fails. A new step is blended in
 * without a jump. Out of contact the force is zero. If the scene is no longer stepped, `age_s` grows and the tissue
 * stays as elastic as the last step left it. In this call lengths are metres, forces newtons and torques newton metres.
 *
 * - `pose`: where the tool is now.
 * - `out`: set its `struct_size` first. If the call fails and `out` can be written, its force is zero.
 *
 * Threads: one at a time on the object; any other on the scene.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE` and `UPT_ERR_ARGUMENT` for the
 * pose and a time before the last; `UPT_ERR_BUSY` while another thread is in a call on this object; `UPT_ERR_STATE` once
 * the scene was destroyed; `UPT_ERR_UNSUPPORTED` in a build without feature "instruments"; `UPT_ERR_PANIC`.
 */
upt_status upt_haptics_render(struct upt_haptics *haptics,
                              const struct upt_haptic_pose *pose,
                              struct upt_haptic_force *out);

/**
 * Destroys a haptics object. Its scene stays usable.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before), `UPT_ERR_BUSY` while another thread is in
 * a call on it, `UPT_ERR_UNSUPPORTED` in a build without feature "instruments".
 */
upt_status upt_haptics_destroy(struct upt_haptics *haptics);

/**
 * Finds the nodes that rigid instruments touch, and the displacement that they impose there: the input of a step.
 *
 * The scene remembers what each place of the array touches until the array's length changes or `upt_scene_reset`: pass
 * every instrument every time, in the same order. NULL with count 0 releases all.
 *
 * - `instruments`: at most 64, all with the same `struct_size`, of every shape that `upt_scene_step` takes.
 * - `contact_nodes`: `[capacity]`, `contact_vectors`: `[capacity,3]`, mm; both may be NULL with capacity 0, which only
 *   queries the count.
 * - `contact_count`: number of contacts found, always written.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
 * `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` (also when capacity is too small),
 * `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_contacts_from_instruments(struct upt_scene *scene,
                                               const struct upt_instrument *instruments,
                                               uint64_t instrument_count,
                                               uint32_t *contact_nodes,
                                               float *contact_vectors,
                                               uint64_t capacity,
                                               uint64_t *contact_count);

/**
 * Copies the reaction of the tissue at the last step's contact nodes, in their order.
 *
 * A bundle with a linear response (`prior_forces` of the statistics is 1) gives the contact forces of that response,
 * `-A_CC^-1 c`: nodes that borrow a column of the compliance share its force, and held nodes and nodes far from the
 * domain get zero. Other bundles give the elastic force of the elements around each node at the last state. Both leave
 * out inertia and damping.
 *
 * - `out`: `[m,3]`, mN, the force on the instrument.
 * - `out_count`: number of floats in `out`, 3 m.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
 * `UPT_ERR_ARGUMENT`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; `UPT_ERR_UNSUPPORTED` also for a cut body.
 */
upt_status upt_scene_read_contact_force(struct upt_scene *scene,
                                        float *out,
                                        uint64_t out_count);

/**
 * Reports what the last step did. Set `out->struct_size` first. Works while a step is in flight and
 * on a poisoned scene.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
 */
upt_status upt_scene_read_stats(const struct upt_scene *scene,
                                struct upt_scene_stats *out);

/**
 * Reports how long the last step and its stages took. Set `out->struct_size` first. Works as `upt_scene_read_stats` does.
 *
 * Threads: any.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
 */
upt_status upt_scene_read_timing(const struct upt_scene *scene,
                                 struct upt_scene_timing *out);

/**
 * Saves the state, so that it can be restored exactly.
 *
 * - `out`: bytes; NULL with capacity 0 only queries the size.
 * - `capacity`: size of `out` in bytes.
 * - `needed`: size of the snapshot in bytes, always written; may be NULL.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` if capacity is too small,
 * `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_save(struct upt_scene *scene,
                          uint8_t *out,
                          uint64_t capacity,
                          uint64_t *needed);

/**
 * Restores a snapshot of the same model.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_SNAPSHOT`, `UPT_ERR_VERSION`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
 * `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`, `UPT_ERR_UNSUPPORTED` for one of a cut body in a scene with a region, attached points or
 * haptics; the state does not change.
 */
upt_status upt_scene_restore(struct upt_scene *scene,
                             const uint8_t *bytes,
                             uint64_t count);

/**
 * Begins to record what the scene is given: steps, submitted ones when they are made, cuts and what is like them, resets, restored snapshots and
 * regions, each as a line of JSON that `upt replay --verify` follows on any machine. Calls that fail have no line. A scene that is not at rest puts
 * its state first. The lines stay in memory until `upt_scene_take_record` takes them.
 *
 * - `every`: after how many steps the SHA-256 of what `upt_scene_read` gives is written, 1 or more; 0 ends the recording.
 *
 * Threads: one at a time.
 * Errors: `UPT_ERR_STATE` where a recording is on, where there is none to end, and where the last one has not been taken; `UPT_ERR_UNSUPPORTED` for a scene
 * with a budget of time or with a mesh of its own; `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
 */
upt_status upt_scene_record(struct upt_scene *scene,
                            uint32_t every);

/**
 * Copies the lines of the recording that were not taken before, and forgets them. One after the other they make the file: take them now and then in a long
 * session, and once after its end, whose line says that nothing is missing.
 *
 * - `out`: whole lines, UTF-8, without a NUL; NULL with capacity 0 only queries the size.
 * - `capacity`: size of `out` in bytes; more than enough is fine, since a step in flight may add a line after the size was asked for.
 * - `needed`: bytes that there are, 0 where there is no recording; always written.
 *
 * Threads: any, at any time, even while a step runs.
 * Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` if capacity is too small, `UPT_ERR_PANIC`; the lines stay.
 */
upt_status upt_scene_take_record(struct upt_scene *scene,
                                 uint8_t *out,
                                 uint64_t capacity,
                                 uint64_t *needed);

#ifdef __cplusplus
}
#endif

#endif  /* UPT_H */
