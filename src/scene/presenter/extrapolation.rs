//! How far a step's velocities are followed between steps.
//!
//! Tissue around a tool goes no farther than the tool: where that slows down, stops or turns back between two steps, the time is shortened by
//! how far it has come of what its speed at the end of the step would have made. Farther off the tissue does not know of it yet. Tissue that nothing
//! drives is slowed by the damping.

use ::contact::{Pose, Vector};

use crate::contact::vector;
use crate::contact::{ContactProblem, MAX_TOOLS, PUT_MM, Tool};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the present state of a scene";
/// What the time is stretched by. A tool that goes faster than it did pushes by itself; following it (up to 1.5) or taking tissue back (down
/// to -1) was no better.
const STRETCH: [f32; 2] = [0.0, 1.0];
/// Paths shorter than this do not stretch it, mm: their ratio would be one of rounding.
const SMALL_MM: f32 = 0.05;
/// A tool drives the tissue around it, to half at this distance, mm.
const NEAR_MM: f32 = 24.0;

/// The tools' ways to the last step.
#[derive(Default, HeldBytes)]
pub(super) struct ToolPaths {
    /// Poses at the step before the last and at the one before it, and how far apart they are, s.
    before: [Vec<Pose>; 2],
    before_s: [f64; 2],
}

impl ToolPaths {
    /// Becomes the ways to a step `seconds` after that of `problem`, to which `known` led.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn follow(
        &mut self,
        known: &ToolPaths,
        problem: &ContactProblem,
        seconds: f64,
    ) -> Result<()> {
        let tools = &problem.past.tools;
        let [last, before] = &mut self.before;
        memory::replace(before, &known.before[0], WHAT)?;
        last.clear();
        memory::fit(last, tools.len(), WHAT)?;
        last.extend(tools.iter().map(|held| held.pose));
        self.before_s = [seconds, known.before_s[0]];
        Ok(())
    }

    /// Nothing is known of the tools' paths.
    pub(super) fn forget(&mut self) {
        self.before.iter_mut().for_each(Vec::clear);
    }
}

/// The tools' ways of the last step, and the tissue that each drives.
#[derive(Default, HeldBytes)]
pub(super) struct VelocityExtrapolation {
    pub(super) paths: ToolPaths,
    /// Where tools push, and how far velocities are followed there, s.
    driven: Vec<(Vector, f32)>,
    /// Where none does.
    free: f32,
}

impl VelocityExtrapolation {
    pub(super) fn new() -> Result<VelocityExtrapolation> {
        Ok(VelocityExtrapolation {
            driven: memory::room(MAX_TOOLS, WHAT)?,
            ..VelocityExtrapolation::default()
        })
    }

    /// Looks at the tools `tau` after the last state `u`.
    pub(super) fn look(
        &mut self,
        problem: &ContactProblem,
        tools: &[Tool],
        (rest, u): (&[f32], &[f32]),
        (tau, alpha): (f64, f64),
    ) {
        self.driven.clear();
        self.free = match problem.past.has_forces() {
            true => tau as f32,
            false => slowed(tau, alpha),
        };
        for (index, held) in problem.past.tools.iter().enumerate() {
            let own = problem.past.forces.iter();
            let own = own.filter(|force| force.tool as usize == index);
            let (mut centre, mut sum) = (Vector::ZERO, 0.0);
            for force in own {
                let sample = problem.surface.samples.at(force.sample);
                let point = sample.gather(|node| vector(rest, node) + vector(u, node));
                let size = force.force.length();
                centre += point * size;
                sum += size;
            }
            if sum <= 0.0 {
                continue;
            }
            centre /= sum;
            let place = held.pose.inverse_transform_point(centre);
            let stretch = match (tools.get(index), self.speed(index, place, centre)) {
                (Some(tool), Some(speed)) => {
                    let gone = tool.pose.transform_point(place) - centre;
                    stretch(speed * tau as f32, gone)
                }
                _ => 1.0,
            };
            self.driven.push((centre, stretch * tau as f32));
        }
    }

    /// The speed of a tool at a place of its own, which is at `now`, at the end of the last step, mm/s: by BDF2, as the tissue's.
    fn speed(&self, index: usize, place: Vector, now: Vector) -> Option<Vector> {
        let at = |poses: &[Pose]| poses.get(index).map(|pose| pose.transform_point(place));
        let ToolPaths { before, before_s } = &self.paths;
        let [seconds, earlier_s] = *before_s;
        let last = at(&before[0]).filter(|_| seconds > 0.0)?;
        let far = |a: Vector, b: Vector| a.distance(b) > PUT_MM;
        if far(now, last) {
            return None;
        }
        let even = (seconds - earlier_s).abs() < 1e-6;
        let speed = match at(&before[1]).filter(|earlier| even && !far(last, *earlier)) {
            Some(earlier) => (now * 3.0 - last * 4.0 + earlier) * 0.5,
            None => now - last,
        };
        Some(speed / seconds as f32)
    }

    /// The same time everywhere: stretched where nodes are driven, that of free tissue where none is.
    pub(super) fn follow_evenly(&mut self, stretch: Option<f32>, (tau, alpha): (f64, f64)) {
        self.driven.clear();
        self.free = match stretch {
            Some(stretch) => stretch * tau as f32,
            None => slowed(tau, alpha),
        };
    }

    /// How far velocities are followed where tools push, and where none does, s.
    pub(super) fn times(&self) -> (&[(Vector, f32)], f32) {
        (&self.driven, self.free)
    }

    /// `out = last + along velocity` at some nodes, and what is made of that.
    pub(super) fn follow(
        &self,
        nodes: &[u32],
        (rest, last, velocity): (&[f32], &[f32], &[f32]),
        moved: impl Fn(u32, [f32; 3]) -> [f32; 3],
        out: &mut [f32],
    ) {
        let at = self.each();
        let [rest, last, velocity] = [rest, last, velocity].map(|field| field.as_chunks::<3>().0);
        let out = out.as_chunks_mut::<3>().0;
        for &own in nodes {
            let node = own as usize;
            out[node] = moved(own, at(&rest[node], &last[node], &velocity[node]));
        }
    }

    /// Where a node at a rest position, a displacement and a velocity goes.
    fn each(&self) -> impl Fn(&[f32; 3], &[f32; 3], &[f32; 3]) -> [f32; 3] {
        let even = self
            .driven
            .iter()
            .all(|(_, extrapolation)| *extrapolation == self.free);
        let driven: &[_] = if even { &[] } else { &self.driven };
        let near = NEAR_MM.powi(-2);
        move |rest, last, velocity| {
            let mut extrapolation = self.free;
            if !driven.is_empty() {
                let place = Vector::from(*rest) + Vector::from(*last);
                for (centre, own) in driven {
                    let weight = 1.0 / (1.0 + near * place.distance_squared(*centre));
                    extrapolation += weight * (own - self.free);
                }
            }
            std::array::from_fn(|k| last[k] + extrapolation * velocity[k])
        }
    }
}

/// The time that free tissue goes on for, s: the damping slows it.
fn slowed(tau: f64, alpha: f64) -> f32 {
    match alpha > 0.0 {
        true => (-libm::expm1(-alpha * tau) / alpha) as f32,
        false => tau as f32,
    }
}

/// How far a tool has `gone` from where its speed would have taken it.
fn stretch(wanted: Vector, gone: Vector) -> f32 {
    if gone.length() > PUT_MM {
        return 1.0;
    }
    let small = SMALL_MM * SMALL_MM;
    let [least, most] = STRETCH;
    ((gone.dot(wanted) + small) / (wanted.length_squared() + small)).clamp(least, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_that_stops_stops_the_tissue() {
        let wanted = Vector::new(0.0, 0.0, -1.25);
        let near = |a: f32, b: f32| (a - b).abs() < 0.01;
        assert!(near(stretch(wanted, wanted), 1.0));
        assert!(near(stretch(wanted, Vector::ZERO), 0.0));
        assert!(near(stretch(wanted, -wanted), 0.0));
        assert!(near(stretch(wanted, wanted * 5.0), 1.0));
        // A tool that rests leaves the tissue to itself, and so does one that was put elsewhere.
        assert!(near(stretch(Vector::ZERO, Vector::ZERO), 1.0));
        assert!(near(stretch(wanted, wanted * 100.0), 1.0));
    }

    #[test]
    fn a_tool_that_slows_down_has_the_speed_of_its_end() {
        let at = |z: f32| vec![Pose::from_translation(Vector::new(0.0, 0.0, z))];
        // 4 mm, then 2 mm: at the end 1 mm a step.
        let mut extrapolation = VelocityExtrapolation {
            paths: ToolPaths {
                before: [at(4.0), at(0.0)],
                before_s: [0.05; 2],
            },
            ..VelocityExtrapolation::default()
        };
        let now = Vector::new(0.0, 0.0, 6.0);
        let speed = extrapolation.speed(0, Vector::ZERO, now).unwrap();
        assert!((speed.z - 20.0).abs() < 1e-3, "{speed}");
        extrapolation.paths.before_s[1] = 0.1;
        assert!((extrapolation.speed(0, Vector::ZERO, now).unwrap().z - 40.0).abs() < 1e-3);
        assert!(extrapolation.speed(1, Vector::ZERO, now).is_none());
    }

    #[test]
    fn each_tool_drives_the_tissue_around_it() {
        let extrapolation = VelocityExtrapolation {
            driven: vec![(Vector::ZERO, 0.0), (Vector::new(100.0, 0.0, 0.0), 1.0)],
            free: 1.0,
            ..VelocityExtrapolation::default()
        };
        let rest = [0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 50.0, 0.0, 0.0];
        let mut out = [0.0; 9];
        let fields = (&rest[..], &[0.0; 9][..], &[1.0; 9][..]);
        extrapolation.follow(&[0, 1, 2], fields, |_, u| u, &mut out);
        assert!(
            out[0] < 1e-3 && out[3] > 0.9 && out[6] > 0.7 && out[6] < 0.9,
            "{out:?}"
        );
    }
}
