//! What a step publishes for a tool: the samples near it, how they move under forces and in the natural modes, the forces on
//! them and the velocities.

use ::contact::{Pose, Vector};

use crate::contact::ties::Placed;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "a contact problem for haptics";
/// Samples at most: what lies farther from the tool is left out.
pub const MOST_SAMPLES: usize = 96;

/// The contact problem near one tool at the end of a step.
#[derive(Debug, HeldBytes)]
pub struct ContactSnapshot {
    /// Published states so far; 0: none.
    pub number: u64,
    /// How old it was when it was published, s.
    pub latency_s: f64,
    /// Where the tool was in the step, if it took part.
    pub pose: Option<Pose>,
    pub samples: SnapshotSamples,
    /// How samples move at once under forces on samples `[3n,3n]`, mm/mN: the compliance without the natural modes.
    pub delassus: Vec<f32>,
    /// Time that samples take to follow a force at once: of their mass on the spring of `delassus`, s.
    pub delay_s: f32,
    pub modes: SnapshotModes,
}

/// The samples near the tool. All lists have room for [`MOST_SAMPLES`], `count` are used.
#[derive(Debug, HeldBytes)]
pub struct SnapshotSamples {
    pub count: usize,
    /// Where they are, mm.
    pub points: Vec<Vector>,
    /// How fast support groups carry them, mm/s, and how long that is followed after the step, s.
    pub carried: Vec<Vector>,
    pub followed_s: f64,
    /// The surface there.
    pub facing: Vec<Facing>,
    /// Of the tool on the tissue, mN.
    pub forces: Vec<Vector>,
    /// Of a held one, its place on the tool.
    pub anchors: Vec<Option<Vector>>,
    /// Of a tie that ends on the tool, what it is.
    pub ties: Vec<Option<Placed>>,
    /// The step's own error: gap (x) of a touching sample, way from the anchor of a held one, a tie's length beyond what its spring explains, mm.
    pub errors: Vec<Vector>,
}

/// The natural modes, `m`.
#[derive(Debug, HeldBytes)]
pub struct SnapshotModes {
    pub count: usize,
    /// The modes at the samples `[3n,m]`.
    pub at_samples: Vec<f32>,
    /// Velocity `[m]`.
    pub velocity: Vec<f32>,
    /// What drives them while the forces stay `[m]`: their acceleration and damping.
    pub drive: Vec<f32>,
}

/// How the surface lies at a sample.
#[derive(Clone, Copy, Debug, Default, HeldBytes)]
pub struct Facing {
    /// Outward, unit length.
    pub outward: Vector,
    /// It is a wall that a blade has laid open.
    pub is_wall: bool,
}

impl ContactSnapshot {
    /// Room for a body of `modes` natural modes.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(modes: usize) -> Result<ContactSnapshot> {
        let vectors = || memory::filled(MOST_SAMPLES, Vector::ZERO, WHAT);
        let rows = 3 * MOST_SAMPLES;
        Ok(ContactSnapshot {
            number: 0,
            latency_s: 0.0,
            pose: None,
            samples: SnapshotSamples {
                count: 0,
                points: vectors()?,
                carried: vectors()?,
                followed_s: 0.0,
                facing: memory::filled(MOST_SAMPLES, Facing::default(), WHAT)?,
                forces: vectors()?,
                anchors: memory::filled(MOST_SAMPLES, None, WHAT)?,
                ties: memory::filled(MOST_SAMPLES, None, WHAT)?,
                errors: vectors()?,
            },
            delassus: memory::zeros(rows * rows, WHAT)?,
            delay_s: 0.0,
            modes: SnapshotModes {
                count: modes,
                at_samples: memory::zeros(rows * modes, WHAT)?,
                velocity: memory::zeros(modes, WHAT)?,
                drive: memory::zeros(modes, WHAT)?,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exchange::exchange;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// One number in every field.
    fn write(snapshot: &mut ContactSnapshot, number: u64) {
        let value = number as f32;
        snapshot.samples.points.fill(Vector::splat(value));
        snapshot.delassus.fill(value);
        snapshot.modes.velocity.fill(value);
        snapshot.number = number;
    }

    fn is_whole(snapshot: &ContactSnapshot) -> bool {
        let value = snapshot.number as f32;
        snapshot
            .samples
            .points
            .iter()
            .all(|point| *point == Vector::splat(value))
            && snapshot.delassus.iter().all(|w| *w == value)
            && snapshot.modes.velocity.iter().all(|v| *v == value)
    }

    /// What is read while the other thread writes is of one step, whole, and never older than what was read before.
    #[test]
    fn a_problem_is_never_torn() {
        // Miri is slow, and looks at each access.
        let count = if cfg!(miri) { 3 } else { 20_000 };
        let (mut out, mut snapshot) =
            exchange([4; 3].map(|modes| ContactSnapshot::new(modes).unwrap()));
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for number in 1..=count {
                    write(out.buffer(), number);
                    out.publish();
                }
                done.store(true, Ordering::Release);
            });
            let mut last = 0;
            loop {
                let over = done.load(Ordering::Acquire);
                snapshot.update();
                let now = snapshot.buffer();
                assert!(is_whole(now), "torn at {}", now.number);
                assert!(now.number >= last);
                last = now.number;
                if over {
                    break;
                }
            }
            assert_eq!(last, count);
        });
    }
}
