//! Which variant of a bundle's graphs a model reads.

use crate::bundle::BundleFiles;
use crate::options::{ModelOptions, Precision, Provider};

/// Which variant of the graphs to read. TensorRT narrows a float32 graph itself, so float16 there needs no variant.
pub(super) fn of_graphs(files: &BundleFiles, options: &ModelOptions) -> Precision {
    let narrows =
        |provider: &Provider| matches!(provider, Provider::TensorRt | Provider::TensorRtRtx);
    match options.precision {
        Some(Precision::F16) => {
            let has = files.graph_file("latent", Precision::F16).is_ok();
            if !has && options.providers.iter().any(narrows) {
                Precision::F32
            } else {
                Precision::F16
            }
        }
        Some(Precision::Int8) => Precision::Int8,
        Some(Precision::F32 | Precision::Bf16) | None => Precision::F32,
    }
}
