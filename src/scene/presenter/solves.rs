//! The contact of the last frames, solved once for all that show them: the region and the attached points of one frame ask the same question.
//!
//! A solve follows from the step, the time after it, how far the velocities are followed, and the tools or nodes of the frame; it is kept by the
//! bits of these. A frame in which a step arrives has two: without that step and with it.

use ::contact::Vector;

use super::extrapolation::VelocityExtrapolation;
use crate::contact::Tool;
use crate::error::Result;
use crate::field::ContactSet;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the present state of a scene";

/// What drives a frame.
#[derive(Clone, Copy)]
pub(super) enum Drive<'a> {
    Tools(&'a [Tool]),
    Nodes(&'a ContactSet),
}

/// All that a solve depends on: two frames with the same key share one solve.
#[derive(Clone, Copy)]
pub(super) struct SolveKey<'a> {
    pub step: u64,
    /// Time after the step, s.
    pub tau: f64,
    pub extrapolation: &'a VelocityExtrapolation,
    /// Nodes of support groups, and where they are.
    pub led: &'a [(u32, [f32; 3])],
    pub drive: Drive<'a>,
}

/// What contact does to the tissue of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Moves {
    #[default]
    Nothing,
    /// It moves tissue that goes on from the step.
    Pushed,
    /// It moves tissue that stays where the step left it.
    Stays,
}

/// A solve, and what it followed from.
#[derive(Default, HeldBytes)]
struct Solve {
    /// None while the solve is invalid.
    step: Option<u64>,
    tau: f64,
    driven: Vec<(Vector, f32)>,
    free: f32,
    led: Vec<(u32, [f32; 3])>,
    by_tools: bool,
    tools: Vec<Tool>,
    nodes: ContactSet,
    #[held(skip)]
    moves: Moves,
    /// What contact moves.
    coordinates: Vec<f32>,
}

/// The last two solves.
#[derive(Default, HeldBytes)]
pub struct Solves {
    kept: [Solve; 2],
    /// The older of them.
    next: usize,
    #[cfg(test)]
    pub made: u64,
}

impl Solve {
    fn answers(&self, question: &SolveKey<'_>) -> bool {
        let (driven, free) = question.extrapolation.times();
        self.step == Some(question.step)
            && self.tau.to_bits() == question.tau.to_bits()
            && self.free.to_bits() == free.to_bits()
            && self.driven == driven
            && self.led == question.led
            && match question.drive {
                Drive::Tools(tools) => {
                    let pairs = || self.tools.iter().zip(tools);
                    self.by_tools
                        && self.tools.len() == tools.len()
                        && pairs().all(|(own, tool)| own.is_same(tool))
                }
                Drive::Nodes(nodes) => {
                    !self.by_tools
                        && self.nodes.nodes == nodes.nodes
                        && self.nodes.vectors == nodes.vectors
                }
            }
    }

    fn take(&mut self, question: &SolveKey<'_>) -> Result<()> {
        let (driven, free) = question.extrapolation.times();
        self.tau = question.tau;
        self.free = free;
        memory::replace(&mut self.driven, driven, WHAT)?;
        memory::replace(&mut self.led, question.led, WHAT)?;
        self.tools.clear();
        self.nodes.clear();
        match question.drive {
            Drive::Tools(tools) => {
                memory::fit(&mut self.tools, tools.len(), WHAT)?;
                self.tools.extend_from_slice(tools);
            }
            Drive::Nodes(nodes) => self.nodes.copy_from(nodes)?,
        }
        self.by_tools = matches!(question.drive, Drive::Tools(_));
        Ok(())
    }
}

impl Solves {
    /// A question's answer of before.
    pub(super) fn find(&self, question: &SolveKey<'_>) -> Option<usize> {
        self.kept.iter().position(|kept| kept.answers(question))
    }

    /// What the contact of an answer moves, in the coordinates of the linear response; none where it moves nothing.
    pub(super) fn moves(&self, place: usize) -> Option<&[f32]> {
        let solve = &self.kept[place];
        (solve.moves != Moves::Nothing).then_some(&*solve.coordinates)
    }

    /// Whether the tissue of an answer stays where the step left it, but for what contact moves.
    pub(super) fn stays(&self, place: usize) -> bool {
        self.kept[place].moves == Moves::Stays
    }

    /// Solves for a key, in place of the older of the two solves: `make` fills `width` coordinates and returns what contact does.
    ///
    /// # Errors
    /// What `make` gives, [`crate::Error::OutOfMemory`]; that answer is gone then.
    pub(super) fn make(
        &mut self,
        question: &SolveKey<'_>,
        width: usize,
        make: impl FnOnce(&mut [f32]) -> Result<Moves>,
    ) -> Result<usize> {
        let place = self.next;
        let solve = &mut self.kept[place];
        solve.step = None;
        if solve.coordinates.len() != width {
            solve.coordinates = memory::zeros(width, WHAT)?;
        }
        solve.take(question)?;
        solve.moves = make(&mut solve.coordinates)?;
        solve.step = Some(question.step);
        self.next = 1 - place;
        #[cfg(test)]
        {
            self.made += 1;
        }
        Ok(place)
    }
}
