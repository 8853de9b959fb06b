//! Ties of a step: checked, and their far ends put into the mesh's frame.
//!
//! REQ-072: A tie pulls as its spring does, and once broken stays so.

use ::contact::{End, Tie, Vector};

use super::StepInput;
use super::core::Core;
use crate::contact::{Placed, ties};
use crate::error::{Error, Result};
use crate::memory;

const WHAT: &str = "the ties of a scene";

impl Core {
    /// # Errors
    /// [`Error::Unsupported`] for ties in a scene that makes no corrections.
    pub(super) fn check_ties(&self, ties: &[Tie]) -> Result<()> {
        match ties.is_empty() || self.corrected.is_some() {
            true => Ok(()),
            false => Err(Error::Unsupported(
                "ties: the scene makes no corrections, in which ties pull; set `corrections`"
                    .into(),
            )),
        }
    }

    /// Takes the ties of a step with so many tools.
    ///
    /// # Errors
    /// [`Error::Argument`] and [`Error::NonFinite`] with the tie and its field, [`Error::OutOfMemory`].
    pub(super) fn place_ties(&mut self, input: &StepInput<'_>, tools: usize) -> Result<()> {
        let given = input.loads.ties;
        let (prior, held) = (&self.model.prior, &self.held);
        let moves = |node: u32| {
            let prior = prior.as_ref();
            prior.is_some_and(|prior| prior.column_for(held, node).is_some())
        };
        ties::check(given, tools, self.mesh.node_count(), moves)?;
        let support = input.loads.support.map(|pose| pose.checked()).transpose()?;
        self.placed_ties.clear();
        memory::fit(&mut self.placed_ties, given.len(), WHAT)?;
        self.placed_ties.extend(given.iter().map(|tie| Placed {
            tie: *tie,
            place: match (tie.end, &support) {
                (End::World(place), Some(support)) => support.inverse_transform_point(place),
                (End::World(place) | End::Support(place) | End::Tool { place, .. }, _) => place,
                (End::Tissue(_), _) => Vector::ZERO,
            },
        }));
        Ok(())
    }
}
