//! The structs that cross the C ABI. Each begins with `struct_size`, has no implicit padding at its end that
//! carries meaning, and holds only integers, floats and pointers (blittable in C#).

use core::ffi::{c_char, c_void};
use safer_ffi::derive_ReprC;

use super::constants::{
    upt_corrections_mode, upt_flag, upt_guard_policy, upt_kernel, upt_kind, upt_log_level,
    upt_precision, upt_provider, upt_step_path, upt_switch,
};
use super::step_structs::upt_instrument;

/// A bundle made ready to step. Immutable; any number of threads may use it at once.
pub struct upt_model {
    _opaque: [u8; 0],
}

/// One deforming body. One thread at a time may change it; a second one gets `UPT_ERR_BUSY`. Any thread may read and sample
/// published states and statistics at any time.
pub struct upt_scene {
    _opaque: [u8; 0],
}

/// A tool that a hand feels. One thread at a time may use it; a second one gets `UPT_ERR_BUSY`.
pub struct upt_haptics {
    _opaque: [u8; 0],
}

/// Receives log messages (UTF-8, valid during the call) on the host's threads, during their calls. It must not call
/// the library: such a call returns `UPT_ERR_STATE`.
pub type upt_log_fn =
    Option<unsafe extern "C" fn(level: upt_log_level, message: *const c_char, user: *mut c_void)>;

/// Options of `upt_init`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_init_options {
    /// `sizeof(upt_init_options)`.
    pub struct_size: u32,
    /// Default number of threads of a model; 0 means 1.
    pub threads: u32,
    /// Path of ONNX Runtime's shared library; NULL searches the folder of libupt, then `ORT_DYLIB_PATH`, then the system.
    pub onnxruntime_path: *const c_char,
}

/// Options of `upt_model_create`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_model_options {
    /// `sizeof(upt_model_options)`.
    pub struct_size: u32,
    /// Threads that a step may use, the caller's included; 0: the default of `upt_init`.
    pub threads: u32,
    /// `UPT_PROVIDER_*` in order of preference; NULL: CPU.
    pub providers: *const upt_provider,
    /// Entries in `providers`.
    pub provider_count: u64,
    /// Device of GPU providers, from 0.
    pub device_id: i32,
    /// `UPT_PRECISION_*`.
    pub precision: upt_precision,
    /// Bytes; 0: no limit. Needs a GPU provider in `providers`.
    pub gpu_memory_limit: u64,
    /// Folder for compiled engines; NULL: they are not kept.
    pub cache_dir: *const c_char,
    /// 1: TF32 products allowed (CUDA; errors near 1e-3).
    pub allow_tf32: u8,
    /// 1: capture CUDA graphs.
    pub cuda_graph: u8,
    /// `UPT_SWITCH_*`: the next provider is tried where one cannot run the model, usually on; off: `UPT_ERR_PROVIDER`.
    pub fallback: upt_switch,
    /// 1: the same bits on every processor, for replays and lockstep; steps take longer. Reduced bundles without a network.
    pub portable: u8,
    /// A `cudaStream_t` of `device_id` that runs the graphs and must outlive the model and its scenes; NULL: ONNX Runtime makes its own.
    pub user_stream: *mut c_void,
}

/// What a model is; filled by `upt_model_read_info`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_model_info {
    /// `sizeof(upt_model_info)`, set by the caller.
    pub struct_size: u32,
    /// `UPT_KIND_*`.
    pub kind: upt_kind,
    /// K, the nodes of the bundle's mesh.
    pub node_count: u64,
    /// Tetrahedra.
    pub tet_count: u64,
    /// Boundary triangles.
    pub surface_face_count: u64,
    /// Nodes that instruments may touch.
    pub domain_node_count: u64,
    /// Nodes held at zero.
    pub held_node_count: u64,
    /// Supernodes (kind `UPT_KIND_UPT`), else 0.
    pub supernode_count: u64,
    /// Length of a step, seconds.
    pub dt: f32,
    /// Longest push that the model was trained on, mm.
    pub max_push_mm: f32,
    /// `UPT_PROVIDER_*` that runs the latent stage.
    pub provider: upt_provider,
    /// `UPT_PRECISION_*`.
    pub precision: upt_precision,
    /// Host memory of the model.
    pub memory_bytes: u64,
    /// Wall time of `upt_model_create`.
    pub load_seconds: f64,
    /// The `step_s` of `upt_scene_options` that the bundle recommends to a host that shows frames (`upt_scene_present`), seconds; `dt` where it
    /// recommends no other. For scenes with the corrections that the bundle recommends.
    pub frame_step_s: f64,
}

/// How many corrections by the elements a step gets while there is contact, in `upt_scene_options`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_corrections {
    /// `UPT_CORRECTIONS_*`.
    pub mode: upt_corrections_mode,
    /// With `UPT_CORRECTIONS_COUNT` 1 to 64; otherwise 0.
    pub count: u32,
    /// No correction starts later than this in a step, µs, but the first of a step without tools; 0: no budget. Not with `UPT_CORRECTIONS_NONE`.
    pub budget_us: u32,
    /// Corrections stop once the estimated error is below this, mm; 0: no target. Only with `UPT_CORRECTIONS_COUNT` and `UPT_CORRECTIONS_AUTO`.
    pub target_mm: f32,
}

/// Options of `upt_scene_create`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_scene_options {
    /// `sizeof(upt_scene_options)`.
    pub struct_size: u32,
    /// Threads of a step; 0: the model's.
    pub threads: u32,
    /// `UPT_KERNEL_*`: who decodes.
    pub kernel: upt_kernel,
    /// `UPT_PRECISION_*` of the native decoder; 0: the model's; `UPT_PRECISION_FORCE_F32`: float32, whatever the model's is.
    pub precision: upt_precision,
    /// `UPT_GUARD_*`.
    pub guard_policy: upt_guard_policy,
    /// A mesh of the host's own (`*.mesh.safetensors`); NULL: the bundle's.
    pub mesh_path: *const c_char,
    /// `UPT_SWITCH_*`: held nodes and nodes in contact are where they belong, usually on; off: where the networks put them.
    pub boundary: upt_switch,
    /// `UPT_SWITCH_*`: tissue at rest sleeps, usually on.
    pub sleep: upt_switch,
    /// 1: the guard looks for inverted elements in each step.
    pub check_inversion: u8,
    /// 1: a submit while a step is in flight replaces the waiting contact and does not return `UPT_ERR_BUSY`.
    pub latest_wins: u8,
    /// 1: sample with a cubic through the last states instead of a line.
    pub cubic_sampling: u8,
    /// 1: attached points are interpolated between nodes, not decoded (kind `upt`).
    pub interpolate_points: u8,
    /// The most substeps of a step that instruments drive, where one step would miss the corrections' target: 1 for none, up to 8; 0: as
    /// many as the bundle recommends. 2 or more need a target.
    pub substeps: u8,
    /// Zero.
    pub reserved: [u8; 1],
    /// `UPT_STEP_*`: who makes a step of a `UPT_KIND_UPT` bundle.
    pub step_path: upt_step_path,
    /// Corrections by the elements while there is contact; all zero: as many as the bundle recommends.
    pub corrections: upt_corrections,
    /// `UPT_FLAG_ERROR` rises if the estimated error is above this, mm; 0: never.
    pub error_limit_mm: f32,
    /// Length of a step, s: 0.01 to 0.05, or 0 for the bundle's. A length other than the bundle's needs corrections
    /// (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out.
    pub step_s: f64,
    /// Mass-proportional damping of the tissue, 1/s: 0.01 to 1000, or 0 for the bundle's. A damping other than the bundle's
    /// needs corrections (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out.
    pub damping_per_s: f64,
}

/// Options of `upt_haptics_create`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_haptics_options {
    /// `sizeof(upt_haptics_options)`.
    pub struct_size: u32,
    /// The tool's place in the array of instruments that drives the steps.
    pub instrument: u32,
    /// Its shape, mode and friction, as in that array; position and rotation say where it starts.
    pub tool: *const upt_instrument,
    /// Time over which the change that a new step brings is blended in, ms; 0: 25.
    pub blend_ms: f32,
    /// Age of a step when it arrives, ms: the time since its poses were taken; 0: as long as the step took.
    pub step_latency_ms: f32,
    /// Longest force, N; 0: no limit.
    pub force_limit_n: f32,
    /// The most that the passivity controller damps, N s/m; 0: 5.
    pub damping_limit_n_s_per_m: f32,
    /// `UPT_SWITCH_*`: passivity observer and controller, usually on.
    pub passivity: upt_switch,
    /// Zero.
    pub reserved: [u8; 7],
}

/// A tool's pose at a moment; the input of `upt_haptics_render`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_haptic_pose {
    /// `sizeof(upt_haptic_pose)`.
    pub struct_size: u32,
    /// 1: the velocities below are given; 0: they follow from the last two poses.
    pub has_velocity: u8,
    /// Zero.
    pub reserved: [u8; 3],
    /// The host's clock, s; never earlier than in the last call.
    pub time_s: f64,
    /// In the mesh's frame, metres.
    pub position_m: [f32; 3],
    /// Unit quaternion x, y, z, w; all zero is no rotation.
    pub rotation: [f32; 4],
    /// Of the tool's position.
    pub velocity_m_per_s: [f32; 3],
    /// About the axes of the mesh's frame.
    pub angular_velocity_rad_per_s: [f32; 3],
}

/// What a hand feels; filled by `upt_haptics_render`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_haptic_force {
    /// `sizeof(upt_haptic_force)`, set by the caller.
    pub struct_size: u32,
    /// Points of the surface that push or hold the tool.
    pub contact_count: u32,
    /// 1: there is a force.
    pub contact: u8,
    /// 1: the passivity controller damps.
    pub damped: u8,
    /// Zero.
    pub reserved: [u8; 6],
    /// States of the scene that this object has seen.
    pub step_count: u64,
    /// Watchdog: age of the last of these states, s.
    pub age_s: f64,
    /// Energy that the hand received, less what it gave, since the tool last touched, J; the controller takes it back.
    pub excess_energy_j: f64,
    /// On the tool, N, in the mesh's frame.
    pub force_n: [f32; 3],
    /// On the tool about its position, N m.
    pub torque_n_m: [f32; 3],
    /// `[3,3]`, row-major: how the force falls with the position, N/m. With the next two: a symmetric 6x6 stiffness of the contact alone.
    pub stiffness_n_per_m: [f32; 9],
    /// `[3,3]`, row-major: how the force falls with the rotation, N/rad; transposed, the torque with the position, N m/m.
    pub coupling_n_per_rad: [f32; 9],
    /// `[3,3]`, row-major: how the torque falls with the rotation, N m/rad.
    pub angular_stiffness_n_m_per_rad: [f32; 9],
}

/// What the last step did; filled by `upt_scene_read_stats`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_scene_stats {
    /// `sizeof(upt_scene_stats)`, set by the caller.
    pub struct_size: u32,
    /// `UPT_FLAG_*` of the last step.
    pub flags: upt_flag,
    /// Steps since creation or reset.
    pub step_count: u64,
    /// Nodes decoded in the last step.
    pub decoded_node_count: u64,
    /// Contact nodes of the last step.
    pub contact_count: u64,
    /// Bytes that the scene has allocated in addition to the model; pages that it has never touched are not resident.
    pub memory_bytes: u64,
    /// Threads of a step.
    pub threads: u32,
    /// `UPT_KERNEL_*` that decodes.
    pub kernel: upt_kernel,
    /// `UPT_PROVIDER_*` that runs the latent stage.
    pub provider: upt_provider,
    /// `UPT_PRECISION_*` of the decoder.
    pub precision: upt_precision,
    /// Largest displacement among the decoded nodes, mm.
    pub max_displacement_mm: f32,
    /// Largest ratio of push, rate of push, contact area and number of sites to what the model was trained on; above 1: outside.
    pub indicator: f32,
    /// 1: the scene sleeps.
    pub sleeping: u8,
    /// 1: a bug was caught in an earlier call; only destroy is left.
    pub poisoned: u8,
    /// 1: `upt_scene_read_contact_force` gives the contact forces of the linear response; 0: the elements' elastic forces.
    pub prior_forces: u8,
    /// Substeps of the last step; 0 if it was not split.
    pub substeps: u8,
    /// Zero.
    pub reserved: [u8; 4],
    /// `UPT_STEP_SPLIT` or `UPT_STEP_WHOLE`.
    pub step_path: upt_step_path,
    /// Corrections made in the last step.
    pub corrections: u32,
    /// Evaluations of the element forces in the last step.
    pub evaluations: u32,
    /// Residual force after the corrections divided by that before them; 0 without corrections.
    pub residual: f32,
    /// Estimated root mean square error of the corrected state over all nodes, mm; 0 without corrections.
    pub error_mm: f32,
    /// Smallest det F of the corrected state; without corrections, of the elements at the contact; 0 if there are neither.
    pub min_det: f32,
}

/// What the last step took, in milliseconds; filled by `upt_scene_read_timing`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_scene_timing {
    /// `sizeof(upt_scene_timing)`, set by the caller.
    pub struct_size: u32,
    /// Zero.
    pub reserved: [u8; 4],
    /// Steps since creation or reset, the last of which this is of: as in `upt_scene_stats`.
    pub step_count: u64,
    /// The whole step, ms; the stages follow.
    pub step_ms: f64,
    /// Input checks, ms.
    pub check_ms: f64,
    /// Contact solve and linear response, ms.
    pub prior_ms: f64,
    /// Encoder, ms.
    pub encode_ms: f64,
    /// Message mean, ms.
    pub aggregate_ms: f64,
    /// Latent network, or the whole step's graph, ms.
    pub latent_ms: f64,
    /// Decoder, ms.
    pub decode_ms: f64,
    /// Guard and publishing, ms.
    pub guard_ms: f64,
    /// Corrections, ms.
    pub corrections_ms: f64,
    /// Contact solves of instruments, ms; part of `corrections_ms`, or of `check_ms` without corrections.
    pub contact_ms: f64,
    /// Part of the stages' times: copies to a device, ms; 0 on the CPU.
    pub upload_ms: f64,
    /// Part of the stages' times: copies back from a device, ms; 0 on the CPU.
    pub download_ms: f64,
}
