//! The body that the corrections move: element forces and lumped mass.
//!
//! Shared by all scenes of a model and never changed: a cut makes another one. Mass is lumped, so
//! that `M` is diagonal and inertia costs a multiplication for each number.

use elements::{ElementForces, Material};

use super::boundary::Held;
use super::time_step::Diagonal;
use crate::bundle::Mesh;
use crate::error::Result;
use crate::kernels::Isa;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the elements of the corrections";

/// Made once a model.
#[derive(HeldBytes)]
pub struct Body {
    /// `f_int(u)`, µN.
    pub forces: ElementForces,
    /// Lumped mass `[K]`, g.
    pub mass: Vec<f32>,
    /// The same by degree of freedom `[3K]`.
    pub mass_of_dof: Vec<f32>,
    /// Held nodes, at rest.
    pub held: Held,
}

impl Body {
    /// Prepares the mesh of a bundle.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(mesh: &Mesh, material: &Material, diagonal: &Diagonal, isa: Isa) -> Result<Body> {
        let forces = ElementForces::new(mesh.tetrahedra(), material, isa);
        let forces = memory::tried(forces, WHAT)?;
        Body::of(mesh, diagonal, forces)
    }

    /// A mesh with these elements.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn of(mesh: &Mesh, diagonal: &Diagonal, forces: ElementForces) -> Result<Body> {
        let count = mesh.node_count();
        let mass = diagonal.mass.iter().map(|mass| *mass as f32);
        let mass = memory::collected(count, mass, WHAT)?;
        let of_dof = mass.iter().flat_map(|&mass| [mass; 3]);
        Ok(Body {
            mass_of_dof: memory::collected(3 * count, of_dof, WHAT)?,
            held: Held::new(count, mesh.held_nodes.iter().copied())?,
            forces,
            mass,
        })
    }
}
