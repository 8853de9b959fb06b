//! What the element law needs of a mesh.

use crate::regions::Laws;

/// Rest positions, corners, relative stiffness and laws of the tetrahedra of a body.
#[derive(Clone, Copy, Debug)]
pub struct Tetrahedra<'a> {
    /// `[K,3]`, mm.
    pub positions: &'a [[f32; 3]],
    /// `[T,4]` nodes, positive volume.
    pub tets: &'a [[u32; 4]],
    /// `[T]` Young's modulus over the material's; empty where the body is uniform.
    pub stiffness: &'a [f32],
    /// Which have a law of their own.
    pub laws: Laws<'a>,
}

impl Tetrahedra<'_> {
    /// Young's modulus of tetrahedron `tet` over the material's.
    pub fn stiffness_of(&self, tet: usize) -> f32 {
        self.stiffness.get(tet).copied().unwrap_or(1.0)
    }
}
