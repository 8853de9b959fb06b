//! A point of the surface: a fixed combination of nodes.
//!
//! Contact is looked at and solved at such points, which lie between nodes, too, where a mesh is
//! coarse. A force on a sample is shared among its nodes by the weights, which is the transpose of
//! how its place follows from theirs.

use parry3d::math::Vector;

/// A point of the surface: nodes and weights that sum to 1. Unused places repeat the first node with weight 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Three of a face; four where a cut has put a corner inside of an element.
    pub nodes: [u32; 4],
    /// In the order of the nodes.
    pub weights: [f32; 4],
}

impl Sample {
    /// A point of a face.
    pub fn on_face([a, b, c]: [u32; 3], [u, v, w]: [f32; 3]) -> Sample {
        Sample {
            nodes: [a, b, c, a],
            weights: [u, v, w, 0.0],
        }
    }

    /// The sample's value of a nodal field: positions, displacements, velocities.
    #[inline]
    pub fn gather(&self, field: impl Fn(u32) -> Vector) -> Vector {
        let [a, b, c, d] = self.nodes;
        let [u, v, w, x] = self.weights;
        let on_face = field(a) * u + field(b) * v + field(c) * w;
        match x == 0.0 {
            true => on_face,
            false => on_face + field(d) * x,
        }
    }

    /// Nodes with a weight that is not zero, with it.
    pub fn entries(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let entries = self.nodes.iter().copied().zip(self.weights);
        entries.filter(|(_, weight)| *weight != 0.0)
    }

    /// The mean of points of one element: four nodes in all.
    /// Equal nodes are added up. The first of them fills what is left of the places, as in
    /// [`Sample::on_face`].
    fn mean(parts: [Sample; 3], weights: [f32; 3]) -> Sample {
        let mut mean = Sample {
            nodes: [parts[0].nodes[0]; 4],
            weights: [0.0; 4],
        };
        let mut count = 0;
        for (part, weight) in parts.iter().zip(weights) {
            for (node, own) in part.entries().filter(|_| weight != 0.0) {
                let known = mean.nodes[..count].iter().position(|known| *known == node);
                debug_assert!(known.is_some() || count < 4, "points of one element");
                let at = known.unwrap_or(count.min(3));
                mean.nodes[at] = node;
                mean.weights[at] += weight * own;
                count = count.max(at + 1);
            }
        }
        let first = mean.nodes[0];
        mean.nodes[count..].fill(first);
        mean
    }
}

/// The point of a triangle of places at weights on its corners.
pub(crate) fn between(
    (nodes, points): (&[u32], &[Sample]),
    places: [u32; 3],
    weights: [f32; 3],
) -> Sample {
    let count = nodes.len();
    if places.iter().all(|place| (*place as usize) < count) {
        return Sample::on_face(places.map(|place| nodes[place as usize]), weights);
    }
    let corner = |place: u32| match nodes.get(place as usize) {
        Some(node) => Sample::on_face([*node; 3], [1.0, 0.0, 0.0]),
        None => points[place as usize - count],
    };
    Sample::mean(places.map(corner), weights)
}
