//! libupt: real-time soft tissue for game engines and simulators.
//!
//! A [`Model`] is a bundle made ready to step; a [`Scene`] is one tissue that is stepped:
//! `Scene::step` takes the displacement field `u` (or the scene's own state) and the collision field `c`
//! of the instruments, and gives the next displacement, `u[t+dt] = M(u[t], c[t])`.
//! Lengths are mm, forces mN, fields row-major `[K,3]` float32.

pub mod bundle;
#[cfg(feature = "contact")]
pub mod contact;
pub mod corrections;
pub mod envelope;
pub mod error;
pub mod ffi;
#[cfg(feature = "forces")]
pub mod forces;
pub mod graph;
pub mod grid;
pub mod guard;
#[cfg(feature = "haptics")]
pub mod haptics;
#[cfg(feature = "contact")]
pub mod instrument;
pub mod kernels;
pub mod library;
mod memory;
pub mod model;
pub mod onnx;
pub mod options;
pub mod prior;
pub mod scene;
pub mod stats;

pub use error::{Error, Result};
pub use library::{init, shutdown};
pub use model::{Kind, Model, ModelInfo};
pub use onnx::providers_json;
pub use options::{
    Corrections, DecoderKernel, GuardPolicy, IndexSet, InitOptions, ModelOptions, Precision,
    Provider, SceneOptions, StepPath, UserStream,
};
pub use scene::{Contact, Progress, Scene, StepInput};
pub use stats::{SceneStats, flag};
