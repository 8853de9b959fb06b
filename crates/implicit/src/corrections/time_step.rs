//! The length of a scene's steps, and what of the corrections follows from it: BDF2's coefficients and the diagonal blocks of
//! `K + kappa M`.

use elements::{Material, Tetrahedron};

use crate::bundle::Mesh;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the elements of the corrections";

/// BDF2 over steps of one length.
#[derive(Debug, Clone, Copy, HeldBytes)]
pub struct Integrator {
    /// Step `h`, s.
    pub step_s: f64,
    /// Mass-proportional damping `alpha`, 1/s.
    pub damping_per_s: f64,
}

impl Integrator {
    /// The same over another time, s.
    pub fn over(self, step_s: f64) -> Integrator {
        Integrator { step_s, ..self }
    }

    /// `kappa = 9/(4h²) + 3 alpha/(2h)`, 1/s²: what a displacement costs in inertia and damping, over its mass.
    pub fn kappa(&self) -> f64 {
        2.25 / (self.step_s * self.step_s) + 1.5 * self.damping_per_s / self.step_s
    }
}

/// A step's length with what is made for it.
#[derive(Debug, HeldBytes)]
pub struct TimeStep {
    /// The length and the damping that the blocks are made for.
    pub integrator: Integrator,
    /// Inverse of each node's block of `K + kappa M`, symmetric: xx, xy, xz, yy, yz, zz; mm/µN.
    pub inverse_blocks: Vec<[f32; 6]>,
}

impl TimeStep {
    /// Steps of one length for a body of these diagonal blocks.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(diagonal: &Diagonal, integrator: Integrator) -> crate::error::Result<TimeStep> {
        let kappa = integrator.kappa();
        let pairs = diagonal.blocks.iter().zip(&diagonal.mass);
        let inverses = pairs.map(|(block, mass)| inverse(*block, kappa * mass));
        Ok(TimeStep {
            integrator,
            inverse_blocks: memory::collected(diagonal.mass.len(), inverses, WHAT)?,
        })
    }
}

/// Lumped mass `[K]`, g, and the 3x3 diagonal blocks of the stiffness at rest, µN/mm.
#[derive(HeldBytes)]
pub struct Diagonal {
    /// A quarter of each element's mass at each of its corners.
    pub mass: Vec<f64>,
    /// xx, xy, xz, yy, yz, zz.
    pub(super) blocks: Vec<[f64; 6]>,
}

impl Diagonal {
    /// Of a mesh; the law's tangent at rest gives the blocks.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn of(mesh: &Mesh, material: &Material) -> crate::error::Result<Diagonal> {
        let body = mesh.tetrahedra();
        let (positions, tets) = (body.positions, body.tets);
        let count = positions.len();
        let mut mass = memory::filled(count, 0.0f64, WHAT)?;
        let mut blocks = memory::filled(count, [0.0f64; 6], WHAT)?;
        let moduli = material.moduli();
        for (at, &corners) in tets.iter().enumerate() {
            let rest = corners.map(|node| positions[node as usize].map(f64::from));
            let stiffness = f64::from(body.stiffness_of(at));
            let tet = Tetrahedron::new(corners, rest, stiffness);
            // kg/m³ in g/mm³.
            let density = 1e-6 * body.laws.density_of(at, material.density_kg_m3);
            let share = 0.25 * tet.volume / stiffness * density;
            for (node, block) in corners.into_iter().zip(tet.diagonal_blocks(moduli)) {
                mass[node as usize] += share;
                for (sum, value) in blocks[node as usize].iter_mut().zip(block) {
                    *sum += value;
                }
            }
        }
        Ok(Diagonal { mass, blocks })
    }
}

/// Inverse of a symmetric 3x3 block with `shift` on its diagonal.
/// Zero where the block has none, as at a node of no element: the preconditioner then leaves it.
pub(super) fn inverse([xx, xy, xz, yy, yz, zz]: [f64; 6], shift: f64) -> [f32; 6] {
    let matrix = nalgebra::Matrix3::new(xx + shift, xy, xz, xy, yy + shift, yz, xz, yz, zz + shift);
    let inverse = matrix
        .try_inverse()
        .unwrap_or_else(nalgebra::Matrix3::zeros);
    [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inverse[at] as f32)
}
