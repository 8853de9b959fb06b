//! The enumerations of the C ABI: integers of a fixed width, so that every host language can hold them, each with a name of its own, which
//! `upt.h` makes an `enum` of. Status numbers: `status.rs`.
#![allow(non_camel_case_types)] // their names in C

pub use crate::status::*;

/// What runs the networks of a model.
pub type upt_provider = i32;
/// ONNX Runtime's CPU provider and the native kernels.
pub const UPT_PROVIDER_CPU: upt_provider = 0;
/// NVIDIA CUDA.
pub const UPT_PROVIDER_CUDA: upt_provider = 1;
/// NVIDIA TensorRT.
pub const UPT_PROVIDER_TENSORRT: upt_provider = 2;
/// NVIDIA TensorRT-RTX (a plugin provider).
pub const UPT_PROVIDER_TENSORRT_RTX: upt_provider = 3;

/// What a model is.
pub type upt_kind = i32;
/// A Universal Physics Transformer.
pub const UPT_KIND_UPT: upt_kind = 0;
/// A linear-elastic response with a learned correction in a static basis.
pub const UPT_KIND_REDUCED: upt_kind = 1;

/// How much the log tells.
pub type upt_log_level = i32;
/// No messages.
pub const UPT_LOG_OFF: upt_log_level = 0;
/// Failures.
pub const UPT_LOG_ERROR: upt_log_level = 1;
/// Fallbacks, and each flag once when it rises: contacts outside the envelope, states that the guard refuses.
pub const UPT_LOG_WARN: upt_log_level = 2;
/// Loading: what was opened and which provider runs it.
pub const UPT_LOG_INFO: upt_log_level = 3;
/// Stage times.
pub const UPT_LOG_DEBUG: upt_log_level = 4;
/// Everything.
pub const UPT_LOG_TRACE: upt_log_level = 5;

/// Arithmetic of the heavy stages.
pub type upt_precision = i32;
/// 32-bit floats: the reference. In a scene's options: the model's precision.
pub const UPT_PRECISION_F32: upt_precision = 0;
/// bfloat16 products where the CPU is faster with them, 32-bit floats elsewhere; the statistics say which.
pub const UPT_PRECISION_BF16: upt_precision = 1;
/// 16-bit floats: the bundle's `*.f16.onnx`, or a GPU provider's own.
pub const UPT_PRECISION_F16: upt_precision = 2;
/// 8-bit integers: the bundle's `*.int8.onnx`.
pub const UPT_PRECISION_INT8: upt_precision = 3;
/// In options only: 32-bit floats, even in a scene of a model that was opened with another precision.
pub const UPT_PRECISION_FORCE_F32: upt_precision = 4;

/// What decodes.
pub type upt_kernel = i32;
/// The library chooses the decoder.
pub const UPT_KERNEL_AUTO: upt_kernel = 0;
/// The fused native decoder.
pub const UPT_KERNEL_NATIVE: upt_kernel = 1;
/// ONNX Runtime sessions in node tiles.
pub const UPT_KERNEL_ONNX: upt_kernel = 2;
/// ONNX Runtime, all nodes in one run with the query table resident on the device.
pub const UPT_KERNEL_RESIDENT: upt_kernel = 3;

/// Who makes a step of a `UPT_KIND_UPT` bundle.
pub type upt_step_path = i32;
/// On the CPU: split. On a device: the faster of split and whole, timed while the scene is created.
pub const UPT_STEP_AUTO: upt_step_path = 0;
/// Native encoder and message mean, then `latent.onnx` and the decoder.
pub const UPT_STEP_SPLIT: upt_step_path = 1;
/// The bundle's `step.onnx`, which decodes every node in every step.
pub const UPT_STEP_WHOLE: upt_step_path = 2;
/// The faster of split and whole, timed while the scene is created.
pub const UPT_STEP_MEASURED: upt_step_path = 3;

/// How many corrections a step gets.
pub type upt_corrections_mode = i32;
/// As many as the bundle recommends, until its own target is reached.
pub const UPT_CORRECTIONS_RECOMMENDED: upt_corrections_mode = 0;
/// None.
pub const UPT_CORRECTIONS_NONE: upt_corrections_mode = 1;
/// `count` of them; with a target or a budget at most so many.
pub const UPT_CORRECTIONS_COUNT: upt_corrections_mode = 2;
/// As many as the target needs and the budget allows, up to 64.
pub const UPT_CORRECTIONS_AUTO: upt_corrections_mode = 3;

/// A switch, for what is usually on.
pub type upt_switch = u8;
/// A switch: as usual, which its field says.
pub const UPT_SWITCH_DEFAULT: upt_switch = 0;
/// A switch: on.
pub const UPT_SWITCH_ON: upt_switch = 1;
/// A switch: off.
pub const UPT_SWITCH_OFF: upt_switch = 2;

/// What happens to a state that the guard refuses.
pub type upt_guard_policy = i32;
/// Keep the last good state and return `UPT_ERR_GUARD`. A step without contact, which the host cannot change, is treated as
/// under `UPT_GUARD_BLEND`.
pub const UPT_GUARD_HOLD: upt_guard_policy = 0;
/// Publish finite states and set flags.
pub const UPT_GUARD_REPORT: upt_guard_policy = 1;
/// Replace a refused state by the prior's or by rest, and set flags.
pub const UPT_GUARD_BLEND: upt_guard_policy = 2;

/// Bits of `flags`.
pub type upt_flag = u32;
/// A push is longer than the model was trained on.
pub const UPT_FLAG_PUSH: upt_flag = 1;
/// A contact area is outside the trained range.
pub const UPT_FLAG_CONTACT_AREA: upt_flag = 2;
/// A contact lies outside the domain.
pub const UPT_FLAG_SITE: upt_flag = 4;
/// A push changes faster than trained.
pub const UPT_FLAG_RATE: upt_flag = 8;
/// More separate contact sites than trained.
pub const UPT_FLAG_SITES: upt_flag = 16;
/// Guard: a displacement passes the bound.
pub const UPT_FLAG_BOUND: upt_flag = 32;
/// Guard: the state is not finite.
pub const UPT_FLAG_NON_FINITE: upt_flag = 64;
/// An element at the contact is inverted; with `check_inversion` any element, and the guard refuses the state.
pub const UPT_FLAG_INVERTED: upt_flag = 128;
/// Guard: the displacement grew too much in one step.
pub const UPT_FLAG_GROWTH: upt_flag = 256;
/// The learned correction was bounded.
pub const UPT_FLAG_CLAMPED: upt_flag = 512;
/// The contact block was nearly singular and was regularised.
pub const UPT_FLAG_REGULARISED: upt_flag = 1024;
/// The corrections ended with inverted elements, or had lost the contact of an instrument: the step's first guess or the linear response
/// took their place.
pub const UPT_FLAG_FELL_BACK: upt_flag = 2048;
/// The estimated error is above the scene's `error_limit_mm`.
pub const UPT_FLAG_ERROR: upt_flag = 4096;
/// Tissue lies more than 1 mm inside an instrument, or an instrument in the tissue.
pub const UPT_FLAG_DEEP: upt_flag = 8192;
/// The contact solve was cut short by its bounds or the budget and left more than 0.01 mm (`residual_mm` of the readings).
pub const UPT_FLAG_UNSOLVED: upt_flag = 16384;
/// The bundle's tissue relaxes, and this scene makes no corrections, which alone know of it: what it shows and feels is elastic.
pub const UPT_FLAG_ELASTIC: upt_flag = 32768;

/// A static set of indices of a mesh.
pub type upt_index_set = i32;
/// Nodes of the surface.
pub const UPT_SET_SURFACE_NODES: upt_index_set = 0;
/// Nodes that instruments may touch.
pub const UPT_SET_DOMAIN_NODES: upt_index_set = 1;
/// Nodes held at zero under the bundle's boundary condition.
pub const UPT_SET_FIXED_NODES: upt_index_set = 2;
/// Surface triangles, 3 node indices each, outward.
pub const UPT_SET_SURFACE_FACES: upt_index_set = 3;
/// Triangles that instruments may touch, 3 node indices each, outward.
pub const UPT_SET_DOMAIN_FACES: upt_index_set = 4;
/// Tetrahedra, 4 node indices each, positive volume.
pub const UPT_SET_TETS: upt_index_set = 5;

/// What is shown of a state.
pub type upt_view_kind = i32;
/// The region's nodes in its order; all nodes where there is no region.
pub const UPT_VIEW_REGION: upt_view_kind = 0;
/// The attached points.
pub const UPT_VIEW_POINTS: upt_view_kind = 1;
/// The vertices of the surface as the last `upt_scene_update_surface` left it, each from its place at rest: the lips of cuts too.
pub const UPT_VIEW_SURFACE: upt_view_kind = 2;
/// The view's own `nodes`, in the region or not. Only `upt_scene_decode` takes it.
pub const UPT_VIEW_NODES: upt_view_kind = 3;

/// Shape of an instrument.
pub type upt_shape = i32;
/// An instrument's shape: a capsule along local y.
pub const UPT_SHAPE_CAPSULE: upt_shape = 0;
/// An instrument's shape: a box.
pub const UPT_SHAPE_BOX: upt_shape = 1;
/// An instrument's shape: a box with rounded corners.
pub const UPT_SHAPE_SPATULA: upt_shape = 2;
/// An instrument's shape: a hull from `upt_hull_create`.
pub const UPT_SHAPE_HULL: upt_shape = 3;
/// An instrument's shape: a ball of `radius`.
pub const UPT_SHAPE_SPHERE: upt_shape = 4;

/// What an instrument does to the tissue.
pub type upt_mode = u8;
/// An instrument pushes, with Coulomb friction.
pub const UPT_MODE_SLIDE: upt_mode = 0;
/// An instrument grasps what lies within 0.5 mm of it when the mode changes to this, and holds it until the mode changes back
/// or the grasp tears off.
pub const UPT_MODE_GRASP: upt_mode = 1;

/// What a tie is tied to.
pub type upt_end = i32;
/// A tie's far end is in the mesh's frame, which goes with the support.
pub const UPT_END_SUPPORT: upt_end = 0;
/// A tie's far end is in the world, which is the mesh's frame where no support moves.
pub const UPT_END_WORLD: upt_end = 1;
/// A tie's far end is on an instrument.
pub const UPT_END_INSTRUMENT: upt_end = 2;
/// A tie's far end is another point of the tissue: a suture.
pub const UPT_END_TISSUE: upt_end = 3;

/// The library's own values are these; a difference does not compile.
const _: () = {
    use crate::model::Kind;
    use crate::options::{DecoderKernel, GuardPolicy, IndexSet, Precision, Provider, StepPath};
    use crate::stats::flag;

    macro_rules! same {
        ($($constant:ident = $value:expr;)*) => { $(assert!($constant == $value);)* };
    }
    same! {
        UPT_PROVIDER_CPU = Provider::Cpu as i32;
        UPT_PROVIDER_CUDA = Provider::Cuda as i32;
        UPT_PROVIDER_TENSORRT = Provider::TensorRt as i32;
        UPT_PROVIDER_TENSORRT_RTX = Provider::TensorRtRtx as i32;
        UPT_KIND_UPT = Kind::Upt as i32;
        UPT_KIND_REDUCED = Kind::Reduced as i32;
        UPT_PRECISION_F32 = Precision::F32 as i32;
        UPT_PRECISION_BF16 = Precision::Bf16 as i32;
        UPT_PRECISION_F16 = Precision::F16 as i32;
        UPT_PRECISION_INT8 = Precision::Int8 as i32;
        UPT_KERNEL_AUTO = DecoderKernel::Auto as i32;
        UPT_KERNEL_NATIVE = DecoderKernel::Native as i32;
        UPT_KERNEL_ONNX = DecoderKernel::Onnx as i32;
        UPT_KERNEL_RESIDENT = DecoderKernel::Resident as i32;
        UPT_STEP_AUTO = StepPath::Auto as i32;
        UPT_STEP_SPLIT = StepPath::Split as i32;
        UPT_STEP_WHOLE = StepPath::Whole as i32;
        UPT_STEP_MEASURED = StepPath::Measured as i32;
        UPT_GUARD_HOLD = GuardPolicy::Hold as i32;
        UPT_GUARD_REPORT = GuardPolicy::Report as i32;
        UPT_GUARD_BLEND = GuardPolicy::Blend as i32;
        UPT_SET_SURFACE_NODES = IndexSet::SurfaceNodes as i32;
        UPT_SET_DOMAIN_NODES = IndexSet::DomainNodes as i32;
        UPT_SET_FIXED_NODES = IndexSet::HeldNodes as i32;
        UPT_SET_SURFACE_FACES = IndexSet::SurfaceFaces as i32;
        UPT_SET_DOMAIN_FACES = IndexSet::DomainFaces as i32;
        UPT_SET_TETS = IndexSet::Tets as i32;
        UPT_FLAG_PUSH = flag::PUSH;
        UPT_FLAG_CONTACT_AREA = flag::CONTACT_AREA;
        UPT_FLAG_SITE = flag::SITE;
        UPT_FLAG_RATE = flag::RATE;
        UPT_FLAG_SITES = flag::SITES;
        UPT_FLAG_BOUND = flag::BOUND;
        UPT_FLAG_NON_FINITE = flag::NON_FINITE;
        UPT_FLAG_INVERTED = flag::INVERTED;
        UPT_FLAG_GROWTH = flag::GROWTH;
        UPT_FLAG_CLAMPED = flag::CLAMPED;
        UPT_FLAG_REGULARISED = flag::REGULARISED;
        UPT_FLAG_FELL_BACK = flag::FELL_BACK;
        UPT_FLAG_ERROR = flag::ERROR;
        UPT_FLAG_DEEP = flag::DEEP;
        UPT_FLAG_UNSOLVED = flag::UNSOLVED;
        UPT_FLAG_ELASTIC = flag::ELASTIC;
    }
};

/// The C name of a status, NUL-terminated.
pub(super) fn name(status: upt_status) -> &'static std::ffi::CStr {
    match status {
        UPT_OK => c"UPT_OK",
        UPT_PENDING => c"UPT_PENDING",
        UPT_ERR_NULL => c"UPT_ERR_NULL",
        UPT_ERR_ARGUMENT => c"UPT_ERR_ARGUMENT",
        UPT_ERR_STRUCT_SIZE => c"UPT_ERR_STRUCT_SIZE",
        UPT_ERR_HANDLE => c"UPT_ERR_HANDLE",
        UPT_ERR_BUSY => c"UPT_ERR_BUSY",
        UPT_ERR_NON_FINITE => c"UPT_ERR_NON_FINITE",
        UPT_ERR_STATE => c"UPT_ERR_STATE",
        UPT_ERR_UNSUPPORTED => c"UPT_ERR_UNSUPPORTED",
        UPT_ERR_OUT_OF_MEMORY => c"UPT_ERR_OUT_OF_MEMORY",
        UPT_ERR_RUNTIME => c"UPT_ERR_RUNTIME",
        UPT_ERR_PROVIDER => c"UPT_ERR_PROVIDER",
        UPT_ERR_IO => c"UPT_ERR_IO",
        UPT_ERR_BUNDLE => c"UPT_ERR_BUNDLE",
        UPT_ERR_VERSION => c"UPT_ERR_VERSION",
        UPT_ERR_SNAPSHOT => c"UPT_ERR_SNAPSHOT",
        UPT_ERR_GUARD => c"UPT_ERR_GUARD",
        UPT_ERR_PANIC => c"UPT_ERR_PANIC",
        _ => c"UPT_UNKNOWN",
    }
}
