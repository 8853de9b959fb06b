//! What contact remembers from step to step: where the tools were, with which force each sample was pushed, what is grasped.
//!
//! REQ-044: A tool that starts inside the tissue is told of and comes out on its own side.

use ::contact::grasp::Anchor;
use ::contact::{End, Grasp, Pose, Samples, Vector};

use serde::{Deserialize, Serialize};

use super::stored;
use super::ties::{HeldTie, MAX_TIES, NO_TOOL, row_of, tie_of};
use super::tool::{MAX_TOOLS, ToolReading};
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the forces of instruments";
/// See `Past::is_wedged`.
const WEDGED: f32 = 10.0;

/// The force on one sample, mN.
#[derive(Clone, Copy, Debug, PartialEq, HeldBytes, Serialize, Deserialize)]
pub struct Force {
    /// Place in the list of tools; of a tie none (`NO_TOOL`).
    pub tool: u32,
    /// Row of the samples, or of a tie.
    pub sample: u32,
    /// On the tissue.
    #[serde(with = "stored::vector")]
    pub force: Vector,
}

impl Force {
    /// That of a tie among forces.
    pub fn of_tie(forces: &[Force], index: usize) -> Vector {
        let found = forces.binary_search_by_key(&(NO_TOOL, row_of(index)), Force::key);
        found.map_or(Vector::ZERO, |at| forces[at].force)
    }

    /// What forces are sorted by.
    pub fn key(&self) -> (u32, u32) {
        (self.tool, self.sample)
    }
}

/// A tool's own part.
#[derive(Debug, Default, HeldBytes, Serialize, Deserialize)]
pub struct Held {
    /// Where it was at the end of the step.
    #[serde(with = "stored::pose")]
    pub pose: Pose,
    /// What it holds.
    #[serde(with = "stored::grasp")]
    pub grasp: Grasp,
    /// It was asked to hold.
    pub closed: bool,
    /// What it was told: of the step alone.
    #[serde(skip)]
    pub reading: ToolReading,
}

/// The state of contact at the end of a step.
#[derive(Debug, Default, HeldBytes, Serialize, Deserialize)]
pub struct Past {
    /// One a tool, in the host's order.
    pub tools: Vec<Held>,
    /// Forces that are not zero, ascending by [`Force::key`].
    pub forces: Vec<Force>,
    /// One a tie, in the host's order.
    pub ties: Vec<HeldTie>,
}

impl Past {
    /// Room for as many forces as there are samples.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn with_room(samples: usize) -> Result<Past> {
        Ok(Past {
            tools: memory::room(MAX_TOOLS, WHAT)?,
            forces: memory::room(samples, WHAT)?,
            ties: Vec::new(),
        })
    }

    /// Whether forces are at work.
    pub fn has_forces(&self) -> bool {
        !self.forces.is_empty()
    }

    /// Whether tools push.
    pub fn tools_push(&self) -> bool {
        self.forces.iter().any(|force| force.tool != NO_TOOL)
    }

    /// Whether the forces of a tool that pushed `before` hold little but each other: they are ten times as large as those, and as their own sum. Two rows on
    /// opposite sides of a thin tool, on tissue between which nothing yields, drive each other apart so.
    pub fn is_wedged(&self, before: &Past) -> bool {
        let all = |past: &Past, index: usize| {
            let own = past.forces.iter();
            let own = own.filter(|force| force.tool == index as u32);
            own.fold((0.0, Vector::ZERO), |(length, sum), force| {
                (length + force.force.length(), sum + force.force)
            })
        };
        let mut tools = self.tools.iter().enumerate();
        tools.any(|(index, held)| {
            let ((length, sum), (then, _)) = (all(self, index), all(before, index));
            let holds = !held.grasp.anchors().is_empty();
            !holds && then > 0.0 && length > WEDGED * then.max(sum.length())
        })
    }

    /// Whether a grasper holds a sample.
    pub fn has_grasp(&self) -> bool {
        let holds = |held: &Held| !held.grasp.anchors().is_empty();
        self.tools.iter().any(holds)
    }

    /// Whether a grasp has torn off in the step.
    pub fn tears(&self) -> bool {
        self.tools.iter().any(|held| held.reading.torn)
    }

    /// Multiplies all forces.
    pub fn scale_forces(&mut self, factor: f32) {
        for force in &mut self.forces {
            force.force *= factor;
        }
    }

    /// Checks what was read against the samples of the surface of a body of so many nodes.
    ///
    /// # Errors
    /// [`Error::Snapshot`].
    pub fn check(&self, samples: &Samples, node_count: usize) -> Result<()> {
        let bad = |what: &str| {
            Err(Error::Snapshot(format!(
                "holds {what} that no scene can have"
            )))
        };
        let Past {
            tools,
            forces,
            ties,
        } = self;
        if tools.len() > MAX_TOOLS {
            return bad("a number of instruments");
        }
        for Held {
            pose,
            grasp,
            closed: _,
            reading: _,
        } in tools
        {
            if !pose.translation.is_finite() {
                return bad("a position");
            }
            // Not a number is no length either.
            if !matches!((pose.rotation.length() - 1.0).abs(), 0.0..=1e-2) {
                return bad("a rotation");
            }
            let anchors = grasp.anchors();
            let ascends = anchors.is_sorted_by(|a, b| a.sample < b.sample);
            let known = |anchor: &Anchor| samples.is_row(anchor.sample) && anchor.place.is_finite();
            if !ascends || !anchors.iter().all(known) {
                return bad("a grasp");
            }
        }
        // They are found by binary search.
        let ascends = forces.is_sorted_by(|a, b| a.key() < b.key());
        let known = |one: &Force| {
            let is_row = match tie_of(one.sample) {
                Some(index) => one.tool == NO_TOOL && index < ties.len(),
                None => (one.tool as usize) < tools.len() && samples.is_row(one.sample),
            };
            is_row && one.force.is_finite()
        };
        if !ascends || !forces.iter().all(known) {
            return bad("a force");
        }
        // A tie has its far end in the tissue, in a tool or in space: only the first has nodes of its own.
        let is_sound = |HeldTie { placed, .. }: &HeldTie| {
            let far = match placed.tie.end {
                End::Tissue(far) => far.nodes,
                _ => placed.tie.point.nodes,
            };
            let mut nodes = placed.tie.point.nodes.into_iter().chain(far);
            let is_known = nodes.all(|node| (node as usize) < node_count);
            is_known && placed.place.is_finite() && placed.tie.check().is_ok()
        };
        if ties.len() > MAX_TIES || !ties.iter().all(is_sound) {
            return bad("a tie");
        }
        Ok(())
    }

    /// Takes another one's values; the room stays.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`]: some values are the other one's.
    pub fn take(&mut self, other: &Past) -> Result<()> {
        self.tools.truncate(other.tools.len());
        memory::fit(&mut self.tools, other.tools.len(), WHAT)?;
        self.tools.resize_with(other.tools.len(), Held::default);
        for (own, other) in self.tools.iter_mut().zip(&other.tools) {
            own.pose = other.pose;
            own.closed = other.closed;
            own.reading = other.reading;
            memory::tried(own.grasp.take(&other.grasp), WHAT)?;
        }
        memory::replace(&mut self.ties, &other.ties, WHAT)?;
        memory::replace(&mut self.forces, &other.forces, WHAT)
    }

    /// A copy.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn copy(&self) -> Result<Past> {
        let mut copy = Past::default();
        copy.take(self)?;
        Ok(copy)
    }

    /// Whether there is no tool and no tie.
    pub fn is_empty(&self) -> bool {
        self.tools.is_empty() && self.ties.is_empty()
    }

    /// No tool and no tie.
    pub fn clear(&mut self) {
        self.tools.clear();
        self.ties.clear();
        self.forces.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_that_hold_little_but_each_other_are_a_wedge() {
        let of = |forces: &[[f32; 3]]| Past {
            tools: vec![Held::default()],
            forces: (0..)
                .zip(forces)
                .map(|(sample, force)| Force {
                    tool: 0,
                    sample,
                    force: (*force).into(),
                })
                .collect(),
            ties: Vec::new(),
        };
        let before = of(&[[0.0, 0.0, -300.0]]);
        let wedge = of(&[[0.0, 0.0, -28_500.0], [0.0, 0.0, 28_600.0]]);
        assert!(wedge.is_wedged(&before));
        // A fold held from both sides, a blow, and a tool that meets the tissue now.
        assert!(!of(&[[900.0, 0.0, 0.0], [-900.0, 0.0, 0.0]]).is_wedged(&before));
        assert!(!of(&[[0.0, 0.0, -60_000.0]]).is_wedged(&before));
        assert!(!wedge.is_wedged(&of(&[])));
        assert!(!wedge.is_wedged(&wedge));
    }
}
