//! A support that moves: the mesh's frame moves with what holds the organ, and the body feels that as inertia.
//!
//! With the support's pose `A = [R c]` (mesh to world) at three ends of steps, BDF2 gives the frame's velocity and acceleration as the same kind
//! of matrix, `V` and `W`. At a node `X`, in the frame, the body then bears `-m R^T (W X + 2 V v)`: translation, Euler's, centrifugal and
//! Coriolis' forces together. Displacements, tools and forces stay in the frame, in which a large motion of the support is none of the body.
//!
//! REQ-071: A support that moves as one rigid body carries the tissue without strain.

use ::contact::{Pose, pose};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::memory::HeldBytes;

/// A support that goes farther in a step is put there, without inertia, mm and rad.
/// In a step of 50 ms that would be 0.8 m/s: a host has set another scene up, and no organ is
/// carried like this.
const PUT_MM: f32 = 40.0;
const PUT_RAD: f32 = 0.5;

/// A point `x` of the mesh's frame is at `R x + position` in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportPose {
    /// mm.
    pub position: [f32; 3],
    /// `R` as a unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
}

impl SupportPose {
    /// The pose, its quaternion of unit length.
    ///
    /// # Errors
    /// [`Error::NonFinite`], [`Error::Argument`].
    pub(super) fn checked(&self) -> Result<Pose> {
        pose::checked(self.position, self.rotation).map_err(|error| match error {
            pose::PoseError::NotFinite => Error::NonFinite(format!("support: {error}")),
            pose::PoseError::NotUnit { .. } => Error::Argument(format!("support: {error}")),
        })
    }
}

/// `[R c]` by rows, mm; and its rates.
pub(super) type Affine = [[f64; 4]; 3];

pub(super) fn affine(pose: &Pose) -> Affine {
    // In f64: accelerations are second differences of it.
    let raw = pose.rotation.to_array().map(f64::from);
    let size = raw.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z, w] = raw.map(|part| part / size);
    let [a, b, c] = pose.translation.to_array().map(f64::from);
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
            a,
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
            b,
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
            c,
        ],
    ]
}

/// A linear combination of three matrices: BDF2's differences of poses.
fn combined(parts: [(f64, &Affine); 3]) -> Affine {
    [0, 1, 2].map(|row| {
        [0, 1, 2, 3].map(|column| parts.iter().map(|(part, a)| part * a[row][column]).sum())
    })
}

/// Where the support is at the last end of a step, where it was at the one before, and how fast at both; poses as position and quaternion.
#[derive(Clone, Copy, Debug, PartialEq, HeldBytes, Serialize, Deserialize)]
pub(super) struct Carried {
    /// Position, mm, and unit quaternion x, y, z, w, as the host gave them: what the next step's
    /// way is measured from.
    pose: [f32; 7],
    /// The pose as a matrix at the last end of a step, and at the one before it.
    places: [Affine; 2],
    /// `V` at the same two ends, mm/s and 1/s.
    speeds: [Affine; 2],
}

/// What a step has of a support: the frame's rotation, velocity and acceleration at its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carriage {
    /// `[R c]` at the end of the step, whose `R`, transposed, turns the world's directions into the
    /// frame.
    rotation: Affine,
    /// `V`.
    velocity: Affine,
    /// `W`.
    acceleration: Affine,
}

impl Carried {
    /// At rest in a pose.
    fn put(pose: &Pose) -> Carried {
        let [x, y, z] = pose.translation.to_array();
        let [i, j, k, w] = pose.rotation.to_array();
        Carried {
            pose: [x, y, z, i, j, k, w],
            places: [affine(pose); 2],
            speeds: [[[0.0; 4]; 3]; 2],
        }
    }

    /// Whether the way there is none that a support goes in a step.
    fn leaps_to(&self, to: &Pose) -> bool {
        let [x, y, z, i, j, k, w] = self.pose;
        let Ok(from) = pose::checked([x, y, z], [i, j, k, w]) else {
            return true;
        };
        let way = (to.translation - from.translation).length();
        way > PUT_MM || pose::angle(&from.rotation, &to.rotation) > PUT_RAD
    }

    /// After a step of `step_s` that ends in `pose`, and what the body bears in it; `last` is that of the last state.
    pub(super) fn follow(last: Option<&Carried>, pose: &Pose, step_s: f64) -> (Carried, Carriage) {
        let mut next = Carried::put(pose);
        let mut acceleration = [[0.0; 4]; 3];
        if let Some(last) = last.filter(|last| !last.leaps_to(pose)) {
            // BDF2: `x' = (3 x_n - 4 x_(n-1) + x_(n-2)) / 2h`, and the acceleration by the same
            // formula from velocities. It is the formula of the solver's own time step.
            let part = 0.5 / step_s;
            let derived = |now: &Affine, [last, before]: &[Affine; 2]| {
                combined([(3.0 * part, now), (-4.0 * part, last), (part, before)])
            };
            let velocity = derived(&next.places[0], &last.places);
            acceleration = derived(&velocity, &last.speeds);
            next.places[1] = last.places[0];
            next.speeds = [velocity, last.speeds[0]];
        }
        let carriage = Carriage {
            rotation: next.places[0],
            velocity: next.speeds[0],
            acceleration,
        };
        (next, carriage)
    }

    /// Checks what was read.
    pub(super) fn is_sound(&self) -> bool {
        let numbers = [self.places, self.speeds];
        let finite = numbers.as_flattened().as_flattened().as_flattened();
        let [x, y, z, i, j, k, w] = self.pose;
        finite.iter().all(|v| v.is_finite()) && pose::checked([x, y, z], [i, j, k, w]).is_ok()
    }
}

/// What the body bears of a support that moves: its columns by the coordinates of the frame, per mass, 1/s² and 1/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Borne {
    /// mm/s².
    at_origin: [f32; 3],
    /// Column `k`: what a place 1 mm along axis `k` adds.
    of_place: [[f32; 3]; 3],
    /// Column `k`: what a speed of 1 mm/s along axis `k` adds, Coriolis' part.
    of_velocity: [[f32; 3]; 3],
}

impl Borne {
    /// At `x` of the frame (mm) where the body moves at `v` (mm/s), per mass, mm/s².
    #[inline]
    pub(super) fn at(&self, x: [f32; 3], v: [f32; 3]) -> [f32; 3] {
        let mut sum = self.at_origin;
        for k in 0..3 {
            let (place, velocity) = (&self.of_place[k], &self.of_velocity[k]);
            for axis in 0..3 {
                sum[axis] += place[axis] * x[k] + velocity[axis] * v[k];
            }
        }
        sum
    }
}

impl Carriage {
    /// `R^T v`.
    fn back(&self, v: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| (0..3).map(|row| self.rotation[row][axis] * v[row]).sum())
    }

    /// A direction of the world in the frame.
    pub(super) fn in_frame(&self, v: [f32; 3]) -> [f32; 3] {
        self.back(v.map(f64::from)).map(|v| v as f32)
    }

    /// What the body bears, as a function of place and velocity.
    pub(super) fn borne(&self) -> Borne {
        let column = |of: &Affine, k: usize, factor: f64| {
            let own = [0, 1, 2].map(|row| of[row][k]);
            self.back(own).map(|a| (-factor * a) as f32)
        };
        Borne {
            at_origin: column(&self.acceleration, 3, 1.0),
            of_place: [0, 1, 2].map(|k| column(&self.acceleration, k, 1.0)),
            of_velocity: [0, 1, 2].map(|k| column(&self.velocity, k, 2.0)),
        }
    }

    /// Whether the body bears anything of it.
    pub(super) fn acts(&self) -> bool {
        let numbers = [self.velocity, self.acceleration];
        numbers
            .as_flattened()
            .as_flattened()
            .iter()
            .any(|v| *v != 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame that turns evenly about an axis through its origin: what rests in it is pulled outwards by `w² r`, what moves in it by `2 w v` aside.
    #[test]
    fn an_even_turn_pulls_outwards_and_aside() {
        let (omega, h) = (2.0f32, 0.01);
        let at = |step: i32| {
            let angle = 0.5 * omega * h * step as f32;
            pose::checked([0.0; 3], [0.0, 0.0, angle.sin(), angle.cos()]).unwrap()
        };
        let (mut last, _) = Carried::follow(None, &at(0), f64::from(h));
        let mut carriage = None;
        for step in 1..60 {
            let (next, own) = Carried::follow(Some(&last), &at(step), f64::from(h));
            (last, carriage) = (next, Some(own));
        }
        let carriage = carriage.unwrap();
        let [x, y, z] = carriage.borne().at([50.0, 0.0, 7.0], [0.0; 3]);
        assert!(
            (x - 200.0).abs() < 1.0 && y.abs() < 1.0 && z == 0.0,
            "{x} {y} {z}"
        );
        let [x, y, _] = carriage.borne().at([0.0; 3], [30.0, 0.0, 0.0]);
        assert!(x.abs() < 0.5 && (y + 120.0).abs() < 0.5, "{x} {y}");
        let gravity = carriage.in_frame([0.0, 0.0, -9.81]);
        assert!((gravity[2] + 9.81).abs() < 1e-5);
    }

    #[test]
    fn a_leap_leaves_no_inertia() {
        let at = |x: f32| pose::checked([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let (last, _) = Carried::follow(None, &at(0.0), 0.05);
        let (last, slow) = Carried::follow(Some(&last), &at(30.0), 0.05);
        assert!(slow.acts());
        let (last, leapt) = Carried::follow(Some(&last), &at(90.0), 0.05);
        assert!(!leapt.acts());
        let (_, still) = Carried::follow(Some(&last), &at(90.0), 0.05);
        assert!(!still.acts());
    }
}
