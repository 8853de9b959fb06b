//! A support that moves: the held nodes go with it as one rigid body, and what damps the tissue moves with it.
//!
//! Within a frame position and rotation vector follow the cubic through their values and rates at its two ends. Damping takes `-alpha M (v - w)`
//! with the velocity `w` that the support has at the node, so a body that is carried at a constant speed feels nothing.

use super::fields::Node;
use contact::Vector;
use elements::vector::cross;

/// Where a support is at the end of a frame: a point `x` of the mesh's frame is at `R x + position`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SupportMotion {
    /// mm and mm/s.
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    /// Rotation vector (axis times angle, rad) of `R`, and its rate, 1/s.
    pub turn: [f64; 3],
    pub turning: [f64; 3],
}

/// The moving support of a solver, from the first time that it has one.
#[derive(Clone, Debug, Default)]
pub(super) struct Support {
    from: SupportMotion,
    to: SupportMotion,
    duration_s: f64,
    damping_per_s: f64,
    /// Slot and place at rest of the held nodes; of the others, with their mass, g.
    held: Vec<(u32, [f64; 3])>,
    free: Vec<(u32, [f64; 3], f64)>,
}

/// `R x` for the rotation vector `turn` (Rodrigues).
fn turned(turn: [f64; 3], x: [f64; 3]) -> [f64; 3] {
    let angle = turn.iter().map(|v| v * v).sum::<f64>().sqrt();
    if angle < 1e-12 {
        let once = cross(turn, x);
        return std::array::from_fn(|k| x[k] + once[k]);
    }
    let axis = turn.map(|v| v / angle);
    let (sine, cosine) = angle.sin_cos();
    let along: f64 = axis.iter().zip(x).map(|(a, x)| a * x).sum();
    let once = cross(axis, x);
    std::array::from_fn(|k| cosine * x[k] + sine * once[k] + (1.0 - cosine) * along * axis[k])
}

impl Support {
    /// At rest where it was meshed, with nodes by slot, place at rest, mass (g) and whether they are held.
    pub fn new(
        damping_per_s: f64,
        nodes: impl Iterator<Item = (u32, [f64; 3], f64, bool)>,
    ) -> Self {
        let mut support = Support {
            damping_per_s,
            ..Support::default()
        };
        for (slot, rest, mass, is_held) in nodes {
            match is_held {
                true => support.held.push((slot, rest)),
                false => support.free.push((slot, rest, mass)),
            }
        }
        support
    }

    /// The next frame, of `duration_s`, ends there.
    pub fn lead(&mut self, to: SupportMotion, duration_s: f64) {
        self.to = to;
        self.duration_s = duration_s;
    }

    /// Position and rotation vector at part `s` of the frame.
    fn at(&self, s: f64) -> [[f64; 3]; 2] {
        let (s2, s3) = (s * s, s * s * s);
        let weights = [
            2.0 * s3 - 3.0 * s2 + 1.0,
            3.0 * s2 - 2.0 * s3,
            self.duration_s * (s3 - 2.0 * s2 + s),
            self.duration_s * (s3 - s2),
        ];
        let (from, to) = (&self.from, &self.to);
        let between = |known: [[f64; 3]; 4]| {
            std::array::from_fn(|k| (0..4).map(|i| weights[i] * known[i][k]).sum())
        };
        [
            between([from.position, to.position, from.velocity, to.velocity]),
            between([from.turn, to.turn, from.turning, to.turning]),
        ]
    }

    /// Where a place of its frame is at part `s` of the solver's frame.
    pub fn carried(&self, place: Vector, s: f32) -> Vector {
        let [position, turn] = self.at(f64::from(s));
        let there = turned(turn, place.to_array().map(f64::from));
        Vector::from_array([0, 1, 2].map(|k| (there[k] + position[k]) as f32))
    }

    /// Puts the held nodes where they are at inner step `step` of `steps`, and adds to `now` what the support's motion takes off the damping.
    ///
    /// # Safety
    /// `displacement` holds every slot, and nobody else looks there.
    pub unsafe fn move_to(
        &self,
        displacement: *mut Node,
        (step, steps): (u32, u32),
        now: &mut [Node],
    ) {
        let part = f64::from(step) / f64::from(steps);
        let [position, turn] = self.at(part);
        for &(slot, rest) in &self.held {
            let moved = turned(turn, rest);
            // SAFETY: the caller's.
            let node = unsafe { &mut (*displacement.add(slot as usize)).0 };
            for k in 0..3 {
                node[k] = (moved[k] + position[k] - rest[k]) as f32;
            }
        }
        let half = 0.5 / f64::from(steps);
        let [before, after] = [part - half, part + half].map(|s| self.at(s));
        let rate = self.damping_per_s / (2.0 * half * self.duration_s);
        let back = turn.map(|v| -v);
        for &(slot, rest, mass) in &self.free {
            // SAFETY: the caller's.
            let u = unsafe { (*displacement.add(slot as usize)).0 };
            let from: [f64; 3] = std::array::from_fn(|k| rest[k] + f64::from(u[k]) - position[k]);
            let own = turned(back, from);
            let [was, will] = [before, after].map(|[position, turn]| {
                let there = turned(turn, own);
                [0, 1, 2].map(|k| there[k] + position[k])
            });
            for k in 0..3 {
                now[slot as usize].0[k] += (mass * rate * (will[k] - was[k])) as f32;
            }
        }
    }

    /// The end of the frame becomes the start of the next, in which it rests unless it is told to go on.
    pub fn arrive(&mut self) {
        self.from = self.to;
    }
}
