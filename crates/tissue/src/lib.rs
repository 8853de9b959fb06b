//! Reference soft tissue: meshes, total Lagrangian explicit dynamics (TLED),
//! contact schemes, trajectories and error metrics.
//!
//! Units throughout: millimetre, gram, second. Stress and moduli then come out
//! in pascal, forces in micronewton and energies in nanojoule; files hold mN and mJ.
//!
//! Features, both default: `files` (`mesh_import`, surface export), `linear` (`linear`, `statics`,
//! `baselines::LinearQuasiStatic`). Without them a build takes half the time.

#![allow(
    clippy::needless_range_loop,
    reason = "components of vectors and tensors read best by index"
)]

pub mod material {
    //! The material, see [`elements`].
    pub use elements::{Material, MaterialError};
}

pub mod axisymmetric;
mod band;
pub mod baselines;
pub mod contact;
pub mod cube;
pub mod dataset;
pub mod export;
pub mod hang;
#[cfg(feature = "linear")]
pub mod linear;
pub mod load_programmes;
pub mod loads;
pub mod mesh;
#[cfg(feature = "files")]
pub mod mesh_import;
pub mod mesh_quality;
pub mod metrics;
mod newton;
pub mod programmes;
pub mod regular_file;
pub mod schemes;
pub mod simulate;
pub mod solver;
#[cfg(feature = "linear")]
pub mod statics;
pub mod stuffing;
pub mod tensors;
pub mod tool_tracks;
pub mod trajectory;

// For its feature alone: see Cargo.toml.
#[cfg(feature = "linear")]
use nano_gemm as _;
