//! Reference soft tissue: meshes, total Lagrangian explicit dynamics (TLED),
//! contact schemes, trajectories and error metrics.
//!
//! Units throughout: millimetre, gram, second. Stress and moduli then come out
//! in pascal, forces in micronewton and energies in nanojoule; files hold mN and mJ.

pub mod linear;
pub mod mesh;
pub mod tensors;
