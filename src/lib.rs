//! libupt: real-time soft tissue for game engines and simulators.
//!
//! A [`Model`] is a bundle made ready to step; a [`Scene`] is one tissue that is stepped:
//! `Scene::step` takes the displacement field `u` (or the scene's own state) and the collision field `c`
//! of the instruments, and gives the next displacement, `u[t+dt] = M(u[t], c[t])`.
//! Lengths are mm, forces mN, fields row-major `[K,3]` float32.

#[cfg(feature = "ndarray")]
mod arrays;
#[cfg(feature = "haptics")]
pub mod haptics;
#[cfg(feature = "contact")]
pub mod instrument;

mod memory;
mod output;
mod stored;

// For the repository's own commands, benches and tests: no part of the interface, and it changes without notice.
#[doc(hidden)]
pub mod bundle;
#[doc(hidden)]
#[cfg(feature = "contact")]
pub mod contact;
#[doc(hidden)]
pub mod corrections;
#[doc(hidden)]
pub mod envelope;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod ffi;
#[doc(hidden)]
#[cfg(feature = "forces")]
pub mod forces;
#[doc(hidden)]
pub mod graph;
#[doc(hidden)]
pub mod grid;
#[doc(hidden)]
pub mod guard;
#[doc(hidden)]
pub mod kernels;
#[doc(hidden)]
pub mod library;
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod onnx;
#[doc(hidden)]
pub mod options;
#[doc(hidden)]
pub mod prior;
#[doc(hidden)]
pub mod scene;
#[doc(hidden)]
pub mod stats;

#[cfg(feature = "contact")]
pub use contact::{MAX_TOOLS, Mode, Push, Reading, Told, Tool};
pub use error::{Error, Result};
pub use library::{init, shutdown};
pub use model::{Kind, Model, ModelInfo};
pub use onnx::providers_json;
pub use options::{
    Corrections, DecoderKernel, GuardPolicy, IndexSet, InitOptions, LONGEST_STEP_S, ModelOptions,
    Precision, Provider, SHORTEST_STEP_S, SceneOptions, StepPath, UserStream,
};
pub use scene::{Contact, Progress, Scene, StepInput};
pub use stats::{SceneStats, flag};
