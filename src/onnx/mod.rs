//! The only place that knows `ort`: finding the library, environment, providers, sessions.
//!
//! Nothing here is touched, and no library is opened, until a model is opened or the providers are asked for.

mod choice;
mod engine_cache;
mod gpu;
mod graph;
mod locate;
mod memory;
mod placement;
#[cfg(feature = "tensorrt-rtx")]
mod plugin;
mod providers;
mod runtime;
mod sessions;
mod stage;
mod status;
mod version;

pub use choice::ProviderChoice;
pub use graph::Tensors;
pub use providers::{ProviderPlan, providers_json};
pub use runtime::Runtime;
pub use stage::{Stage, StageOptions, StageTimes};

use std::path::PathBuf;

use crate::error::Result;

/// File and build description of ONNX Runtime; loads it when needed.
pub fn loaded() -> Result<(PathBuf, String)> {
    let runtime = Runtime::get(crate::library::current().onnxruntime_path.as_deref())?;
    Ok((runtime.path().to_owned(), runtime.version().to_owned()))
}
