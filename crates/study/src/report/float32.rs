//! The plain float32 path of a bundle, from which deviations are measured.

use anyhow::Result;

use super::measure::{self, Plan};
use super::method::Method;
use yardstick::setting::{Precision, Provider, Region};

/// The frames of the first case, from the second on, by the plain float32 path of the method's bundle: CPU, one thread, all nodes.
pub(super) fn float32_frames(
    method: &Method,
    plan: &Plan<'_>,
) -> Result<Option<Vec<Vec<[f32; 3]>>>> {
    let Method::Surrogate {
        bundle,
        corrections,
        ..
    } = method
    else {
        return Ok(None);
    };
    let plain = Method::Surrogate {
        bundle: bundle.clone(),
        provider: Provider::Cpu,
        precision: Precision::F32,
        region: Region::All,
        threads: 1,
        corrections: *corrections,
    };
    let quick = Plan {
        case_limit: 1,
        pictured: &[],
        hausdorff: false,
        ..*plan
    };
    let mut keep = Some(Vec::new());
    measure::measure(&plain, &quick, None, &mut keep, &|_, _| ())?;
    Ok(keep)
}
