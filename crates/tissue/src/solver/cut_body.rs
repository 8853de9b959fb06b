//! What the solver keeps for cuts.

use crate::mesh::Mesh;
use std::collections::BTreeSet;
use topology::Body;

/// What cuts need of the mesh, and have made of it.
pub(super) struct Topology {
    pub held_nodes: Vec<u32>,
    /// Faces that tools may touch, their nodes ascending.
    pub domain: BTreeSet<[u32; 3]>,
    /// Of the mesh's elements; empty where the body is uniform.
    pub stiffness: Vec<f32>,
    /// Of the mesh's elements; empty where the body has one law.
    pub region: Vec<u8>,
    pub regions: Vec<elements::Region>,
    /// Of the mesh's elements; empty where the body has none.
    pub fibre: Vec<[f32; 3]>,
    /// Made at the first change.
    pub body: Option<Body>,
}

impl Topology {
    pub fn new(mesh: &Mesh, held_nodes: Vec<u32>) -> Topology {
        Topology {
            held_nodes,
            domain: (mesh.domain.iter())
                .map(|row| {
                    let mut face = mesh.surface[*row as usize];
                    face.sort_unstable();
                    face
                })
                .collect(),
            stiffness: mesh.stiffness.clone(),
            region: mesh.region.clone(),
            regions: mesh.regions.clone(),
            fibre: mesh.fibre.clone(),
            body: None,
        }
    }

    /// Of the mesh's elements.
    pub fn laws(&self) -> elements::Laws<'_> {
        elements::Laws {
            of_tet: &self.region,
            regions: &self.regions,
            fibre: &self.fibre,
        }
    }
}
