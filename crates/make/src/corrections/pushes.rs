//! Pushes of the envelope's areas and depths, at sites that are spread over the domain.

use tissue::mesh::Mesh;
use tissue::schemes::SplitMix;

/// Depths of the pushes over the envelope's deepest.
const DEPTH: [f64; 2] = [0.4, 0.93];
/// Random sites of which the one farthest from the others is taken.
const CANDIDATES: usize = 12;

/// A push: nodes and where they go, `[3m]` mm.
pub struct Push {
    pub nodes: Vec<u32>,
    pub vectors: Vec<f32>,
}

/// Where pushes may be and how large they are.
pub struct Pushes<'a> {
    pub mesh: &'a Mesh,
    /// Nodes that may be touched.
    pub nodes: &'a [u32],
    /// Whether each node of the mesh is held.
    pub held: &'a [bool],
    /// Deepest push, mm, and area of a contact, mm², of the envelope.
    pub push_mm: f64,
    pub area_mm2: [f64; 2],
}

impl Pushes<'_> {
    /// Squared distance at rest, mm².
    pub fn distance(&self, a: u32, b: u32) -> f64 {
        let position = |node: u32| self.mesh.positions[node as usize].map(f64::from);
        let (a, b) = (position(a), position(b));
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
    }

    /// Sites far from each other and from those of `before`: each the farthest of a few random ones.
    pub fn spread(&self, count: usize, before: &[u32], random: &mut SplitMix) -> Vec<u32> {
        let mut sites = before.to_vec();
        for _ in 0..count {
            let best = (0..CANDIDATES)
                .map(|_| self.nodes[random.below(self.nodes.len())])
                .map(|node| {
                    let nearest = sites.iter().map(|&other| self.distance(node, other));
                    (nearest.fold(f64::INFINITY, f64::min), node)
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            sites.extend(best.map(|(_, node)| node));
        }
        sites.split_off(before.len())
    }

    /// A push at the site, of random area, depth and direction.
    pub fn at(&self, site: u32, random: &mut SplitMix) -> Push {
        let mesh = self.mesh;
        let centre = mesh.positions[site as usize].map(f64::from);
        let radii = self
            .area_mm2
            .map(|area| (area / std::f64::consts::PI).sqrt());
        let depths = DEPTH.map(|share| share * self.push_mm);
        let (radius, depth) = (random.within(radii), random.within(depths));
        let tilt = [0; 3].map(|_| 0.8 * (random.unit() - 0.5));
        let mut normal = [0.0; 3];
        for &face in &mesh.domain {
            let corners = mesh.surface[face as usize];
            if corners.contains(&site) {
                let outward = tissue::mesh::face_normal(&mesh.positions, corners);
                (0..3).for_each(|k| normal[k] += outward[k]);
            }
        }
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
        let size = length(normal);
        let direction: [f64; 3] = std::array::from_fn(|k| tilt[k] - normal[k] / size);
        let size = length(direction);
        let vector = direction.map(|x| (depth * x / size) as f32);
        let near = |&&node: &&u32| {
            let p = mesh.positions[node as usize];
            let squared: f64 = (0..3).map(|k| (f64::from(p[k]) - centre[k]).powi(2)).sum();
            !self.held[node as usize] && (squared <= radius * radius || node == site)
        };
        let nodes: Vec<u32> = self.nodes.iter().filter(near).copied().collect();
        Push {
            vectors: nodes.iter().flat_map(|_| vector).collect(),
            nodes,
        }
    }
}
