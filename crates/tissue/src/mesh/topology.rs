//! Geometry and connectivity: volumes, boundary faces, face adjacency, components.

use super::MeshError;
use elements::vector::{cross, dot, subtract};
use std::collections::HashMap;

/// Rest position of a node in f64, mm.
fn point(positions: &[[f32; 3]], node: u32) -> [f64; 3] {
    positions[node as usize].map(f64::from)
}

/// Signed volume of a tetrahedron, mm³; positive when node 3 sees 0, 1, 2 counter-clockwise from outside.
pub fn tet_volume(positions: &[[f32; 3]], tet: [u32; 4]) -> f64 {
    let origin = point(positions, tet[0]);
    let [a, b, c] = [1, 2, 3].map(|k| subtract(point(positions, tet[k]), origin));
    dot(a, cross(b, c)) / 6.0
}

/// Twice the area vector of a triangle, mm².
fn area_vector(positions: &[[f32; 3]], face: [u32; 3]) -> [f64; 3] {
    let origin = point(positions, face[0]);
    cross(
        subtract(point(positions, face[1]), origin),
        subtract(point(positions, face[2]), origin),
    )
}

/// Area of a triangle, mm².
pub fn face_area(positions: &[[f32; 3]], face: [u32; 3]) -> f64 {
    let vector = area_vector(positions, face);
    0.5 * dot(vector, vector).sqrt()
}

/// Unit normal of a triangle (outward for rows of `surface`).
pub fn face_normal(positions: &[[f32; 3]], face: [u32; 3]) -> [f64; 3] {
    let vector = area_vector(positions, face);
    let length = dot(vector, vector).sqrt().max(f64::MIN_POSITIVE);
    vector.map(|value| value / length)
}

/// Centroid of a triangle, mm.
pub fn face_centroid(positions: &[[f32; 3]], face: [u32; 3]) -> [f64; 3] {
    let corners = face.map(|node| point(positions, node));
    [0, 1, 2].map(|axis| (corners[0][axis] + corners[1][axis] + corners[2][axis]) / 3.0)
}

/// One value a face.
pub fn face_values<T>(faces: &[[u32; 3]], value: impl Fn([u32; 3]) -> T) -> Vec<T> {
    faces.iter().map(|face| value(*face)).collect()
}

/// The four faces of a tetrahedron, outward when its volume is positive.
fn tet_faces(tet: [u32; 4]) -> [[u32; 3]; 4] {
    let [a, b, c, d] = tet;
    [[a, c, b], [a, b, d], [a, d, c], [b, c, d]]
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Faces that belong to one tetrahedron only, outward, in the order of the tetrahedra.
///
/// Errors when a face belongs to more than two.
pub fn boundary_faces(tets: &[[u32; 4]]) -> Result<Vec<[u32; 3]>, MeshError> {
    let mut uses: HashMap<[u32; 3], u32> = HashMap::with_capacity(tets.len() * 3);
    for face in tets.iter().flat_map(|tet| tet_faces(*tet)) {
        *uses.entry(sorted(face)).or_default() += 1;
    }
    let mut boundary = Vec::new();
    for face in tets.iter().flat_map(|tet| tet_faces(*tet)) {
        match uses[&sorted(face)] {
            1 => boundary.push(face),
            2 => {}
            count => {
                return Err(MeshError::OverusedFace {
                    nodes: sorted(face),
                    count: count as usize,
                });
            }
        }
    }
    Ok(boundary)
}

/// Edge neighbours of each face (non-manifold edges connect all their faces).
pub struct FaceAdjacency {
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
}

impl FaceAdjacency {
    /// Builds the adjacency of `faces`; neighbours are ascending.
    pub fn new(faces: &[[u32; 3]]) -> Self {
        let mut edges: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
        for (row, face) in faces.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (face[k], face[(k + 1) % 3]);
                edges
                    .entry((a.min(b), a.max(b)))
                    .or_default()
                    .push(row as u32);
            }
        }
        let mut offsets = vec![0];
        let mut neighbours = Vec::new();
        for (row, face) in faces.iter().enumerate() {
            let start = neighbours.len();
            for k in 0..3 {
                let (a, b) = (face[k], face[(k + 1) % 3]);
                let sharing = &edges[&(a.min(b), a.max(b))];
                neighbours.extend(sharing.iter().filter(|other| **other != row as u32));
            }
            neighbours[start..].sort_unstable();
            offsets.push(neighbours.len() as u32);
        }
        Self {
            offsets,
            neighbours,
        }
    }

    /// Faces that share an edge with `face`.
    pub fn of(&self, face: usize) -> &[u32] {
        &self.neighbours[self.offsets[face] as usize..self.offsets[face + 1] as usize]
    }
}

/// Connected component of each node (numbered by first appearance) and their number.
pub fn components(node_count: usize, tets: &[[u32; 4]]) -> (Vec<u32>, usize) {
    let mut parent: Vec<u32> = (0..node_count as u32).collect();
    fn root(parent: &mut [u32], mut node: u32) -> u32 {
        while parent[node as usize] != node {
            parent[node as usize] = parent[parent[node as usize] as usize];
            node = parent[node as usize];
        }
        node
    }
    for tet in tets {
        let first = root(&mut parent, tet[0]);
        for node in &tet[1..] {
            let other = root(&mut parent, *node);
            parent[other as usize] = first;
        }
    }
    let mut label = vec![u32::MAX; node_count];
    let mut count = 0;
    let mut component = vec![0; node_count];
    for node in 0..node_count as u32 {
        let top = root(&mut parent, node) as usize;
        if label[top] == u32::MAX {
            label[top] = count;
            count += 1;
        }
        component[node as usize] = label[top];
    }
    (component, count as usize)
}
