//! How much softer a cut body is under a hand than the intact one, whose columns the hand's compliance is made of.
//!
//! The last step has solved its contact with the compliance of the body as it is, `W'`. Under the forces `f` of the tool then, the samples that it pushed go `f^T W' f / f^T W f` times as
//! far as those of the intact body, both for the length of a step; all of `W` is scaled by that.

use super::stepped::Stepped;
use super::tied::OwnTies;
use crate::contact::past::Force;
use crate::contact::{Compliance, Delassus};
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use ::contact::{Samples, Vector};

const WHAT: &str = "how soft a cut body is";
/// A flap that hangs by little is softer yet: its own mass holds it between two steps.
const MOST: f32 = 8.0;

/// Room for what the intact body does in a step.
#[derive(Default, HeldBytes)]
pub(super) struct Softened {
    /// What inertia takes off the compliance of each natural mode.
    inertial: Vec<f32>,
    /// `W` at the samples that were pushed.
    intact: Delassus,
    pushed: Vec<u32>,
}

impl Softened {
    /// How many times as far as the intact body's samples those go that a tool pushes; 1 where the body has not been cut or the tool pushes nothing.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn factor(
        &mut self,
        step: &Stepped<'_>,
        instrument: u32,
        (ties, samples): (&OwnTies, &Samples),
    ) -> Result<f32> {
        let Some(problem) = step
            .problem
            .filter(|_| !step.corrections.changed.is_empty())
        else {
            return Ok(1.0);
        };
        let forces = &problem.past.forces;
        let force = |row: u32| {
            let key = |force: &Force| (force.tool, force.sample);
            let found = forces.binary_search_by_key(&(instrument, row), key);
            found.map_or(Vector::ZERO, |at| forces[at].force)
        };
        let deformed = &problem.solution.responses;
        let known = deformed.deformed().iter();
        self.pushed.clear();
        memory::fit(&mut self.pushed, known.len(), WHAT)?;
        (self.pushed).extend(known.filter(|row| force(**row) != Vector::ZERO));
        if self.pushed.is_empty() {
            return Ok(1.0);
        }
        let space = &step.corrections.space;
        self.inertial.clear();
        memory::fit(&mut self.inertial, space.natural_count(), WHAT)?;
        (self.inertial).extend(space.holds_back(step.integrator.kappa()));
        let held = &step.corrections.body.held.is;
        let intact = Compliance::at_rest(step.prior, held, Some((space, &self.inertial)));
        (self.intact).of(intact, ties.points(samples), &self.pushed)?;
        let [now, then] = [deformed.work(force), self.intact.work(force)];
        Ok(if then > 0.0 {
            (now / then).clamp(1.0, MOST)
        } else {
            1.0
        })
    }
}
