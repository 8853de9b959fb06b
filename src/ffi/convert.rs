//! Integers of the host -> the library's enums and options.

use super::constants::*;
use super::failure::{Failure, fail};
use super::pointers::{optional_path, slice};
use super::step_structs::*;
use super::structs::*;
use crate::options::MOST_CORRECTIONS;
use crate::options::{
    Corrections, DecoderKernel, GuardPolicy, IndexSet, InitOptions, ModelOptions, Precision,
    Provider, SceneOptions, StepPath, UserStream,
};

/// A number that none of an enum's is: of a newer header, or never set.
pub(super) fn unknown<T>(field: &str, value: i32) -> Result<T, Failure> {
    fail(
        UPT_ERR_ARGUMENT,
        format!("{field} is {value}, which is not a valid value; see upt.h"),
    )
}

/// Of a list in the order of preference.
fn provider(value: i32) -> Result<Provider, Failure> {
    Ok(match value {
        UPT_PROVIDER_CPU => Provider::Cpu,
        UPT_PROVIDER_CUDA => Provider::Cuda,
        UPT_PROVIDER_TENSORRT => Provider::TensorRt,
        UPT_PROVIDER_TENSORRT_RTX => Provider::TensorRtRtx,
        _ => return unknown("providers[]", value),
    })
}

/// 0 is the default, which is f32 for a model and the model's for a scene.
fn precision(value: i32) -> Result<Option<Precision>, Failure> {
    Ok(match value {
        UPT_PRECISION_F32 => None,
        UPT_PRECISION_FORCE_F32 => Some(Precision::F32),
        UPT_PRECISION_BF16 => Some(Precision::Bf16),
        UPT_PRECISION_F16 => Some(Precision::F16),
        UPT_PRECISION_INT8 => Some(Precision::Int8),
        _ => return unknown("precision", value),
    })
}

fn kernel(value: i32) -> Result<DecoderKernel, Failure> {
    Ok(match value {
        UPT_KERNEL_AUTO => DecoderKernel::Auto,
        UPT_KERNEL_NATIVE => DecoderKernel::Native,
        UPT_KERNEL_ONNX => DecoderKernel::Onnx,
        UPT_KERNEL_RESIDENT => DecoderKernel::Resident,
        _ => return unknown("kernel", value),
    })
}

fn step_path(value: i32) -> Result<StepPath, Failure> {
    Ok(match value {
        UPT_STEP_AUTO => StepPath::Auto,
        UPT_STEP_SPLIT => StepPath::Split,
        UPT_STEP_WHOLE => StepPath::Whole,
        UPT_STEP_MEASURED => StepPath::Measured,
        _ => return unknown("step_path", value),
    })
}

fn guard_policy(value: i32) -> Result<GuardPolicy, Failure> {
    Ok(match value {
        UPT_GUARD_HOLD => GuardPolicy::Hold,
        UPT_GUARD_REPORT => GuardPolicy::Report,
        UPT_GUARD_BLEND => GuardPolicy::Blend,
        _ => return unknown("guard_policy", value),
    })
}

pub(super) fn index_set(value: i32) -> Result<IndexSet, Failure> {
    Ok(match value {
        UPT_SET_SURFACE_NODES => IndexSet::SurfaceNodes,
        UPT_SET_DOMAIN_NODES => IndexSet::DomainNodes,
        UPT_SET_FIXED_NODES => IndexSet::HeldNodes,
        UPT_SET_SURFACE_FACES => IndexSet::SurfaceFaces,
        UPT_SET_DOMAIN_FACES => IndexSet::DomainFaces,
        UPT_SET_TETS => IndexSet::Tets,
        _ => return unknown("set", value),
    })
}

/// An instrument, for each call that takes one.
pub(super) fn tool(index: usize, raw: &upt_instrument) -> Result<crate::contact::Tool, Failure> {
    use crate::contact::{Mode, Tool};
    reserved(&raw.reserved)?;
    let (at, half_extents, radius) = (raw.position, raw.half_extents, raw.radius);
    let turn = rotation(raw.rotation);
    let shape = match raw.shape {
        UPT_SHAPE_CAPSULE => ::contact::Shape::Capsule {
            half_length: half_extents[1],
            radius,
        },
        UPT_SHAPE_SPHERE => ::contact::Shape::Sphere { radius },
        UPT_SHAPE_BOX => ::contact::Shape::Box { half_extents },
        UPT_SHAPE_SPATULA => ::contact::Shape::Spatula {
            half_extents,
            radius,
        },
        UPT_SHAPE_HULL => {
            let body = super::registry::find_hull(raw.hull)?;
            return held(index, raw, Tool::of_body((*body).clone(), at, turn));
        }
        value => return unknown("instruments[].shape", value),
    };
    if !raw.hull.is_null() {
        return fail(
            UPT_ERR_ARGUMENT,
            format!("instruments[{index}]: hull is set and shape is not UPT_SHAPE_HULL"),
        );
    }
    return held(index, raw, Tool::new(&shape, at, turn));

    /// How it holds.
    fn held(
        index: usize,
        raw: &upt_instrument,
        tool: crate::error::Result<Tool>,
    ) -> Result<Tool, Failure> {
        let mut tool = tool.map_err(|error| error.of_instrument(index))?;
        tool.mode = match raw.mode {
            UPT_MODE_SLIDE => Mode::Slide,
            UPT_MODE_GRASP => Mode::Grasp,
            value => return unknown(&format!("instruments[{index}].mode"), value.into()),
        };
        (tool.friction, tool.tear_off_mn) = (raw.friction, raw.tear_off_mn);
        tool.check(index)?;
        Ok(tool)
    }
}

/// A quaternion that was never set turns nothing.
pub(super) fn rotation(raw: [f32; 4]) -> [f32; 4] {
    match raw {
        [0.0, 0.0, 0.0, 0.0] => [0.0, 0.0, 0.0, 1.0],
        raw => raw,
    }
}

/// A byte that must be 0 or 1: any other is one that was never set.
pub(super) fn flag(field: &str, value: u8) -> Result<bool, Failure> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => fail(
            UPT_ERR_ARGUMENT,
            format!("{field} is {value}; a flag is 0 or 1"),
        ),
    }
}

/// `UPT_SWITCH_*`, of which the default is on.
pub(super) fn switch(field: &str, value: upt_switch) -> Result<bool, Failure> {
    match value {
        UPT_SWITCH_DEFAULT | UPT_SWITCH_ON => Ok(true),
        UPT_SWITCH_OFF => Ok(false),
        _ => fail(
            UPT_ERR_ARGUMENT,
            format!("{field} is {value}; a switch is 0 (as usual), 1 (on) or 2 (off)"),
        ),
    }
}

/// Zero, so that a later version may give them a meaning.
pub(super) fn reserved(bytes: &[u8]) -> Result<(), Failure> {
    match bytes.iter().all(|&byte| byte == 0) {
        true => Ok(()),
        false => fail(
            UPT_ERR_ARGUMENT,
            "reserved bytes must be zero; clear the struct first",
        ),
    }
}

/// A step has no use for more threads, and a field that was never set must not start them.
const MOST_THREADS: u32 = 1024;

/// Longer lists are a count that was never set.
const MOST_PROVIDERS: u64 = 64;

fn threads(value: u32) -> Result<usize, Failure> {
    match value {
        0..=MOST_THREADS => Ok(value as usize),
        _ => fail(
            UPT_ERR_ARGUMENT,
            format!("threads is {value}; at most {MOST_THREADS} are started, 0 is the default"),
        ),
    }
}

/// # Safety
/// As the header says of the struct: pointers are NULL or valid.
pub(super) unsafe fn init_options(raw: &upt_init_options) -> Result<InitOptions, Failure> {
    Ok(InitOptions {
        threads: threads(raw.threads)?,
        // SAFETY: NULL or a C string, as the header asks.
        onnxruntime_path: unsafe { optional_path(raw.onnxruntime_path, "onnxruntime_path") }?,
    })
}

/// # Safety
/// As the header says of the struct: pointers are NULL or valid.
pub(super) unsafe fn model_options(raw: &upt_model_options) -> Result<ModelOptions, Failure> {
    if raw.provider_count > MOST_PROVIDERS {
        return fail(
            UPT_ERR_ARGUMENT,
            format!(
                "provider_count is {}; the list may hold at most {MOST_PROVIDERS}",
                raw.provider_count
            ),
        );
    }
    // SAFETY: the host passes that many elements, as the header asks.
    let providers = unsafe { slice(raw.providers, raw.provider_count, "providers") }?;
    Ok(ModelOptions {
        threads: threads(raw.threads)?,
        providers: providers
            .iter()
            .map(|&value| provider(value))
            .collect::<Result<_, _>>()?,
        device_id: raw.device_id,
        precision: precision(raw.precision)?,
        gpu_memory_limit: raw.gpu_memory_limit,
        // SAFETY: NULL or a C string, as the header asks.
        cache_dir: unsafe { optional_path(raw.cache_dir, "cache_dir") }?,
        allow_tf32: flag("allow_tf32", raw.allow_tf32)?,
        cuda_graph: flag("cuda_graph", raw.cuda_graph)?,
        // SAFETY: the host promises that a stream which is not NULL outlives the model and its scenes.
        user_stream: (!raw.user_stream.is_null())
            .then(|| unsafe { UserStream::new(raw.user_stream) }),
        fallback: switch("fallback", raw.fallback)?,
        portable: flag("portable", raw.portable)?,
    })
}

/// A struct whose fields fit together: what would be left out silently is refused.
fn corrections(raw: &upt_corrections) -> Result<Corrections, Failure> {
    let upt_corrections {
        mode,
        count,
        budget_us,
        target_mm,
    } = *raw;
    let refused = |why: String| fail(UPT_ERR_ARGUMENT, why);
    let until = |most| Corrections::Auto {
        most,
        target_mm,
        budget_us,
    };
    if mode != UPT_CORRECTIONS_COUNT && count != 0 {
        return refused(format!(
            "corrections.count is {count}, and corrections.mode is not UPT_CORRECTIONS_COUNT; set both, or leave the count at 0"
        ));
    }
    Ok(match mode {
        UPT_CORRECTIONS_RECOMMENDED if target_mm != 0.0 => {
            return refused(
                "corrections.target_mm is for UPT_CORRECTIONS_COUNT and UPT_CORRECTIONS_AUTO; with UPT_CORRECTIONS_RECOMMENDED the bundle's own target counts"
                    .into(),
            );
        }
        UPT_CORRECTIONS_RECOMMENDED if budget_us != 0 => {
            Corrections::RecommendedWithin { budget_us }
        }
        UPT_CORRECTIONS_RECOMMENDED => Corrections::Recommended,
        UPT_CORRECTIONS_NONE if budget_us != 0 || target_mm != 0.0 => {
            return refused(
                "corrections.budget_us and corrections.target_mm limit corrections, and UPT_CORRECTIONS_NONE makes none"
                    .into(),
            );
        }
        UPT_CORRECTIONS_NONE => Corrections::None,
        UPT_CORRECTIONS_COUNT if budget_us != 0 || target_mm != 0.0 => until(count),
        UPT_CORRECTIONS_COUNT => Corrections::Fixed(count),
        UPT_CORRECTIONS_AUTO => until(MOST_CORRECTIONS),
        value => return unknown("corrections.mode", value),
    })
}

pub(super) unsafe fn scene_options(raw: &upt_scene_options) -> Result<SceneOptions, Failure> {
    reserved(&raw.reserved)?;
    Ok(SceneOptions {
        threads: threads(raw.threads)?,
        kernel: kernel(raw.kernel)?,
        step_path: step_path(raw.step_path)?,
        precision: precision(raw.precision)?,
        guard_policy: guard_policy(raw.guard_policy)?,
        // SAFETY: NULL or a C string, as the header asks.
        mesh_path: unsafe { optional_path(raw.mesh_path, "mesh_path") }?,
        boundary: switch("boundary", raw.boundary)?,
        sleep: switch("sleep", raw.sleep)?,
        check_inversion: flag("check_inversion", raw.check_inversion)?,
        latest_wins: flag("latest_wins", raw.latest_wins)?,
        cubic_sampling: flag("cubic_sampling", raw.cubic_sampling)?,
        interpolate_points: flag("interpolate_points", raw.interpolate_points)?,
        corrections: corrections(&raw.corrections)?,
        error_limit_mm: raw.error_limit_mm,
        step_s: raw.step_s,
        substeps: raw.substeps.into(),
        damping_per_s: raw.damping_per_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn float32_can_be_asked_for_where_zero_inherits() {
        assert!(matches!(precision(UPT_PRECISION_F32), Ok(None)));
        let forced = precision(UPT_PRECISION_FORCE_F32);
        assert!(matches!(forced, Ok(Some(Precision::F32))));
        assert!(precision(5).is_err());
    }
}
