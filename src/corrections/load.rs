//! Loads beside contact on the right-hand side of a step: `F(u) = f_int(u) + M (a + alpha v) - p`.
//!
//! `p` is gravity and forces on nodes, and pressure on faces, `-p A n / 3` at each corner. It changes on a line over the scene's step. The
//! area vectors `A n` of a step are those of `u_n + h v_n`, where the body is on its way to, so that `p` is one vector of the step and the
//! iterations keep a symmetric tangent. With `p` in the drift (and off the inertia that a step leaves behind) all stages see it: the guess
//! by the natural modes, the residual near and far, and the oscillators of a free step.

/// What acts over a step, or a part of one.
#[derive(Clone, Copy)]
pub struct Load<'a> {
    /// Forces that do not follow the body `[K,3]`, µN, at the start and the end of the scene's step.
    pub dead: [&'a [f32]; 2],
    /// Gravity among them at the start and the end, mm/s².
    pub gravity: [[f32; 3]; 2],
    /// Triangles under pressure, and the pressure there at the start and the end, Pa.
    pub faces: &'a [[u32; 3]],
    pub pascal: [&'a [f32]; 2],
    /// The parts of the scene's step at which this one starts and ends.
    pub way: [f32; 2],
}

impl Load<'_> {
    /// That of a substep, the `part`-th of `count`.
    pub(super) fn of_part(self, part: u32, count: u32) -> Self {
        let at = |part: u32| part as f32 / count as f32;
        Load {
            way: [at(part - 1), at(part)],
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
        for (face, nodes) in self.faces.iter().enumerate() {
            let corner = |k: usize| {
                let at = 3 * nodes[k] as usize;
                [0, 1, 2].map(|axis| rest[at + axis] + u(at + axis))
            };
            let [a, b, c] = [corner(0), corner(1), corner(2)];
            let [p, q] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
            let twice = [
                p[1] * q[2] - p[2] * q[1],
                p[2] * q[0] - p[0] * q[2],
                p[0] * q[1] - p[1] * q[0],
            ];
            let share = between(self.pascal[0][face], self.pascal[1][face]) / 6.0;
            for node in nodes {
                let out = &mut out[3 * *node as usize..][..3];
                for (out, twice) in out.iter_mut().zip(twice) {
                    *out -= share * twice;
                }
            }
        }
    }
}
