//! What the scene's end of a hand keeps of a body: made before the body changes, and taken with it.

use std::sync::Arc;

use ::contact::{Samples, Search};

use super::softened::Softened;
use super::{AT_ONCE_S, Link, WHAT};
use crate::contact::Delassus;
use crate::corrections::{Corrections, Integrator};
use crate::error::Result;
use crate::memory;
use crate::prior::PriorTable;

/// See the module.
pub struct HandTissue {
    samples: Arc<Samples>,
    search: Search,
    inertial_compliance: Vec<f32>,
    starts: Vec<usize>,
    field: Vec<f32>,
    masses: Vec<f32>,
}

impl HandTissue {
    /// That of a body, with the damping of the scene's steps.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(
        prior: &PriorTable,
        corrections: &Corrections,
        integrator: Integrator,
        samples: &Arc<Samples>,
    ) -> Result<HandTissue> {
        let natural = corrections.space.natural()?;
        let kappa = integrator.over(AT_ONCE_S).kappa();
        Ok(HandTissue {
            samples: Arc::clone(samples),
            search: memory::tried(Search::with_room(samples), WHAT)?,
            inertial_compliance: corrections.space.inertial_compliance(kappa)?,
            starts: prior.basis_starts()?,
            field: memory::zeros(3 * corrections.body.mass.len(), WHAT)?,
            masses: memory::collected(natural.len(), natural.iter().map(|mode| mode.1), WHAT)?,
        })
    }
}

impl Link {
    /// Goes on in another body. The hand keeps what it was told last until it is told again.
    pub fn take(&mut self, tissue: HandTissue) {
        self.near.samples = tissue.samples;
        self.near.search = tissue.search;
        self.inertial_compliance = tissue.inertial_compliance;
        self.modal.starts = tissue.starts;
        self.modal.field = tissue.field;
        self.modal.masses = tissue.masses;
        self.delassus = Delassus::default();
        self.softened = Softened::default();
    }
}
