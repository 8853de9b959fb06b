//! Ties: springs between a point of the tissue and a place in the world, on what holds the body, on a tool, or on the tissue itself (a suture).
//!
//! A tie of length `l` pulls both of its ends together with the tension
//!
//! ```text
//! T = k (l - s) + c dl/dt        k stiffness, s slack length, c damping
//! ```
//!
//! while it is taut (`l > s`), and where it pushes too, always; without pushing `T >= 0`. Over an implicit step the rate is the change of length since its
//! start, or since it became taut, over the step's time, so that the tension never falls where the length grows ([`Pull`]). mm, mN, s; mN/mm is N/m.

use crate::sample::Sample;
use parry3d::math::{Matrix, Vector};

/// The largest stiffness (N/m), and the largest damping (N s/m): beyond, the length of a tie is known less well than its tension.
pub const LARGEST_STIFFNESS: f32 = 1e6;
/// Steps of a solve at most: Newton's method needs a few, and thirty halvings of the bounds end at
/// the last bit of f32 in any case.
const ROUNDS: usize = 30;
/// A step that changes the tension by less than this part of it is the last.
const SETTLED: f32 = 1e-6;
/// A tie that is shorter has no direction, mm.
const SHORT_MM: f32 = 1e-6;

/// A point on a face of the tissue: nodes and weights that sum to 1. Unused places repeat the first node with weight 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiePoint {
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
}

impl TiePoint {
    /// The point's value of a nodal field.
    pub fn gather(&self, field: impl Fn(u32) -> Vector) -> Vector {
        Sample::from(*self).gather(field)
    }

    /// Nodes with a weight that is not zero, with it.
    pub fn entries(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let entries = self.nodes.iter().copied().zip(self.weights);
        entries.filter(|(_, weight)| *weight != 0.0)
    }
}

impl From<TiePoint> for Sample {
    fn from(point: TiePoint) -> Sample {
        Sample::on_face(point.nodes, point.weights)
    }
}

/// Where the far end of a tie is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// A place in the world, mm.
    World(Vector),
    /// A place in the frame of what holds the body, which is the mesh's.
    Support(Vector),
    /// A place in the frame of a tool.
    Tool { tool: u32, place: Vector },
    /// Another point of the tissue.
    Tissue(TiePoint),
}

/// How a tie pulls.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spring {
    /// mN/mm, which is N/m. 0: it does not pull.
    pub stiffness: f32,
    /// It pulls where it is longer than this, mm.
    pub slack_mm: f32,
    /// mN s/mm, which is N s/m.
    pub damping: f32,
    /// It pushes where it is shorter, as a rod does; otherwise it is a thread.
    pub pushes: bool,
}

/// A tie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// The point of the tissue.
    pub point: TiePoint,
    /// Where it is tied to beside the tissue.
    pub end: End,
    /// How it pulls.
    pub spring: Spring,
    /// It breaks under a larger tension, mN; 0: never.
    pub break_mn: f32,
}

/// The tension of a spring over one step, by its length at the end: `rate l - offset`, in the caller's unit of force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// `k + c / h`.
    rate: f32,
    /// `k s + c l_0 / h`, with the length `l_0` at the start of the step.
    offset: f32,
    /// `s`, mm.
    slack: f32,
    /// As of the spring.
    pushes: bool,
}

impl Tie {
    /// Whether all of its numbers are.
    pub fn is_finite(&self) -> bool {
        let Spring {
            stiffness,
            slack_mm,
            damping,
            pushes: _,
        } = self.spring;
        let place = match self.end {
            End::World(place) | End::Support(place) | End::Tool { place, .. } => place,
            End::Tissue(far) => Vector::from(far.weights),
        };
        let numbers = [stiffness, slack_mm, damping, self.break_mn];
        let mut numbers = numbers.into_iter().chain(self.point.weights);
        numbers.all(f32::is_finite) && place.is_finite()
    }

    /// What no tie can have, whatever its body is.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        let Spring {
            stiffness,
            slack_mm,
            damping,
            ..
        } = self.spring;
        for (field, value, most) in [
            ("stiffness", stiffness, LARGEST_STIFFNESS),
            ("slack_mm", slack_mm, f32::MAX),
            ("damping", damping, LARGEST_STIFFNESS),
            ("break_mn", self.break_mn, f32::MAX),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(format!(
                    "{field} is {value}, must be 0 or more, and at most {most}"
                ));
            }
        }
        let place = match self.end {
            End::World(place) | End::Support(place) | End::Tool { place, .. } => place,
            End::Tissue(far) => {
                check_weights("other_weights", &far)?;
                Vector::ZERO
            }
        };
        if !place.is_finite() {
            return Err(format!("the place of its far end is {place}"));
        }
        check_weights("weights", &self.point)
    }
}

fn check_weights(field: &str, sample: &TiePoint) -> Result<(), String> {
    let sum: f32 = sample.weights.iter().sum();
    match (sum - 1.0).abs() <= 1e-3 && sample.weights.iter().all(|weight| *weight >= 0.0) {
        true => Ok(()),
        false => Err(format!(
            "{field} are {:?}, must be 0 or more, with the sum 1",
            sample.weights
        )),
    }
}

impl Spring {
    /// Over a step of `step_s` in which the tie was `start` mm long at its start.
    pub fn over(&self, start: f32, step_s: f32) -> Pull {
        let drag = self.damping / step_s;
        // A thread that was slack is drawn out from where it became taut.
        let from = match self.pushes {
            true => start,
            false => start.max(self.slack_mm),
        };
        Pull {
            rate: self.stiffness + drag,
            offset: self.stiffness * self.slack_mm + drag * from,
            slack: self.slack_mm,
            pushes: self.pushes,
        }
    }
}

impl Pull {
    /// The same in a unit of force that is `factor` times smaller.
    pub fn scaled(self, factor: f32) -> Pull {
        Pull {
            rate: factor * self.rate,
            offset: factor * self.offset,
            ..self
        }
    }

    /// The tension at a length; negative where it pushes.
    pub fn tension(&self, length: f32) -> f32 {
        let tension = self.rate * length - self.offset;
        match self.pushes {
            true => tension,
            false if length <= self.slack => 0.0,
            false => tension.max(0.0),
        }
    }

    /// The force on the tissue whose point lies `way` from the tie's far end.
    pub fn force(&self, way: Vector) -> Vector {
        let length = way.length();
        match length > SHORT_MM {
            true => way * (-self.tension(length) / length),
            // All directions are the same: that of a thread without slack is the limit.
            false => Vector::ZERO,
        }
    }

    /// The force `f` with `f = force(b + g f)`: of a point that a unit of force moves by `gain` in any direction.
    pub fn solve_even(&self, gain: f32, b: Vector) -> Vector {
        let length = b.length();
        if length <= SHORT_MM {
            return Vector::ZERO;
        }
        let tension = (self.rate * length - self.offset) / (1.0 + gain * self.rate);
        match !self.pushes && (tension <= 0.0 || length <= self.slack) {
            true => Vector::ZERO,
            false => b * (-tension / length),
        }
    }

    /// The force `f` with `f = force(b + W f)`, `W` symmetric and positive.
    ///
    /// With `f = -q d` at the way `d`, `q` the tension by length: `d = (I + q W)^-1 b`, and `q` is the root of `T(|d|) - q |d|`, which falls as `q` grows:
    /// the length does, and `q |d|` rises. Newton's method, between bounds.
    pub fn solve(&self, w: &Matrix, b: Vector) -> Vector {
        let length = b.length();
        let tension = self.tension(length);
        if length <= SHORT_MM || tension == 0.0 {
            return Vector::ZERO;
        }
        if w.x_axis.x <= 0.0 {
            // Nothing moves its point.
            return self.force(b);
        }
        // Of a compliance that is the same in all directions.
        let even = (w.x_axis.x + w.y_axis.y + w.z_axis.z) / 3.0;
        let guess = -self.solve_even(even, b).dot(b) / length;
        let mut q = guess / (length - even * guess).max(SHORT_MM);
        let [mut low, mut high] = match tension > 0.0 {
            true => [0.0, self.rate],
            // Pushed harder than that a rod turns about.
            false => [-1.0 / largest(w), 0.0],
        };
        let mut force = Vector::ZERO;
        for _ in 0..ROUNDS {
            q = q.clamp(low, high);
            let inverse = (Matrix::IDENTITY + *w * q).inverse();
            let way = inverse * b;
            force = way * -q;
            let length = way.length();
            let left = self.rate * length - self.offset - q * length;
            match left > 0.0 {
                true => low = q,
                false => high = q,
            }
            let shorter = way.dot(inverse * (*w * way)) / length;
            let slope = -length - (self.rate - q) * shorter;
            let next = q - left / slope;
            if (next - q).abs() <= SETTLED * q.abs() || !next.is_finite() {
                break;
            }
            q = match next > low && next < high {
                true => next,
                false => 0.5 * (low + high),
            };
        }
        force
    }
}

/// No less than the largest eigenvalue, and at most a seventh more.
fn largest(w: &Matrix) -> f32 {
    let scale = w.x_axis.x + w.y_axis.y + w.z_axis.z;
    let mut power = *w * (1.0 / scale);
    for _ in 0..3 {
        power *= power;
    }
    let trace = power.x_axis.x + power.y_axis.y + power.z_axis.z;
    scale * trace.sqrt().sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thread(stiffness: f32, slack_mm: f32) -> Spring {
        Spring {
            stiffness,
            slack_mm,
            ..Spring::default()
        }
    }

    #[test]
    fn a_thread_pulls_beyond_its_slack_and_a_rod_pushes() {
        let pull = thread(50.0, 2.0).over(1.0, 0.05);
        assert_eq!(pull.tension(1.9), 0.0);
        assert!((pull.tension(3.0) - 50.0).abs() < 1e-4);
        let force = pull.force(Vector::new(0.0, 3.0, 4.0));
        assert!((force - Vector::new(0.0, -90.0, -120.0)).length() < 1e-3);
        let rod = Spring {
            pushes: true,
            ..thread(50.0, 2.0)
        };
        assert!((rod.over(2.0, 0.05).tension(1.0) + 50.0).abs() < 1e-4);
    }

    #[test]
    fn damping_counts_from_where_a_thread_became_taut() {
        let damped = Spring {
            damping: 3.0,
            ..thread(50.0, 2.0)
        };
        // From 1 to 4 mm in 0.1 s: taut for 2 of the 3 mm.
        let pull = damped.over(1.0, 0.1);
        assert!((pull.tension(4.0) - (100.0 + 3.0 * 20.0)).abs() < 1e-3);
        // Drawn in from 4 to 2.5 mm it is slack: damping does not push.
        assert_eq!(damped.over(4.0, 0.1).tension(2.5), 0.0);
        let lengths = (0..60).map(|at| 0.1 * at as f32);
        let tensions: Vec<f32> = lengths.map(|l| pull.tension(l)).collect();
        assert!(tensions.is_sorted(), "{tensions:?}");
    }

    /// Stiff and soft, threads and rods, with compliances that differ by direction: the force is that of the way that it leads to.
    #[test]
    fn a_solve_balances_tie_and_compliance() {
        let w = Matrix::from_cols(
            Vector::new(0.9, 0.1, -0.2),
            Vector::new(0.1, 0.3, 0.05),
            Vector::new(-0.2, 0.05, 0.6),
        );
        let mut pulled = 0;
        for at in 0..600 {
            let turn = 0.37 * at as f32;
            let b = Vector::new(
                4.0 * turn.cos(),
                3.0 * (1.3 * turn).sin(),
                2.0 * (0.7 * turn).cos(),
            );
            let stiffness = [1e-2, 1.0, 30.0, 1e4][at % 4];
            let slack_mm = [0.0, 0.5, 3.0][at % 3];
            let spring = Spring {
                damping: if at % 5 == 0 { 0.1 * stiffness } else { 0.0 },
                pushes: at % 7 == 0 && slack_mm > 0.0,
                ..thread(stiffness, slack_mm)
            };
            let pull = spring.over(b.length(), 0.05);
            let force = pull.solve(&w, b);
            let way = b + w * force;
            let wanted = pull.force(way);
            // In mm: a stiff tie's force is known to what its length is.
            let off = (force - wanted).length() / (1.0 + pull.rate);
            assert!(
                off < 2e-5 * b.length(),
                "{at}: {force} for {wanted} at {way}"
            );
            pulled += u32::from(force.length() > 1e-3);
            let even = pull.solve_even(0.7, b);
            let wanted = pull.force(b + even * 0.7);
            assert!(
                (even - wanted).length() / (1.0 + pull.rate) < 2e-5 * b.length(),
                "{at}"
            );
        }
        assert!(pulled > 300, "{pulled}");
    }
}
