//! Contact of rigid tools with soft tissue: one definition for the reference solver and the runtime.
//!
//! | module | what |
//! |---|---|
//! | [`shape`], [`body`] | a tool's shape; signed distance and outward normal at a point, ways along a line |
//! | [`pose`] | where a tool is, checked, and the way between two poses |
//! | [`samples`] | points of the tissue's surface at which contact is looked at: the rows of `B` |
//! | [`search`] | which samples are near which tool |
//! | [`friction`], [`sweeps`] | forces: no penetration, Coulomb friction, bound samples |
//! | [`grasp`] | samples that a tool holds, and when they tear off |
//! | [`tie`] | springs from the tissue to something else |
//!
//! Lengths are millimetres, single precision throughout. Nothing here knows what tissue does under a force:
//! the solver brings lumped masses, the runtime a dense compliance.
//!
//! REQ-040: A quick, thin or pointed tool does not pass through tissue between steps.
//!
//! REQ-042: Friction obeys Coulomb's law.
//!
//! REQ-045: A grasp pulls and tears off at its force.

pub mod body;
mod error;
mod follow;
pub mod friction;
pub mod grasp;
mod nearest;
pub mod pose;
mod sample;
pub mod samples;
pub mod search;
pub mod shape;
pub mod sweeps;
pub mod tie;
mod triangles;
mod wall;
mod ways;

pub use body::{Body, Nearest};
pub use error::ShapeError;
pub use follow::followed;
pub use grasp::Grasp;
pub use nearest::nearest;
pub use parry3d::math::{Matrix, Pose, Rotation, Vector};
pub use sample::Sample;
pub use samples::{Pieces, SPACING_MM, Samples};
pub use search::{Candidate, Placed, SKIN_MM, Search};
pub use shape::{Shape, THINNEST_MM};
pub use sweeps::{Contact, Law, Limits, Outcome, Rows, Sweeps, Whole};
pub use tie::{End, Spring, Tie, TiePoint};
pub use wall::LEAN;
