//! Measures of a mesh: counts, sizes, angles, inscribed radii, manifoldness.

use crate::mesh::{Mesh, components, tet_volume};
use elements::vector::{cross, dot, length, subtract};
use std::collections::BTreeMap;

/// What `upt mesh info` prints, all lengths in mm and angles in degrees.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Quality {
    pub nodes: usize,
    pub tets: usize,
    pub surface_faces: usize,
    pub surface_nodes: usize,
    pub domain_faces: usize,
    pub fixed_nodes: usize,
    pub supported_nodes: usize,
    /// Parts that share no node.
    pub components: usize,
    pub volume_mm3: f64,
    /// Of the surface, and of the part of it in `domain`.
    pub surface_area_mm2: f64,
    pub domain_area_mm2: f64,
    /// Bounding box.
    pub low_mm: [f32; 3],
    pub high_mm: [f32; 3],
    pub min_edge_mm: f64,
    pub max_edge_mm: f64,
    pub mean_edge_mm: f64,
    pub mean_surface_edge_mm: f64,
    pub min_dihedral_deg: f64,
    pub max_dihedral_deg: f64,
    pub min_tet_volume_mm3: f64,
    pub min_inscribed_radius_mm: f64,
    /// The tetrahedron with that radius.
    pub min_inscribed_radius_tet: usize,
    /// Boundary edges that do not have two faces.
    pub non_manifold_edges: Vec<[u32; 2]>,
    /// Boundary nodes whose faces form more than one fan.
    pub non_manifold_nodes: Vec<u32>,
    /// V - E + F of the surface: 2 for a ball.
    pub euler_characteristic: i64,
}

const EDGES: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [0, 2, 1, 3],
    [0, 3, 1, 2],
    [1, 2, 0, 3],
    [1, 3, 0, 2],
    [2, 3, 0, 1],
];

/// The six dihedral angles of a tetrahedron, degrees.
pub fn dihedral_angles(corners: [[f64; 3]; 4]) -> [f64; 6] {
    EDGES.map(|[i, j, k, l]| {
        let edge = subtract(corners[j], corners[i]);
        let one = cross(edge, subtract(corners[k], corners[i]));
        let other = cross(edge, subtract(corners[l], corners[i]));
        let cosine = dot(one, other) / (length(one) * length(other));
        cosine.clamp(-1.0, 1.0).acos().to_degrees()
    })
}

/// Radius of a tetrahedron's inscribed ball, `3 V / (sum of the face areas)`.
pub fn inscribed_radius(corners: [[f64; 3]; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let volume = crate::stuffing::stuffed::volume6(a, b, c, d).abs() / 6.0;
    let area =
        |p: [f64; 3], q: [f64; 3], r: [f64; 3]| 0.5 * length(cross(subtract(q, p), subtract(r, p)));
    3.0 * volume / (area(a, b, c) + area(a, b, d) + area(a, c, d) + area(b, c, d))
}

/// Measures a mesh. `O(T log T)`.
pub fn measure(mesh: &Mesh) -> Quality {
    let point = |node: u32| mesh.positions[node as usize].map(f64::from);
    let mut min_dihedral = 180.0f64;
    let mut max_dihedral = 0.0f64;
    let mut smallest = (f64::INFINITY, 0);
    let mut volume = 0.0;
    let mut min_volume = f64::INFINITY;
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(mesh.tets.len() * 6);
    for (index, &tet) in mesh.tets.iter().enumerate() {
        let corners = tet.map(point);
        for angle in dihedral_angles(corners) {
            min_dihedral = min_dihedral.min(angle);
            max_dihedral = max_dihedral.max(angle);
        }
        let radius = inscribed_radius(corners);
        if radius < smallest.0 {
            smallest = (radius, index);
        }
        let own = tet_volume(&mesh.positions, tet);
        volume += own;
        min_volume = min_volume.min(own);
        edges.extend(EDGES.map(|[i, j, ..]| [tet[i].min(tet[j]), tet[i].max(tet[j])]));
    }
    edges.sort_unstable();
    edges.dedup();
    let edge_length = |edge: &[u32; 2]| length(subtract(point(edge[0]), point(edge[1])));
    let lengths: Vec<f64> = edges.iter().map(edge_length).collect();

    let mut faces_of_edge: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for face in &mesh.surface {
        for side in 0..3 {
            let (a, b) = (face[side], face[(side + 1) % 3]);
            *faces_of_edge.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let surface_edge_sum: f64 = faces_of_edge.keys().map(edge_length).sum();
    let mut rim: Vec<u32> = mesh.surface.iter().flatten().copied().collect();
    rim.sort_unstable();
    rim.dedup();
    let area = |row: usize| crate::mesh::face_area(&mesh.positions, mesh.surface[row]);
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for p in &mesh.positions {
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    Quality {
        nodes: mesh.node_count(),
        tets: mesh.tets.len(),
        surface_faces: mesh.surface.len(),
        surface_nodes: rim.len(),
        domain_faces: mesh.domain.len(),
        fixed_nodes: mesh.fixed.len(),
        supported_nodes: mesh.supported.len(),
        components: components(mesh.node_count(), &mesh.tets).1,
        volume_mm3: volume,
        surface_area_mm2: (0..mesh.surface.len()).map(area).sum(),
        // The sum of nothing is -0.
        domain_area_mm2: mesh
            .domain
            .iter()
            .map(|&row| area(row as usize))
            .sum::<f64>()
            + 0.0,
        low_mm: low,
        high_mm: high,
        min_edge_mm: lengths.iter().copied().fold(f64::INFINITY, f64::min),
        max_edge_mm: lengths.iter().copied().fold(0.0, f64::max),
        mean_edge_mm: lengths.iter().sum::<f64>() / lengths.len() as f64,
        mean_surface_edge_mm: surface_edge_sum / faces_of_edge.len() as f64,
        min_dihedral_deg: min_dihedral,
        max_dihedral_deg: max_dihedral,
        min_tet_volume_mm3: min_volume,
        min_inscribed_radius_mm: smallest.0,
        min_inscribed_radius_tet: smallest.1,
        euler_characteristic: rim.len() as i64 - faces_of_edge.len() as i64
            + mesh.surface.len() as i64,
        non_manifold_edges: faces_of_edge
            .into_iter()
            .filter_map(|(edge, count)| (count != 2).then_some(edge))
            .collect(),
        non_manifold_nodes: non_manifold_nodes(&mesh.surface),
    }
}

/// Nodes of triangles that form more than one fan around them, ascending.
pub fn non_manifold_nodes(surface: &[[u32; 3]]) -> Vec<u32> {
    let mut faces_at: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
    for &[a, b, c] in surface {
        faces_at.entry(a).or_default().push([b, c]);
        faces_at.entry(b).or_default().push([c, a]);
        faces_at.entry(c).or_default().push([a, b]);
    }
    let mut bad = Vec::new();
    for (node, faces) in faces_at {
        // Faces at a node are neighbours where they share another node; one fan reaches all.
        let mut reached = vec![false; faces.len()];
        let mut stack = vec![0];
        while let Some(face) = stack.pop() {
            if std::mem::replace(&mut reached[face], true) {
                continue;
            }
            let shared = |other: &usize| faces[*other].iter().any(|n| faces[face].contains(n));
            stack.extend(
                (0..faces.len())
                    .filter(|other| !reached[*other])
                    .filter(shared),
            );
        }
        if reached.contains(&false) {
            bad.push(node);
        }
    }
    bad
}
