//! ONNX Runtime: the providers that a model may run on, and stages, each a graph with tensors bound to it.
//!
//! `linked` is the only place that knows the crate `ort`. A build without the feature `learned` has `left_out` in its place, with the
//! same names: there no runtime and no stage is ever made. Nothing here is touched, and no library is opened, until a model
//! that has a graph is opened or the providers are asked for.
//!
//! REQ-019: A process opens only the libraries that its models need: without networks no ONNX Runtime.

mod choice;
#[cfg(not(feature = "learned"))]
mod left_out;
#[cfg(feature = "learned")]
mod linked;
mod plan;
mod tensors;

#[cfg(not(feature = "learned"))]
use left_out as backend;
#[cfg(feature = "learned")]
use linked as backend;

pub use backend::{Runtime, Stage, providers_json};
pub use choice::ProviderChoice;
pub use plan::ProviderPlan;
pub use tensors::{StageOptions, StageTimes, Tensors};
