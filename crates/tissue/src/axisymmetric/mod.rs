//! Equilibria of bodies of revolution, in f64: what a plane through the axis tells of cylinders between plates, of balls that are pressed in, of loads
//! on a half space.
//!
//! Displacements have no part around the axis and do not change around it, so `F` has the rows `(1 + u_r,r, 0, u_r,z)`, `(0, 1 + u_r / r, 0)` and
//! `(u_z,r, 0, 1 + u_z,z)`. Linear triangles, four to a quadrilateral, which do not lock as one would; the laws are those of [`elements`]. Newton's method
//! on their tangent, from one part of the way to the next, halved where it does not converge. Contact is without friction, by a penalty that is integrated
//! over the surface. Lengths are mm, moduli Pa, forces within this module µN and beyond it mN.

mod body;
mod equilibrium;
mod obstacle;
mod section;

pub use equilibrium::{Axis, Equilibrium, NoEquilibrium};
pub use obstacle::{Obstacle, Shape};
pub use section::{Section, halved};

#[cfg(test)]
mod tests;
