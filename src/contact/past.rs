//! What contact remembers from step to step: where the tools were, with which force each sample was pushed, what is grasped.

use ::contact::{Grasp, Pose, Vector};

use super::tool::{MAX_TOOLS, Reading};
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the forces of instruments";

/// The force on one sample, mN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Force {
    /// Place in the list of tools.
    pub tool: u32,
    /// Row of the samples.
    pub sample: u32,
    /// On the tissue.
    pub force: Vector,
}

impl Force {
    /// What forces are sorted by.
    pub fn key(&self) -> (u32, u32) {
        (self.tool, self.sample)
    }
}

/// A tool's own part.
#[derive(Clone, Debug, Default)]
pub struct Held {
    /// Where it was at the end of the step.
    pub pose: Pose,
    /// What it holds.
    pub grasp: Grasp,
    /// It was asked to hold.
    pub closed: bool,
    /// What it was told.
    pub reading: Reading,
}

/// The state of contact at the end of a step.
#[derive(Clone, Debug, Default)]
pub struct Past {
    /// One a tool, in the host's order.
    pub tools: Vec<Held>,
    /// Forces that are not zero, ascending by [`Force::key`].
    pub forces: Vec<Force>,
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
        })
    }

    /// Takes another one's values; the room stays.
    pub fn take(&mut self, other: &Past) {
        self.tools.truncate(other.tools.len());
        let count = self.tools.len();
        for (own, other) in self.tools.iter_mut().zip(&other.tools) {
            own.pose = other.pose;
            own.closed = other.closed;
            own.reading = other.reading;
            own.grasp.clone_from(&other.grasp);
        }
        self.tools.extend_from_slice(&other.tools[count..]);
        self.forces.clear();
        self.forces.extend_from_slice(&other.forces);
    }

    /// No tool.
    pub fn clear(&mut self) {
        self.tools.clear();
        self.forces.clear();
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Held>() * self.tools.capacity() + size_of::<Force>() * self.forces.capacity()
    }
}
