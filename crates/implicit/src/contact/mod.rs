//! Contact of rigid tools with the tissue, solved: forces with no penetration and Coulomb friction at samples of the surface,
//! as loads on the tissue (`docs/guide/instruments.md`).
//!
//! | module | what |
//! |---|---|
//! | [`tool`] | what a host gives: shape, pose, how it holds; and what it gets back |
//! | [`past`] | what is remembered from step to step: poses, forces, grasps |
//! | `buried` | tools that lie in the tissue, and their way out |
//! | [`compliance`] | which compliance `A` a contact has |
//! | `column_compliance`, `delassus` | `A` at the columns that samples touch, and how samples move under forces on samples: the Delassus matrix `W = B A B^T` |
//! | `inertial_compliance` | the same at any time after a step |
//! | [`ties`] | springs from the tissue to something else, rows beside those of tools |
//! | [`state`] | where the tissue is, and where it was |
//! | [`rows`] | gaps and slips of samples near the tools, at a state of the tissue |
//! | [`problem`] | the samples near the tools, one solve for the forces on them, what the forces change, and what tools are told |
//!
//! Shapes, samples and sweeps are those of the reference solver (crate `contact`). Lengths mm, forces mN.
//!
//! REQ-041: A pressed tool leaves no penetration, feels a force back, and none once it is lifted.

mod buried;
mod column_compliance;
pub mod compliance;
mod delassus;
mod in_lanes;
mod inertial_compliance;
pub mod past;
pub mod problem;
pub mod rows;
mod solid;
pub mod state;
mod stored;
pub mod ties;
pub mod tool;
mod tool_use;

pub use compliance::{Compliance, Tangent};
pub use delassus::Delassus;
pub use past::{Force, Past};
pub use problem::ContactProblem;
pub(crate) use problem::bound_work;
pub use rows::Pair;
pub use state::State;
pub use state::vector;
pub use ties::{HeldTie, MAX_TIES, Placed, Points};
pub use tool::{ContactReport, MAX_TOOLS, Mode, PUT_MM, Push, TieReading, Tool, ToolReading};
pub use tool_use::ToolUse;
