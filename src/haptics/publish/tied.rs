//! Ties that end on the hand's instrument: rows beside its samples, numbered as in a step ([`crate::contact::ties`]), whose law is the spring's.
//!
//! Between two steps the hand has the far end of a tie where its tool is, and the tissue at the tie's point yields with the compliance that samples have. The
//! damper takes no part; what it pulled with in the step is kept, as an error of the step that the hand must not feel as a motion.

use ::contact::{End, Pose, Sample, Samples, Vector};

use crate::contact::past::Force;
use crate::contact::ties::{Placed, Points, row_of, tie_of};
use crate::contact::{ContactProblem, Past};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the ties of a hand";

/// Those of a step.
#[derive(Default, HeldBytes)]
pub struct OwnTies {
    /// All ties of the step, by their place in the list; none where no tie ends on the instrument.
    placed: Vec<Placed>,
    /// Places of those that do, and are whole.
    own: Vec<u32>,
    /// Another number for ties of other nodes.
    generation: u64,
}

impl OwnTies {
    /// Finds the ties of an instrument.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn find(&mut self, problem: Option<&ContactProblem>, instrument: u32) -> Result<()> {
        let ties = problem.map_or(&[][..], |problem| &problem.past.ties);
        let is_own = |tie: &End| matches!(tie, End::Tool { tool, .. } if *tool == instrument);
        self.own.clear();
        memory::fit(&mut self.own, ties.len(), WHAT)?;
        for (index, held) in ties.iter().enumerate() {
            let tie = &held.placed.tie;
            if !held.broken && tie.spring.stiffness > 0.0 && is_own(&tie.end) {
                self.own.push(index as u32);
            }
        }
        let count = if self.own.is_empty() { 0 } else { ties.len() };
        let pairs = self.placed.iter().zip(ties);
        let is_same = self.placed.len() == count
            && pairs.fold(true, |all, (own, held)| {
                all && own.has_nodes_of(&held.placed)
            });
        self.generation += u64::from(!is_same);
        self.placed.clear();
        memory::fit(&mut self.placed, count, WHAT)?;
        self.placed
            .extend(ties[..count].iter().map(|held| held.placed));
        Ok(())
    }

    /// Their rows.
    pub fn rows(&self) -> impl Iterator<Item = u32> + Clone {
        self.own.iter().map(|index| row_of(*index as usize))
    }

    /// What rows move: samples, and these.
    pub fn points<'a>(&'a self, samples: &'a Samples) -> Points<'a> {
        Points {
            samples,
            ties: &self.placed,
            generation: self.generation,
        }
    }

    /// The tie of a row.
    pub fn of(&self, row: u32) -> Option<Placed> {
        self.placed.get(tie_of(row)?).copied()
    }

    /// The point of the tissue of a row.
    pub fn sample(&self, samples: &Samples, row: u32) -> Sample {
        self.of(row)
            .map_or_else(|| samples.at(row), |placed| placed.tie.point.into())
    }
}

/// The force of a tie's row on the tissue in the step, mN.
pub fn force(past: &Past, row: u32) -> Vector {
    tie_of(row).map_or(Vector::ZERO, |index| Force::of_tie(&past.forces, index))
}

/// By how much a tie whose point is at `point` was longer in the step than its spring alone is under that force, mm.
pub fn error(placed: &Placed, pose: &Pose, point: Vector, force: Vector) -> Vector {
    let way = point - pose.transform_point(placed.place);
    let length = way.length();
    if force == Vector::ZERO || length == 0.0 {
        return Vector::ZERO;
    }
    let spring = &placed.tie.spring;
    // The tension pulls the tissue back along the way.
    let tension = -force.dot(way) / length;
    way * ((length - spring.slack_mm - tension / spring.stiffness) / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::contact::{Spring, Tie, TiePoint};

    /// What a damper held back is no motion; what the spring holds is none either.
    #[test]
    fn an_error_is_what_the_spring_alone_does_not_explain() {
        let tie = Tie {
            point: TiePoint {
                nodes: [0; 3],
                weights: [1.0, 0.0, 0.0],
            },
            end: End::Tool {
                tool: 0,
                place: Vector::ZERO,
            },
            spring: Spring {
                stiffness: 10.0,
                slack_mm: 2.0,
                ..Spring::default()
            },
            break_mn: 0.0,
        };
        let placed = Placed {
            tie,
            place: Vector::ZERO,
        };
        let pose = Pose::from_translation(Vector::new(0.0, 0.0, 5.0));
        let off = |tension: f32| error(&placed, &pose, Vector::ZERO, Vector::Z * tension);
        assert!(off(30.0).length() < 1e-6);
        assert!((off(50.0) - Vector::Z * 2.0).length() < 1e-6);
        assert_eq!(off(0.0), Vector::ZERO);
    }
}
