//! Samples that a step pushes do not fly off their tool.
//!
//! What a tool under force pushes moves with it along the normal. BDF2 has the velocity of a state from three states, though: where a quick tool has stopped among them,
//! it says that pushed samples leave the tool at up to 50 mm/s, and a hand would lose the tissue for the whole of a step. So the natural modes get the change of velocity of
//! least kinetic energy with which none does, that of impulses `l` of the tool: `dv = M^-1 B^T l`, `B` the modes along the samples' normals.

use ::contact::{Body, Pose, Vector};

use crate::contact::PUT_MM;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the haptics of a scene";
/// Gauss-Seidel sweeps over the samples; few are pushed at once.
const SWEEPS: usize = 8;

/// Samples that a step pushes.
#[derive(Default, HeldBytes)]
pub(super) struct Leaving {
    /// Where the tool was in the last published step.
    #[held(skip)]
    before: Option<Pose>,
    samples: Vec<Pushed>,
    /// The modes along each sample's normal `[n,m]`.
    rows: Vec<f32>,
}

#[derive(Clone, Copy, HeldBytes)]
struct Pushed {
    at: usize,
    /// Away from the tool.
    normal: Vector,
    /// How fast it leaves the tool but for the modes, mm/s; at most zero.
    base: f32,
}

/// The natural modes of a snapshot.
pub(super) struct Modal<'a> {
    /// At samples `[3n,m]`.
    pub at_samples: &'a [f32],
    /// Masses `[m]`, g.
    pub masses: &'a [f32],
    /// Velocities `[m]`, mm/s.
    pub velocity: &'a mut [f32],
}

impl Leaving {
    /// Begins a state with so many samples.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn begin(&mut self, samples: usize, modes: usize) -> Result<()> {
        self.samples.clear();
        memory::fit(&mut self.samples, samples, WHAT)?;
        self.rows.clear();
        memory::fit(&mut self.rows, samples * modes, WHAT)
    }

    /// Takes a sample that the tool at `pose` pushes with `force` in a step of `step_s`; support groups carry it at `carried`, mm/s.
    pub fn take(
        &mut self,
        at: usize,
        (point, carried): (Vector, Vector),
        force: Vector,
        (body, pose): (&Body, &Pose),
        step_s: f64,
    ) {
        let Some(normal) = force.try_normalize() else {
            return;
        };
        // One that was put somewhere has no velocity.
        let came = |before: &Pose| body.motion(before, pose) <= PUT_MM;
        let before = self.before.filter(came).unwrap_or(*pose);
        let then = before.transform_point(pose.inverse_transform_point(point));
        let away = carried - (point - then) / step_s as f32;
        // A tool that draws back is followed by the tissue about it, of which the modes are a small part: they are held as by one that stands.
        self.samples.push(Pushed {
            at,
            normal,
            base: away.dot(normal).min(0.0),
        });
    }

    /// Ends a state: no pushed sample leaves the tool at `pose` any more.
    pub fn hold(&mut self, pose: Option<Pose>, modal: Modal<'_>) {
        self.before = pose;
        let modes = modal.masses.len();
        for pushed in &self.samples {
            let [x, y, z] =
                [0, 1, 2].map(|k| &modal.at_samples[(3 * pushed.at + k) * modes..][..modes]);
            let along = |m: usize| pushed.normal.dot(Vector::new(x[m], y[m], z[m]));
            self.rows.extend((0..modes).map(along));
        }
        for _ in 0..SWEEPS {
            let mut is_held = true;
            for (index, pushed) in self.samples.iter().enumerate() {
                let row = &self.rows[index * modes..][..modes];
                let moved = row.iter().zip(&*modal.velocity).map(|(b, v)| b * v);
                let leaves = pushed.base + moved.sum::<f32>();
                let eased = row.iter().zip(modal.masses).map(|(b, mass)| b * b / mass);
                let eased: f32 = eased.sum();
                if leaves <= 0.0 || eased <= 0.0 {
                    continue;
                }
                is_held = false;
                let impulse = leaves / eased;
                for ((v, b), mass) in modal.velocity.iter_mut().zip(row).zip(modal.masses) {
                    *v -= impulse * b / mass;
                }
            }
            if is_held {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::contact::Shape;

    /// A ball that stood still pushes two samples down; the first leaves it at 40 mm/s by the modes, the second comes towards it.
    #[test]
    fn what_is_pushed_stays_on_its_tool_by_the_least_change() {
        let body = Body::new(&Shape::Sphere { radius: 2.0 }).unwrap();
        let down = -Vector::Y;
        let mut leaving = Leaving::default();
        let mut velocity = [40.0, 7.0];
        // Two modes of 1 and 4 g: the first moves the first sample alone along y, the second moves both.
        let mut at_samples = [0.0f32; 12];
        at_samples[2] = -1.0;
        at_samples[3] = -0.5;
        at_samples[9] = 0.5;
        let still = Pose::from_translation(Vector::Y);
        let mut held = |velocity: &mut [f32], came_from: Pose| {
            leaving.before = Some(came_from);
            leaving.begin(2, 2).unwrap();
            for at in 0..2 {
                let sample = (Vector::ZERO, Vector::ZERO);
                leaving.take(at, sample, down * 5.0, (&body, &still), 0.02);
            }
            let (at_samples, masses) = (&at_samples[..], &[1.0, 4.0][..]);
            let modal = Modal {
                at_samples,
                masses,
                velocity,
            };
            leaving.hold(Some(still), modal);
        };
        held(&mut velocity, still);
        let leaves = velocity[0] + 0.5 * velocity[1];
        assert!(leaves.abs() < 1e-4, "{leaves}");
        // By an impulse along the first sample's row: 1 and 0.5 over the masses.
        let change = [40.0 - velocity[0], 7.0 - velocity[1]];
        assert!((change[0] - 8.0 * change[1]).abs() < 1e-4, "{change:?}");
        // A tool that has gone down as fast as the sample keeps it.
        let mut velocity = [40.0, 7.0];
        held(&mut velocity, Pose::from_translation(Vector::Y * 1.9));
        assert_eq!(velocity, [40.0, 7.0]);
        // One that has gone up does not pull the modes after it: it holds as one that stands.
        let mut after = [40.0, 7.0];
        held(&mut after, Pose::IDENTITY);
        let mut stands = [40.0, 7.0];
        held(&mut stands, still);
        assert_eq!(after, stands);
        // What comes towards the tool stays as it is.
        let mut velocity = [-6.0, 7.0];
        held(&mut velocity, still);
        assert_eq!(velocity, [-6.0, 7.0]);
    }
}
