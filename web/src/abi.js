// Written by `cargo xtask header` from src/ffi/; conventions: docs/reference/abi.md.
// SPDX-License-Identifier: Apache-2.0 OR MIT
// A struct: its bytes, and [type, offset, elements] of each field; pointers have 32 bits.
export const UPT_OK = 0;
export const UPT_PENDING = 1;
export const UPT_ERR_NULL = -1;
export const UPT_ERR_ARGUMENT = -2;
export const UPT_ERR_STRUCT_SIZE = -3;
export const UPT_ERR_HANDLE = -4;
export const UPT_ERR_BUSY = -5;
export const UPT_ERR_NON_FINITE = -6;
export const UPT_ERR_STATE = -7;
export const UPT_ERR_UNSUPPORTED = -8;
export const UPT_ERR_OUT_OF_MEMORY = -9;
export const UPT_ERR_RUNTIME = -20;
export const UPT_ERR_PROVIDER = -21;
export const UPT_ERR_IO = -30;
export const UPT_ERR_BUNDLE = -31;
export const UPT_ERR_VERSION = -32;
export const UPT_ERR_SNAPSHOT = -33;
export const UPT_ERR_GUARD = -40;
export const UPT_ERR_PANIC = -90;
export const UPT_PROVIDER_CPU = 0;
export const UPT_PROVIDER_CUDA = 1;
export const UPT_PROVIDER_TENSORRT = 2;
export const UPT_PROVIDER_TENSORRT_RTX = 3;
export const UPT_KIND_UPT = 0;
export const UPT_KIND_REDUCED = 1;
export const UPT_LOG_OFF = 0;
export const UPT_LOG_ERROR = 1;
export const UPT_LOG_WARN = 2;
export const UPT_LOG_INFO = 3;
export const UPT_LOG_DEBUG = 4;
export const UPT_LOG_TRACE = 5;
export const UPT_PRECISION_F32 = 0;
export const UPT_PRECISION_BF16 = 1;
export const UPT_PRECISION_F16 = 2;
export const UPT_PRECISION_INT8 = 3;
export const UPT_PRECISION_FORCE_F32 = 4;
export const UPT_KERNEL_AUTO = 0;
export const UPT_KERNEL_NATIVE = 1;
export const UPT_KERNEL_ONNX = 2;
export const UPT_KERNEL_RESIDENT = 3;
export const UPT_STEP_AUTO = 0;
export const UPT_STEP_SPLIT = 1;
export const UPT_STEP_WHOLE = 2;
export const UPT_STEP_MEASURED = 3;
export const UPT_CORRECTIONS_RECOMMENDED = 0;
export const UPT_CORRECTIONS_NONE = 1;
export const UPT_CORRECTIONS_COUNT = 2;
export const UPT_CORRECTIONS_AUTO = 3;
export const UPT_SWITCH_DEFAULT = 0;
export const UPT_SWITCH_ON = 1;
export const UPT_SWITCH_OFF = 2;
export const UPT_GUARD_HOLD = 0;
export const UPT_GUARD_REPORT = 1;
export const UPT_GUARD_BLEND = 2;
export const UPT_FLAG_PUSH = 1;
export const UPT_FLAG_CONTACT_AREA = 2;
export const UPT_FLAG_SITE = 4;
export const UPT_FLAG_RATE = 8;
export const UPT_FLAG_SITES = 16;
export const UPT_FLAG_BOUND = 32;
export const UPT_FLAG_NON_FINITE = 64;
export const UPT_FLAG_INVERTED = 128;
export const UPT_FLAG_GROWTH = 256;
export const UPT_FLAG_CLAMPED = 512;
export const UPT_FLAG_REGULARISED = 1024;
export const UPT_FLAG_FELL_BACK = 2048;
export const UPT_FLAG_ERROR = 4096;
export const UPT_FLAG_DEEP = 8192;
export const UPT_FLAG_UNSOLVED = 16384;
export const UPT_FLAG_ELASTIC = 32768;
export const UPT_SET_SURFACE_NODES = 0;
export const UPT_SET_DOMAIN_NODES = 1;
export const UPT_SET_FIXED_NODES = 2;
export const UPT_SET_SURFACE_FACES = 3;
export const UPT_SET_DOMAIN_FACES = 4;
export const UPT_SET_TETS = 5;
export const UPT_VIEW_REGION = 0;
export const UPT_VIEW_POINTS = 1;
export const UPT_VIEW_SURFACE = 2;
export const UPT_VIEW_NODES = 3;
export const UPT_SHAPE_CAPSULE = 0;
export const UPT_SHAPE_BOX = 1;
export const UPT_SHAPE_SPATULA = 2;
export const UPT_SHAPE_HULL = 3;
export const UPT_SHAPE_SPHERE = 4;
export const UPT_MODE_SLIDE = 0;
export const UPT_MODE_GRASP = 1;
export const UPT_END_SUPPORT = 0;
export const UPT_END_WORLD = 1;
export const UPT_END_INSTRUMENT = 2;
export const UPT_END_TISSUE = 3;
export const UPT_ABI_VERSION = 1;
export const upt_init_options = {
  size: 12,
  fields: {
    struct_size: ["Uint32", 0, 1],
    threads: ["Uint32", 4, 1],
    onnxruntime_path: ["Uint32", 8, 1],
  },
};
export const upt_model_options = {
  size: 56,
  fields: {
    struct_size: ["Uint32", 0, 1],
    threads: ["Uint32", 4, 1],
    providers: ["Uint32", 8, 1],
    provider_count: ["BigUint64", 16, 1],
    device_id: ["Int32", 24, 1],
    precision: ["Int32", 28, 1],
    gpu_memory_limit: ["BigUint64", 32, 1],
    cache_dir: ["Uint32", 40, 1],
    allow_tf32: ["Uint8", 44, 1],
    cuda_graph: ["Uint8", 45, 1],
    fallback: ["Uint8", 46, 1],
    portable: ["Uint8", 47, 1],
    user_stream: ["Uint32", 48, 1],
  },
};
export const upt_model_info = {
  size: 96,
  fields: {
    struct_size: ["Uint32", 0, 1],
    kind: ["Int32", 4, 1],
    node_count: ["BigUint64", 8, 1],
    tet_count: ["BigUint64", 16, 1],
    surface_face_count: ["BigUint64", 24, 1],
    domain_node_count: ["BigUint64", 32, 1],
    held_node_count: ["BigUint64", 40, 1],
    supernode_count: ["BigUint64", 48, 1],
    dt: ["Float32", 56, 1],
    max_push_mm: ["Float32", 60, 1],
    provider: ["Int32", 64, 1],
    precision: ["Int32", 68, 1],
    memory_bytes: ["BigUint64", 72, 1],
    load_seconds: ["Float64", 80, 1],
    frame_step_s: ["Float64", 88, 1],
  },
};
export const upt_corrections = {
  size: 16,
  fields: {
    mode: ["Int32", 0, 1],
    count: ["Uint32", 4, 1],
    budget_us: ["Uint32", 8, 1],
    target_mm: ["Float32", 12, 1],
  },
};
export const upt_scene_options = {
  size: 72,
  fields: {
    struct_size: ["Uint32", 0, 1],
    threads: ["Uint32", 4, 1],
    kernel: ["Int32", 8, 1],
    precision: ["Int32", 12, 1],
    guard_policy: ["Int32", 16, 1],
    mesh_path: ["Uint32", 20, 1],
    boundary: ["Uint8", 24, 1],
    sleep: ["Uint8", 25, 1],
    check_inversion: ["Uint8", 26, 1],
    latest_wins: ["Uint8", 27, 1],
    cubic_sampling: ["Uint8", 28, 1],
    interpolate_points: ["Uint8", 29, 1],
    substeps: ["Uint8", 30, 1],
    reserved: ["Uint8", 31, 1],
    step_path: ["Int32", 32, 1],
    "corrections.mode": ["Int32", 36, 1],
    "corrections.count": ["Uint32", 40, 1],
    "corrections.budget_us": ["Uint32", 44, 1],
    "corrections.target_mm": ["Float32", 48, 1],
    error_limit_mm: ["Float32", 52, 1],
    step_s: ["Float64", 56, 1],
    damping_per_s: ["Float64", 64, 1],
  },
};
export const upt_haptics_options = {
  size: 36,
  fields: {
    struct_size: ["Uint32", 0, 1],
    instrument: ["Uint32", 4, 1],
    tool: ["Uint32", 8, 1],
    blend_ms: ["Float32", 12, 1],
    step_latency_ms: ["Float32", 16, 1],
    force_limit_n: ["Float32", 20, 1],
    damping_limit_n_s_per_m: ["Float32", 24, 1],
    passivity: ["Uint8", 28, 1],
    reserved: ["Uint8", 29, 7],
  },
};
export const upt_haptic_pose = {
  size: 72,
  fields: {
    struct_size: ["Uint32", 0, 1],
    has_velocity: ["Uint8", 4, 1],
    reserved: ["Uint8", 5, 3],
    time_s: ["Float64", 8, 1],
    position_m: ["Float32", 16, 3],
    rotation: ["Float32", 28, 4],
    velocity_m_per_s: ["Float32", 44, 3],
    angular_velocity_rad_per_s: ["Float32", 56, 3],
  },
};
export const upt_haptic_force = {
  size: 176,
  fields: {
    struct_size: ["Uint32", 0, 1],
    contact_count: ["Uint32", 4, 1],
    contact: ["Uint8", 8, 1],
    damped: ["Uint8", 9, 1],
    reserved: ["Uint8", 10, 6],
    step_count: ["BigUint64", 16, 1],
    age_s: ["Float64", 24, 1],
    excess_energy_j: ["Float64", 32, 1],
    force_n: ["Float32", 40, 3],
    torque_n_m: ["Float32", 52, 3],
    stiffness_n_per_m: ["Float32", 64, 9],
    coupling_n_per_rad: ["Float32", 100, 9],
    angular_stiffness_n_m_per_rad: ["Float32", 136, 9],
  },
};
export const upt_scene_stats = {
  size: 96,
  fields: {
    struct_size: ["Uint32", 0, 1],
    flags: ["Uint32", 4, 1],
    step_count: ["BigUint64", 8, 1],
    decoded_node_count: ["BigUint64", 16, 1],
    contact_count: ["BigUint64", 24, 1],
    memory_bytes: ["BigUint64", 32, 1],
    threads: ["Uint32", 40, 1],
    kernel: ["Int32", 44, 1],
    provider: ["Int32", 48, 1],
    precision: ["Int32", 52, 1],
    max_displacement_mm: ["Float32", 56, 1],
    indicator: ["Float32", 60, 1],
    sleeping: ["Uint8", 64, 1],
    poisoned: ["Uint8", 65, 1],
    prior_forces: ["Uint8", 66, 1],
    substeps: ["Uint8", 67, 1],
    reserved: ["Uint8", 68, 4],
    step_path: ["Int32", 72, 1],
    corrections: ["Uint32", 76, 1],
    evaluations: ["Uint32", 80, 1],
    residual: ["Float32", 84, 1],
    error_mm: ["Float32", 88, 1],
    min_det: ["Float32", 92, 1],
  },
};
export const upt_scene_timing = {
  size: 112,
  fields: {
    struct_size: ["Uint32", 0, 1],
    reserved: ["Uint8", 4, 4],
    step_count: ["BigUint64", 8, 1],
    step_ms: ["Float64", 16, 1],
    check_ms: ["Float64", 24, 1],
    prior_ms: ["Float64", 32, 1],
    encode_ms: ["Float64", 40, 1],
    aggregate_ms: ["Float64", 48, 1],
    latent_ms: ["Float64", 56, 1],
    decode_ms: ["Float64", 64, 1],
    guard_ms: ["Float64", 72, 1],
    corrections_ms: ["Float64", 80, 1],
    contact_ms: ["Float64", 88, 1],
    upload_ms: ["Float64", 96, 1],
    download_ms: ["Float64", 104, 1],
  },
};
export const upt_input = {
  size: 176,
  fields: {
    struct_size: ["Uint32", 0, 1],
    reserved: ["Uint8", 4, 4],
    instruments: ["Uint32", 8, 1],
    instrument_count: ["BigUint64", 16, 1],
    contact_nodes: ["Uint32", 24, 1],
    contact_vectors: ["Uint32", 28, 1],
    contact_count: ["BigUint64", 32, 1],
    collision: ["Uint32", 40, 1],
    displacement: ["Uint32", 44, 1],
    time_s: ["Float64", 48, 1],
    forces: ["Uint32", 56, 1],
    pressures: ["Uint32", 60, 1],
    pressure_count: ["BigUint64", 64, 1],
    ties: ["Uint32", 72, 1],
    tie_count: ["BigUint64", 80, 1],
    supports: ["Uint32", 88, 1],
    support_count: ["BigUint64", 96, 1],
    point_forces: ["Uint32", 104, 1],
    point_force_count: ["BigUint64", 112, 1],
    gravity: ["Float32", 120, 3],
    gravity_at_rest: ["Float32", 132, 3],
    support_position: ["Float32", 144, 3],
    support_rotation: ["Float32", 156, 4],
    reserved_end: ["Uint8", 172, 4],
  },
};
export const upt_tie = {
  size: 92,
  fields: {
    struct_size: ["Uint32", 0, 1],
    to: ["Int32", 4, 1],
    nodes: ["Uint32", 8, 3],
    weights: ["Float32", 20, 3],
    place: ["Float32", 32, 3],
    instrument: ["Uint32", 44, 1],
    other_nodes: ["Uint32", 48, 3],
    other_weights: ["Float32", 60, 3],
    stiffness: ["Float32", 72, 1],
    slack_mm: ["Float32", 76, 1],
    damping: ["Float32", 80, 1],
    break_mn: ["Float32", 84, 1],
    pushes: ["Uint8", 88, 1],
    reserved: ["Uint8", 89, 3],
  },
};
export const upt_tie_reading = {
  size: 24,
  fields: {
    struct_size: ["Uint32", 0, 1],
    broken: ["Uint8", 4, 1],
    broke: ["Uint8", 5, 1],
    reserved: ["Uint8", 6, 2],
    force: ["Float32", 8, 3],
    length_mm: ["Float32", 20, 1],
  },
};
export const upt_bed = {
  size: 72,
  fields: {
    struct_size: ["Uint32", 0, 1],
    radius_mm: ["Float32", 4, 1],
    centre: ["Float32", 8, 3],
    offset: ["Float32", 20, 3],
    nodes: ["Uint32", 32, 1],
    node_count: ["BigUint64", 40, 1],
    stiffness: ["Float32", 48, 1],
    slack_mm: ["Float32", 52, 1],
    damping: ["Float32", 56, 1],
    break_mn: ["Float32", 60, 1],
    pushes: ["Uint8", 64, 1],
    reserved: ["Uint8", 65, 7],
  },
};
export const upt_view = {
  size: 24,
  fields: {
    struct_size: ["Uint32", 0, 1],
    kind: ["Int32", 4, 1],
    nodes: ["Uint32", 8, 1],
    node_count: ["BigUint64", 16, 1],
  },
};
export const upt_instrument = {
  size: 68,
  fields: {
    struct_size: ["Uint32", 0, 1],
    shape: ["Int32", 4, 1],
    position: ["Float32", 8, 3],
    rotation: ["Float32", 20, 4],
    half_extents: ["Float32", 36, 3],
    radius: ["Float32", 48, 1],
    sticking: ["Uint8", 52, 1],
    mode: ["Uint8", 53, 1],
    reserved: ["Uint8", 54, 2],
    friction: ["Float32", 56, 1],
    tear_off_mn: ["Float32", 60, 1],
    hull: ["Uint32", 64, 1],
  },
};
export const upt_instrument_reading = {
  size: 44,
  fields: {
    struct_size: ["Uint32", 0, 1],
    contact_count: ["Uint32", 4, 1],
    force: ["Float32", 8, 3],
    torque: ["Float32", 20, 3],
    penetration_mm: ["Float32", 32, 1],
    torn: ["Uint8", 36, 1],
    reserved: ["Uint8", 37, 3],
    residual_mm: ["Float32", 40, 1],
  },
};
export const upt_instrument_contact = {
  size: 28,
  fields: {
    instrument: ["Uint32", 0, 1],
    position: ["Float32", 4, 3],
    force: ["Float32", 16, 3],
  },
};
export const upt_cut = {
  size: 48,
  fields: {
    struct_size: ["Uint32", 0, 1],
    fragment_count: ["Uint32", 4, 1],
    node_count: ["BigUint64", 8, 1],
    copied_count: ["BigUint64", 16, 1],
    area_mm2: ["Float32", 24, 1],
    removed_mm3: ["Float32", 28, 1],
    force: ["Float32", 32, 3],
    is_changed: ["Uint32", 44, 1],
  },
};
export const upt_blade = {
  size: 32,
  fields: {
    struct_size: ["Uint32", 0, 1],
    fracture_energy: ["Float32", 4, 1],
    threshold: ["Float32", 8, 1],
    pushed: ["Float32", 12, 1],
    ahead: ["Float32", 16, 3],
    reserved: ["Uint32", 28, 1],
  },
};
export const upt_surface = {
  size: 40,
  fields: {
    struct_size: ["Uint32", 0, 1],
    is_new: ["Uint32", 4, 1],
    vertex_count: ["BigUint64", 8, 1],
    triangle_count: ["BigUint64", 16, 1],
    first_vertex: ["BigUint64", 24, 1],
    changed_count: ["BigUint64", 32, 1],
  },
};
export const upt_point_force = {
  size: 48,
  fields: {
    struct_size: ["Uint32", 0, 1],
    nodes: ["Uint32", 4, 4],
    weights: ["Float32", 20, 4],
    force: ["Float32", 36, 3],
  },
};
export const upt_pressure = {
  size: 24,
  fields: {
    struct_size: ["Uint32", 0, 1],
    pascal: ["Float32", 4, 1],
    nodes: ["Uint32", 8, 1],
    node_count: ["BigUint64", 16, 1],
  },
};
export const upt_support = {
  size: 56,
  fields: {
    struct_size: ["Uint32", 0, 1],
    group: ["Uint32", 4, 1],
    position: ["Float32", 8, 3],
    rotation: ["Float32", 20, 4],
    let_go: ["Uint8", 36, 1],
    reserved: ["Uint8", 37, 3],
    displacements: ["Uint32", 40, 1],
    displacement_count: ["BigUint64", 48, 1],
  },
};
