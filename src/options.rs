//! What a host chooses: library, model and scene options, with their defaults.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

pub use crate::bundle::limits::*;

/// Where a stage's graph runs (values of `UPT_PROVIDER_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Provider {
    /// ONNX Runtime's CPU provider; always there.
    Cpu = 0,
    /// NVIDIA CUDA.
    Cuda = 1,
    /// NVIDIA TensorRT.
    TensorRt = 2,
    /// NVIDIA TensorRT-RTX, a plugin provider.
    TensorRtRtx = 3,
}

impl Provider {
    /// Every provider, in the order of the values.
    pub const ALL: [Provider; 4] = [
        Provider::Cpu,
        Provider::Cuda,
        Provider::TensorRt,
        Provider::TensorRtRtx,
    ];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Provider::Cpu => "cpu",
            Provider::Cuda => "cuda",
            Provider::TensorRt => "tensorrt",
            Provider::TensorRtRtx => "tensorrt-rtx",
        }
    }
}

/// What runs the decoder of a `upt` bundle (values of `UPT_KERNEL_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(i32)]
pub enum DecoderKernel {
    /// The native kernel on the CPU, [`DecoderKernel::Resident`] on a device.
    Auto = 0,
    /// The fused native kernel.
    Native = 1,
    /// ONNX Runtime, in tiles.
    Onnx = 2,
    /// ONNX Runtime, all nodes in one run with the query table resident on the device.
    Resident = 3,
}

/// What happens when the guard refuses a state (values of `UPT_GUARD_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(i32)]
pub enum GuardPolicy {
    /// Keep the last good state and return [`crate::Error::Guard`]; without contact, where no later call could do
    /// otherwise, as `Blend`.
    Hold = 0,
    /// Publish finite states and set flags.
    Report = 1,
    /// Replace the state by the linear-elastic response, or by rest where there is none, and set flags.
    Blend = 2,
}

/// A static set of indices of a model's mesh (values of `UPT_SET_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum IndexSet {
    /// Nodes of the boundary faces, ascending.
    SurfaceNodes = 0,
    /// Nodes of the faces that instruments may touch, ascending.
    DomainNodes = 1,
    /// Nodes held at zero under the bundle's boundary condition, ascending.
    HeldNodes = 2,
    /// Boundary triangles, three nodes each, outward.
    SurfaceFaces = 3,
    /// Triangles of the domain, three nodes each.
    DomainFaces = 4,
    /// Tetrahedra, four nodes each.
    Tets = 5,
}

/// Options of the process-wide part of the library.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InitOptions {
    /// Default thread count of models; 0 means 1.
    pub threads: usize,
    /// ONNX Runtime's shared library; `None` searches next to libupt, `ORT_DYLIB_PATH`, then the system.
    pub onnxruntime_path: Option<PathBuf>,
}

/// A `cudaStream_t` of the host's, for the graphs of CUDA, TensorRT and TensorRT-RTX.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UserStream(usize);

impl UserStream {
    /// Takes the stream's handle.
    ///
    /// # Safety
    /// `stream` is a CUDA stream of the model's device that outlives the model and all its scenes.
    pub unsafe fn new(stream: *mut core::ffi::c_void) -> UserStream {
        UserStream(stream as usize)
    }

    /// The handle as a number.
    pub fn address(self) -> usize {
        self.0
    }
}

/// Who makes a step of a `upt` bundle (values of `UPT_STEP_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(i32)]
pub enum StepPath {
    /// [`StepPath::Split`] on the CPU provider, [`StepPath::Measured`] on a device.
    Auto = 0,
    /// Native encoder and message mean, then `latent.onnx` and the decoder.
    Split = 1,
    /// `step.onnx` alone; every node is decoded in every step, whatever the region.
    Whole = 2,
    /// Both are timed while the scene is made, and the faster one stays. Without `step.onnx`: [`StepPath::Split`].
    Measured = 3,
}

/// Options of [`crate::Model::open`].
#[derive(Debug, Clone)]
pub struct ModelOptions {
    /// Threads of a step; 0 takes [`InitOptions::threads`].
    pub threads: usize,
    /// Providers in order of preference; empty means the CPU.
    pub providers: Vec<Provider>,
    /// GPU to use.
    pub device_id: i32,
    /// Precision asked for; what runs is in the stats. Default float32. Float16 and int8 need the bundle's variants of the
    /// graphs ([`crate::Error::Unsupported`] without), but for float16 on TensorRT, which narrows the graph itself.
    pub precision: Option<Precision>,
    /// Bytes a GPU provider may allocate; 0 means no limit.
    pub gpu_memory_limit: u64,
    /// Folder for compiled engines; `None` compiles them at each start.
    pub cache_dir: Option<PathBuf>,
    /// Allow TensorFloat-32 on CUDA (off: it costs about 1e-3 a layer in a closed loop).
    pub allow_tf32: bool,
    /// Capture a CUDA graph where shapes allow it.
    pub cuda_graph: bool,
    /// Run the graphs on this stream; `None`: one of ONNX Runtime's own. Needs a GPU provider in the list.
    pub user_stream: Option<UserStream>,
    /// Try the next provider where one cannot run the model; otherwise [`crate::Error::Provider`].
    pub fallback: bool,
    /// The same bits on every processor: one order of all sums, and multiply-adds that are rounded twice. For reduced bundles without a
    /// network; [`crate::Error::Unsupported`] for others.
    pub portable: bool,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self {
            threads: 0,
            providers: Vec::new(),
            device_id: 0,
            precision: None,
            gpu_memory_limit: 0,
            cache_dir: None,
            allow_tf32: false,
            cuda_graph: false,
            user_stream: None,
            fallback: true,
            portable: false,
        }
    }
}

/// Options of [`crate::Scene::new`].
#[derive(Debug, Clone)]
pub struct SceneOptions {
    /// Threads of a step, the host's own included; 0 takes the model's.
    pub threads: usize,
    /// Decoder of a `upt` bundle.
    pub kernel: DecoderKernel,
    /// Whether `step.onnx` makes the step of a `upt` bundle.
    pub step_path: StepPath,
    /// Precision of the native kernels; `None` takes the model's.
    pub precision: Option<Precision>,
    /// What happens when the guard refuses a state.
    pub guard_policy: GuardPolicy,
    /// A mesh of the scene's own (`upt` bundles without a prior); `None` takes the bundle's.
    pub mesh_path: Option<PathBuf>,
    /// Held nodes and nodes in contact are where they belong; otherwise where the networks put them.
    pub boundary: bool,
    /// Tissue at rest sleeps.
    pub sleep: bool,
    /// Check the sign of every decoded tetrahedron's volume.
    pub check_inversion: bool,
    /// [`crate::Scene::submit`] replaces an input that has not started instead of failing.
    pub latest_wins: bool,
    /// Cubic instead of linear [`crate::Scene::sample`].
    pub cubic_sampling: bool,
    /// Interpolate attached points between nodes instead of decoding them (kind `upt`).
    pub interpolate_points: bool,
    /// Corrections by the elements.
    pub corrections: Corrections,
    /// Raise [`crate::flag::ERROR`] where the estimated error is above this, mm; 0 for never.
    pub error_limit_mm: f32,
    /// Length of a step, s: [`SHORTEST_STEP_S`] to [`LONGEST_STEP_S`], or 0 for the bundle's. Steps of another length than the bundle's have no
    /// learned part: corrections by the elements make them all, with contact and without.
    pub step_s: f64,
    /// Substeps of a step that tools drive, at most, where it alone would err by more than the corrections' target: 1 for none, up to 8, 0 as
    /// many as the bundle recommends. From 2 only with a target.
    pub substeps: u32,
    /// Mass-proportional damping of the tissue, 1/s: [`SMALLEST_DAMPING_PER_S`] to [`LARGEST_DAMPING_PER_S`], or 0 for the bundle's. With another
    /// than the bundle's, corrections by the elements make all steps, with contact and without.
    pub damping_per_s: f64,
}

/// How many corrections a step gets while there is contact.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Corrections {
    /// As many as the bundle recommends; none where it has no tables for them.
    #[default]
    Recommended,
    /// As many as the bundle recommends, and none of them is started later than `budget_us` into the step; 0 is no budget.
    RecommendedWithin {
        /// The budget, µs.
        budget_us: u32,
    },
    /// None: they cost nothing then.
    None,
    /// This many, 1 to 64.
    Fixed(u32),
    /// As many as a target asks for and a budget lets in.
    Auto {
        /// At most this many, 1 to 64.
        most: u32,
        /// Stop where the estimated error is below this, mm; 0 for no target.
        target_mm: f32,
        /// Start no iteration after this time, µs; 0 for no budget.
        budget_us: u32,
    },
}

impl Default for SceneOptions {
    fn default() -> Self {
        SceneOptions {
            threads: 0,
            kernel: DecoderKernel::Auto,
            step_path: StepPath::Auto,
            precision: None,
            guard_policy: GuardPolicy::Hold,
            mesh_path: None,
            boundary: true,
            sleep: true,
            check_inversion: false,
            latest_wins: false,
            cubic_sampling: false,
            interpolate_points: false,
            corrections: Corrections::Recommended,
            error_limit_mm: 0.0,
            step_s: 0.0,
            substeps: 0,
            damping_per_s: 0.0,
        }
    }
}
