//! Linear tetrahedra of hyperelastic tissue: the material and its admitted ranges, the element law in f64, and the SIMD kernel
//! that sums the internal forces of a whole mesh in f32.
//!
//! The reference solver, the statics, the reaction forces and the corrections of the runtime all use this crate, so the
//! law stands once. It knows no file, no contact and no time integration.
//!
//! Units: millimetre, gram, second; stress and moduli come out in pascal, forces in micronewton, energies in nanojoule.

#![allow(
    clippy::needless_range_loop,
    reason = "components of vectors and tensors read best by index"
)]

mod batches;
mod bisection;
mod chunks;
mod cluster;
mod cut;
mod directions;
mod dispatch;
mod fault;
mod fibre_rows;
mod fibres;
mod gradients;
mod history;
mod internal_forces;
mod kernel;
mod laws;
mod material;
mod partition;
mod principal;
mod regions;
mod relaxation;
mod room;
mod slots;
mod spectrum;
mod stress_step;
mod subset;
mod tangent;
mod tetrahedra;
mod tetrahedron;
pub mod vector;

pub use batches::{Element, Kind, PADDING, shape_gradients};
pub use cut::CutTetrahedra;
pub use dispatch::Kernels;
pub use fault::MaterialError;
pub use fibres::add_mean_stress;
pub use history::StressHistory;
pub use internal_forces::{ElementForces, ParallelFor, Scratch};
pub use kernel::flops;
pub use lanes::{Isa, WIDTH};
pub use laws::{
    Fibred, Invariants, Isochoric, Law, MOST_TERMS, Matrix, MooneyRivlin, NeoHookean, Ogden, Term,
    Terms, VerondaWestmann, Yeoh,
};
pub use material::{Material, Moduli};
pub use partition::{Chunk, Partition};
pub use regions::{Laws, MOST_REGIONS, Region};
pub use relaxation::{Branch, MOST_BRANCHES, Relaxation};
pub use slots::{FLOPS_PER_NODE, PADDED};
pub use stress_step::{HistoryStep, StressStep};
pub use subset::Subset;
pub use tangent::{stiffest_pull, tangent};
pub use tetrahedra::Tetrahedra;
pub use tetrahedron::{
    Deformation, Tetrahedron, energy_density, inverse_cube_root, shape_energy, stiffening, stress,
};
