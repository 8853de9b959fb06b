//! The body that the corrections move: element forces and lumped mass.

use elements::{ElementForces, Material, Simd, Tetrahedra};

use super::pace::Diagonal;
use crate::bundle::Mesh;
use crate::kernels::Isa;

/// Made once a model.
pub struct Body {
    /// `f_int(u)`, µN.
    pub forces: ElementForces,
    /// Lumped mass `[K]`, g.
    pub mass: Vec<f32>,
    /// The same by degree of freedom `[3K]`.
    pub mass_of_dof: Vec<f32>,
    /// Held nodes `[K]`.
    pub held: Vec<bool>,
    /// The same as a list, ascending.
    pub held_nodes: Vec<u32>,
}

impl Body {
    /// Prepares the mesh of a bundle.
    pub fn new(mesh: &Mesh, material: &Material, diagonal: &Diagonal, isa: Isa) -> Body {
        let positions: Vec<[f32; 3]> = mesh.positions.as_chunks().0.to_vec();
        let tets: Vec<[u32; 4]> = mesh.tets.as_chunks().0.to_vec();
        let body = Tetrahedra {
            positions: &positions,
            tets: &tets,
            stiffness: &mesh.stiffness,
        };
        let mut held = vec![false; positions.len()];
        for &node in &mesh.held_nodes {
            held[node as usize] = true;
        }
        let mass: Vec<f32> = diagonal.mass.iter().map(|mass| *mass as f32).collect();
        let ascending = (0..mass.len() as u32).filter(|node| held[*node as usize]);
        Body {
            held_nodes: ascending.collect(),
            mass_of_dof: mass.iter().flat_map(|&mass| [mass; 3]).collect(),
            forces: ElementForces::new(body, material, simd(isa)),
            mass,
            held,
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.forces.bytes() + self.mass.len() * (4 + 12 + 1) + 4 * self.held_nodes.len()
    }
}

/// The element kernel's set for the runtime's.
fn simd(isa: Isa) -> Simd {
    match isa {
        Isa::Scalar => Simd::Scalar,
        Isa::Avx2 => Simd::Avx2,
        Isa::Avx512 if Simd::Avx512.is_available() => Simd::Avx512,
        Isa::Avx512 => Simd::Avx2,
        Isa::Neon => Simd::Neon,
    }
}
