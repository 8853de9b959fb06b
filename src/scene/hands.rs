//! The hands of a scene: each is told of every state that is published.

use std::sync::RwLock;

use super::maker::StepMaker;
use super::published::{Published, lock_read};
use crate::features::HAS_INSTRUMENTS;
use crate::haptics::publish::{Link, Stepped};

/// The hands of a scene.
#[derive(Default)]
pub struct Hands {
    /// One for each haptics object of the scene. Each gets the contact of every published step.
    pub links: Vec<Link>,
    /// Wall time of the last step, s: a hand takes it as the age of what it gets.
    pub took_s: f64,
}

impl Hands {
    /// Publishes the last state for each hand.
    pub fn publish(&mut self, maker: &StepMaker, published: &RwLock<Published>) {
        if !HAS_INSTRUMENTS || self.links.is_empty() {
            return;
        }
        self.forget_gone();
        let shared = lock_read(published);
        // Only a scene that corrects a bundle with linear response has any: `add_hand` has asked.
        let Some(step) = stepped(maker, &shared, self.took_s) else {
            return;
        };
        for hand in &mut self.links {
            // The step is made and cannot fail any more: what lacked memory is tried once more, and then the hand goes on from the
            // step before.
            if let Err(error) = hand.publish(&step).or_else(|_| hand.publish(&step)) {
                tracing::error!("haptics: the step was not published: {error}");
            }
        }
    }

    /// Forgets hands whose haptics objects are gone.
    pub fn forget_gone(&mut self) {
        self.links.retain(|hand| !hand.is_over());
    }

    /// Bytes that the hands hold.
    pub fn memory_bytes(&self) -> usize {
        self.links.iter().map(|hand| hand.memory_bytes()).sum()
    }
}

/// The last state, as hands are told of it.
pub(super) fn stepped<'a>(
    maker: &'a StepMaker,
    shared: &'a Published,
    took_s: f64,
) -> Option<Stepped<'a>> {
    let body = &maker.body;
    Some(Stepped {
        compute: maker.machine.compute(),
        prior: body.model.prior.as_ref()?,
        corrections: body.model.corrections().ok()?,
        motion: &maker.corrected.as_ref()?.solver.motion,
        problem: maker.tools.problem.as_deref(),
        rest: &body.mesh.positions,
        u: &shared.last.field,
        took_s,
        integrator: body.integrator,
        let_go: maker.loads.let_go(),
    })
}
