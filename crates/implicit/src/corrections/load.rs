//! Loads beside contact on the right-hand side of a step: `F(u) = f_int(u) + M (a + alpha v) - p`.
//!
//! `p` is gravity and forces on nodes, and pressure on faces, `-p A n / 3` at each corner. It changes on a line over the scene's step. The
//! area vectors `A n` of a step are those of `u_n + h v_n`, where the body is on its way to, so that `p` is one vector of the step and the
//! iterations keep a symmetric tangent. With `p` in the drift (and off the inertia that a step leaves behind) all stages see it: the guess
//! by the natural modes, the residual near and far, and the oscillators of a free step.

use crate::memory::HeldBytes;

/// A point that lies at weights on nodes; what is not needed weighs nothing.
#[derive(Clone, Copy, Debug, HeldBytes)]
pub struct LoadPoint {
    /// Nodes of the mesh, and their weights, which sum to one.
    pub nodes: [u32; 4],
    pub weights: [f32; 4],
}

impl LoadPoint {
    /// Where each node's three numbers begin in a field, and its weight.
    fn parts(&self) -> impl Iterator<Item = (usize, f32)> {
        let parts = self.nodes.into_iter().zip(self.weights);
        parts
            .filter(|(_, weight)| *weight > 0.0)
            .map(|(node, weight)| (3 * node as usize, weight))
    }
}

/// What acts over a step, or a part of one.
#[derive(Clone, Copy)]
pub struct Load<'a> {
    /// Forces that do not follow the body `[K,3]`, µN, at the start and the end of the scene's step.
    pub dead: [&'a [f32]; 2],
    /// Gravity among them at the start and the end, mm/s².
    pub gravity: [[f32; 3]; 2],
    /// Triangles under pressure, and the pressure there at the start and the end, Pa. Their corners are nodes, and numbers from `K` on name `points`.
    pub faces: &'a [[u32; 3]],
    pub points: &'a [LoadPoint],
    pub pascal: [&'a [f32]; 2],
    /// The parts of the scene's step at which this one starts and ends.
    pub way: [f32; 2],
}

/// The parts of a scene's step at which the `part`-th of `count` substeps starts and ends.
pub(super) fn part_of(part: u32, count: u32) -> [f32; 2] {
    [part - 1, part].map(|part| part as f32 / count as f32)
}

impl Load<'_> {
    /// That of a substep, the `part`-th of `count`.
    pub(super) fn of_part(self, part: u32, count: u32) -> Self {
        Load {
            way: part_of(part, count),
            ..self
        }
    }

    /// By how much gravity changes over it, mm/s²; none where it does not.
    pub(super) fn turned_by(&self) -> Option<[f32; 3]> {
        let part = self.way[1] - self.way[0];
        let [from, to] = self.gravity;
        let change = [0, 1, 2].map(|axis| part * (to[axis] - from[axis]));
        (change != [0.0; 3]).then_some(change)
    }

    /// The forces at one of its two ends, 0 or 1, into `out [K,3]`, with the body at `rest + u(0..3K)`.
    pub(super) fn evaluate(
        &self,
        end: usize,
        rest: &[f32],
        u: impl Fn(usize) -> f32,
        out: &mut [f32],
    ) {
        let way = self.way[end];
        let between = |from: f32, to: f32| from + way * (to - from);
        let [from, to] = self.dead;
        for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
            *out = between(*from, *to);
        }
        let count = rest.len() / 3;
        // Where a node is, mm; `at` is where its three numbers begin.
        let place = |at: usize| [0, 1, 2].map(|axis| rest[at + axis] + u(at + axis));
        for (face, nodes) in self.faces.iter().enumerate() {
            // A corner is a node, or a point between nodes where a cut has parted a face.
            let corner = |k: usize| match (nodes[k] as usize).checked_sub(count) {
                None => place(3 * nodes[k] as usize),
                Some(point) => {
                    let mut sum = [0.0; 3];
                    for (node, weight) in self.points[point].parts() {
                        let own = place(node);
                        sum = [0, 1, 2].map(|axis| sum[axis] + weight * own[axis]);
                    }
                    sum
                }
            };
            let [a, b, c] = [corner(0), corner(1), corner(2)];
            let [p, q] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
            // `(b - a) x (c - a)`, twice the area times the outward normal, mm².
            let twice = [
                p[1] * q[2] - p[2] * q[1],
                p[2] * q[0] - p[0] * q[2],
                p[0] * q[1] - p[1] * q[0],
            ];
            // Half of that is the area vector, and each corner bears a third of its force: Pa mm² is µN.
            let share = between(self.pascal[0][face], self.pascal[1][face]) / 6.0;
            let mut add = |at: usize, weight: f32| {
                for (out, twice) in out[at..at + 3].iter_mut().zip(twice) {
                    *out -= weight * (share * twice);
                }
            };
            for node in nodes {
                match (*node as usize).checked_sub(count) {
                    None => add(3 * *node as usize, 1.0),
                    Some(point) => (self.points[point].parts()).for_each(|(at, w)| add(at, w)),
                }
            }
        }
    }
}
