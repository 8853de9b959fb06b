//! The body that the corrections move: element forces, lumped mass, the 3x3 diagonal blocks of `K + kappa M`.

use elements::{ElementForces, Material, Simd, Tetrahedra, Tetrahedron};

use crate::bundle::Mesh;
use crate::kernels::Isa;

/// Made once a model and step length.
pub struct Body {
    /// `f_int(u)`, µN.
    pub forces: ElementForces,
    /// Lumped mass `[K]`, g.
    pub mass: Vec<f32>,
    /// The same by degree of freedom `[3K]`.
    pub mass_of_dof: Vec<f32>,
    /// Inverse of each node's block of `K + kappa M`, symmetric: xx, xy, xz, yy, yz, zz; mm/µN.
    pub inverse_blocks: Vec<[f32; 6]>,
    /// Held nodes `[K]`.
    pub held: Vec<bool>,
    /// The same as a list, ascending.
    pub held_nodes: Vec<u32>,
}

impl Body {
    /// Prepares the mesh of a bundle. The law's tangent at rest gives the blocks.
    pub fn new(mesh: &Mesh, material: &Material, kappa: f64, isa: Isa) -> Body {
        let positions: Vec<[f32; 3]> = mesh.positions.as_chunks().0.to_vec();
        let tets: Vec<[u32; 4]> = mesh.tets.as_chunks().0.to_vec();
        let body = Tetrahedra {
            positions: &positions,
            tets: &tets,
            stiffness: &mesh.stiffness,
        };
        let count = positions.len();
        let mut mass = vec![0.0f64; count];
        let mut blocks = vec![[0.0f64; 6]; count];
        let moduli = material.moduli();
        for (at, &corners) in tets.iter().enumerate() {
            let rest = corners.map(|node| positions[node as usize].map(f64::from));
            let stiffness = f64::from(body.stiffness_of(at));
            let tet = Tetrahedron::new(corners, rest, stiffness);
            let share = 0.25 * tet.volume / stiffness * material.density_g_mm3();
            for (node, block) in corners.into_iter().zip(tet.diagonal_blocks(moduli)) {
                mass[node as usize] += share;
                for (sum, value) in blocks[node as usize].iter_mut().zip(block) {
                    *sum += value;
                }
            }
        }
        let inverse_blocks = blocks
            .iter()
            .zip(&mass)
            .map(|(block, mass)| inverse(*block, kappa * mass))
            .collect();
        let mut held = vec![false; count];
        for &node in &mesh.held_nodes {
            held[node as usize] = true;
        }
        let mass: Vec<f32> = mass.into_iter().map(|mass| mass as f32).collect();
        let ascending = (0..count as u32).filter(|node| held[*node as usize]);
        Body {
            held_nodes: ascending.collect(),
            mass_of_dof: mass.iter().flat_map(|&mass| [mass; 3]).collect(),
            forces: ElementForces::new(body, material, simd(isa)),
            mass,
            inverse_blocks,
            held,
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.forces.bytes() + self.mass.len() * (4 + 12 + 24 + 1) + 4 * self.held_nodes.len()
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

/// Inverse of a symmetric 3x3 block with `shift` on its diagonal.
fn inverse([xx, xy, xz, yy, yz, zz]: [f64; 6], shift: f64) -> [f32; 6] {
    let matrix = nalgebra::Matrix3::new(xx + shift, xy, xz, xy, yy + shift, yz, xz, yz, zz + shift);
    let inverse = matrix
        .try_inverse()
        .unwrap_or_else(nalgebra::Matrix3::zeros);
    [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inverse[at] as f32)
}
