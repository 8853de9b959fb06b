//! The ties of the step that a problem makes.

use ::contact::Vector;

use crate::contact::ties::Placed;
use crate::memory::HeldBytes;

/// What solves of a step may take for each pair of ties, in multiplications: some sweeps in each of a dozen solves.
const PAIR_WORK: u64 = 4000;

/// The ties of the step being made.
#[derive(Default, HeldBytes)]
pub(super) struct TieSet {
    pub list: Vec<Placed>,
    /// Where their far ends were when it began.
    pub from: Vec<Vector>,
    /// Another number for ties of other nodes.
    pub generation: u64,
    /// How long it is, s.
    pub step_s: f32,
    /// Those of the last step, while a frame begins.
    pub given: Vec<Placed>,
    /// One broke when its end was looked at.
    pub broke: bool,
}

impl TieSet {
    pub fn clear(&mut self) {
        self.list.clear();
        self.from.clear();
    }

    /// Work that the solves of a step may take beyond that of tools.
    pub fn work(&self) -> u64 {
        PAIR_WORK * (self.list.len() * self.list.len()) as u64
    }
}
