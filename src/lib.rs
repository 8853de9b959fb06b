//! libupt: real-time soft tissue for game engines and simulators.
//!
//! A [`Model`] is a bundle made ready to step; a [`Scene`] is one tissue that is stepped:
//! `Scene::step` takes the displacement field `u` (or the scene's own state) and the collision field `c`
//! of the instruments, and gives the next displacement, `u[t+dt] = M(u[t], c[t])`.
//! Lengths are mm, forces mN, fields row-major `[K,3]` float32.
//!
#![cfg_attr(feature = "instruments", doc = "```")]
#![cfg_attr(not(feature = "instruments"), doc = "```ignore")]
//! use std::path::Path;
//! use upt::{Contact, IndexSet, Model, ModelOptions, Scene, SceneOptions, Shape, Tool};
//!
//! # fn main() -> upt::Result<()> {
//! // A bundle's folder, here the block that lies in this package. It has no network, so it needs no ONNX Runtime.
//! let model = Model::open(Path::new("examples/block"), &ModelOptions::default())?;
//! let scene = Scene::new(model.clone(), &SceneOptions::default())?;
//! let mut u = vec![0.0; 3 * scene.node_count()]; // [K,3], mm
//!
//! // A ball of 6 mm comes down on a node that tools may touch, a millimetre a step.
//! let node = 3 * model.indices(IndexSet::DomainNodes)[0] as usize;
//! let [x, y, z] = [0, 1, 2].map(|axis| model.positions()[node + axis]);
//! let ball = Shape::Sphere { radius: 6.0 };
//! for step in 0..5 {
//!     let position = [x, y, z + 6.0 - step as f32];
//!     let tool = Tool::new(&ball, position, [0.0, 0.0, 0.0, 1.0])?;
//!     scene.step(Contact::Tools(&[tool]), Some(&mut u))?;
//! }
//! let [_, _, lift] = scene.with_contact_report(|report| report.readings[0].force); // on the tool, mN
//! assert!(u.iter().all(|x| x.is_finite()) && lift.is_finite());
//! # Ok(())
//! # }
//! ```
//!
//! The guide is `docs/guide/rust.md` of the repository; the C ABI, with all of the rules, is `docs/reference/abi.md`.

/// The guide's program is compiled with the tests.
#[cfg(all(doctest, feature = "instruments"))]
#[doc = include_str!("../docs/guide/rust.md")]
struct Guide;

mod arrays;
pub mod haptics;
pub mod instrument;

mod features;

// The layers below, under the names that the rooms here know them by.
use ::field::{self, clock, memory, output, status, stored};

// For the repository's own commands, benches and tests: no part of the interface, and it changes without notice.
#[doc(hidden)]
pub mod envelope;
#[doc(hidden)]
pub mod ffi;
#[doc(hidden)]
pub mod forces;
#[doc(hidden)]
pub mod graph;
#[doc(hidden)]
pub mod guard;
#[doc(hidden)]
pub mod library;
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod onnx;
#[doc(hidden)]
pub mod options;
#[doc(hidden)]
pub mod replay;
#[doc(hidden)]
pub mod scene;
#[doc(hidden)]
pub mod stats;

#[doc(hidden)]
pub use ::{bundle, kernels, prior};
#[doc(hidden)]
pub use ::field::{error, grid};
#[doc(hidden)]
pub use implicit::{contact, corrections};

pub use ::contact::{End as TieEnd, Shape, ShapeError, Spring, Tie, TiePoint, Vector};
#[doc(inline)]
pub use ::field::{Error, Result};
pub use contact::{ContactReport, MAX_TIES, MAX_TOOLS, Mode, Push, TieReading, Tool, ToolReading};
pub use library::{init, shutdown};
pub use model::{Kind, Model, ModelInfo};
pub use onnx::providers_json;
pub use options::{
    Corrections, DecoderKernel, GuardPolicy, IndexSet, InitOptions, LARGEST_GRAVITY,
    LONGEST_STEP_S, ModelOptions, Precision, Provider, SHORTEST_STEP_S, SceneOptions, StepPath,
    UserStream,
};
pub use scene::{
    Bed, Blade, Contact, Cut, CutSurface, GroupMotion, Loads, MAX_POINT_FORCES, MAX_PRESSURES,
    MAX_SUPPORTS, PointForce, Pressure, Progress, Scene, SceneSurface, StepInput, SupportPose,
    SurfaceUpdate, View,
};
pub use stats::{SceneStats, SceneTiming, flag};
