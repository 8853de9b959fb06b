//! Where an instrument touches, and which way it pushes.
//!
//! A patch grows from a seed face of `domain`, face by face over shared edges,
//! the face whose centroid is nearest to the seed's first, so that it stays
//! centred and never leaves `domain`. Its size is an area: the paper's count of
//! faces times the area of a face of edge 2.5 mm, so loads compare across meshes.

use crate::mesh::{
    Boundary, FaceAdjacency, Mesh, face_area, face_centroid, face_normal, face_values,
};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Area of one of the paper's collision faces, an equilateral triangle of edge 2.5 mm, mm².
pub const FACE_AREA_MM2: f64 = 2.706_329_386_826_37;

/// A patch that cannot be placed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ContactError {
    #[error("the mesh has no `domain` faces; instruments have nowhere to touch")]
    EmptyDomain,
    #[error("seed {seed} is not a row of `domain` ({count} rows)")]
    SeedOutOfRange { seed: usize, count: usize },
    #[error(
        "domain face {seed} grows to only {reached_mm2:.1} of {wanted_mm2:.1} mm²: its part of `domain` is too small for this load"
    )]
    DomainTooSmall {
        seed: usize,
        reached_mm2: f64,
        wanted_mm2: f64,
    },
    #[error("every node of the patch around domain face {seed} is held by the boundary condition")]
    AllHeld { seed: usize },
}

/// The touchable surface of a mesh under one boundary condition, ready to grow patches on.
pub struct ContactDomain {
    faces: Vec<[u32; 3]>,
    centroids: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    areas: Vec<f64>,
    adjacency: FaceAdjacency,
    held: Vec<bool>,
}

/// Touched faces and nodes, with the frame that pushes are expressed in.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Row of `domain` that the patch grew from.
    pub seed: usize,
    /// Centroid of the seed face, mm.
    pub site: [f64; 3],
    /// Rows of `domain`, in the order they were added.
    pub faces: Vec<u32>,
    /// Free nodes of the faces, ascending.
    pub nodes: Vec<u32>,
    /// mm².
    pub area_mm2: f64,
    /// Unit direction into the tissue: minus the seed face's outward normal.
    pub inward: [f64; 3],
    /// Two unit vectors that complete `inward` to a right-handed frame.
    pub tangents: [[f64; 3]; 2],
}

impl ContactDomain {
    /// Reads the mesh's `domain`; nodes held under `boundary` are never contact nodes.
    pub fn new(mesh: &Mesh, boundary: Boundary) -> Result<Self, ContactError> {
        if mesh.domain.is_empty() {
            return Err(ContactError::EmptyDomain);
        }
        let faces: Vec<[u32; 3]> = mesh
            .domain
            .iter()
            .map(|row| mesh.surface[*row as usize])
            .collect();
        let mut held = vec![false; mesh.node_count()];
        for node in mesh.held_nodes(boundary) {
            held[node as usize] = true;
        }
        Ok(Self {
            centroids: face_values(&faces, |f| face_centroid(&mesh.positions, f)),
            normals: face_values(&faces, |f| face_normal(&mesh.positions, f)),
            areas: face_values(&faces, |f| face_area(&mesh.positions, f)),
            adjacency: FaceAdjacency::new(&faces),
            faces,
            held,
        })
    }

    /// Number of faces in `domain`.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Centroids of the `domain` faces, mm.
    pub fn centroids(&self) -> &[[f64; 3]] {
        &self.centroids
    }

    /// Grows a patch of at least `area_mm2` from `seed`, a row of `domain`.
    pub fn grow(&self, seed: usize, area_mm2: f64) -> Result<Patch, ContactError> {
        if seed >= self.faces.len() {
            return Err(ContactError::SeedOutOfRange {
                seed,
                count: self.faces.len(),
            });
        }
        let distance = |face: usize| -> f64 {
            let (a, b) = (self.centroids[face], self.centroids[seed]);
            (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
        };
        // Squared distances are not negative, so their bits order like their values.
        let mut front = BinaryHeap::from([Reverse((0u64, seed))]);
        let mut seen = vec![false; self.faces.len()];
        seen[seed] = true;
        let mut faces = Vec::new();
        let mut reached = 0.0;
        while reached < area_mm2 {
            let Some(Reverse((_, face))) = front.pop() else {
                return Err(ContactError::DomainTooSmall {
                    seed,
                    reached_mm2: reached,
                    wanted_mm2: area_mm2,
                });
            };
            faces.push(face as u32);
            reached += self.areas[face];
            for next in self.adjacency.of(face) {
                let next = *next as usize;
                if !seen[next] {
                    seen[next] = true;
                    front.push(Reverse((distance(next).to_bits(), next)));
                }
            }
        }
        let mut nodes: Vec<u32> = faces
            .iter()
            .flat_map(|face| self.faces[*face as usize])
            .filter(|node| !self.held[*node as usize])
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        if nodes.is_empty() {
            return Err(ContactError::AllHeld { seed });
        }
        let inward = self.normals[seed].map(|v| -v);
        Ok(Patch {
            seed,
            site: self.centroids[seed],
            faces,
            nodes,
            area_mm2: reached,
            tangents: tangents(inward),
            inward,
        })
    }
}

impl Patch {
    /// Unit push direction: `inward` tilted by `phi` towards the tangent at angle `theta`, radians.
    pub fn direction(&self, phi: f64, theta: f64) -> [f64; 3] {
        let [a, b] = self.tangents;
        [0, 1, 2].map(|k| {
            phi.cos() * self.inward[k] + phi.sin() * (theta.cos() * a[k] + theta.sin() * b[k])
        })
    }
}

/// Two tangents of a unit vector; the first lies as close as it can to the axis
/// (z, or y for vectors near z), so neighbouring sites get nearly the same frame.
fn tangents(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let axis = if normal[2].abs() < 0.9 {
        [0.0, 0.0, 1.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let along: f64 = (0..3).map(|k| axis[k] * normal[k]).sum();
    let first = [0, 1, 2].map(|k| axis[k] - along * normal[k]);
    let length = first.iter().map(|v| v * v).sum::<f64>().sqrt();
    let a = first.map(|v| v / length);
    let b = [
        normal[1] * a[2] - normal[2] * a[1],
        normal[2] * a[0] - normal[0] * a[2],
        normal[0] * a[1] - normal[1] * a[0],
    ];
    [a, b]
}
