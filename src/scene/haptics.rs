//! Tools of a scene that a hand feels: made here, told of each published state.

use std::sync::RwLock;

use super::Scene;
use super::core::{Core, lock_read};
use super::published::Published;
use crate::error::{Error, Result};
use crate::features::HAS_INSTRUMENTS;
use crate::haptics::publish::{Stepped, join};
use crate::haptics::{HapticOptions, Haptics};
use crate::memory;

/// Hands of one scene.
const MOST_HANDS: usize = 8;

impl Scene {
    /// Makes a tool felt: from the next step on each is published for it.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// use upt::haptics::{HapticOptions, HapticPose};
    /// use upt::{Shape, Tool};
    ///
    /// let ball = Tool::new(&Shape::Sphere { radius: 5.0 }, [0.0; 3], [0.0, 0.0, 0.0, 1.0])?;
    /// let mut hand = scene.haptics(&HapticOptions::new(0, ball))?;
    /// // In the thread of the device, a thousand times a second:
    /// let pose = HapticPose {
    ///     time_s: 0.001,
    ///     position_m: [0.5, 0.0, 0.0], // far away
    ///     rotation: [0.0, 0.0, 0.0, 1.0],
    ///     velocity: None,
    /// };
    /// assert_eq!(hand.render(&pose)?.force_n, [0.0; 3]);
    /// # upt::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Argument`] for the tool, an option, or one hand too many; [`Error::Unsupported`] for a bundle without linear response or
    /// corrections and a scene that does not correct; [`Error::Busy`] while the scene is used or a step is in flight.
    pub fn haptics(&self, options: &HapticOptions) -> Result<Haptics> {
        self.with(|core, published| core.add_hand(published, options))
    }
}

impl Core {
    fn add_hand(
        &mut self,
        published: &RwLock<Published>,
        options: &HapticOptions,
    ) -> Result<Haptics> {
        let (Some(prior), Some(_)) = (&self.model.prior, &self.corrected) else {
            return Err(Error::Unsupported(
                "haptics: the bundle has no linear response, or the scene makes no corrections; use a bundle with both, and leave `corrections` on".into(),
            ));
        };
        self.hands.retain(|hand| !hand.is_over());
        if self.hands.len() >= MOST_HANDS {
            return Err(Error::Argument(format!(
                "the scene already has {MOST_HANDS} haptics objects; destroy one first"
            )));
        }
        memory::reserve(&mut self.hands, 1, "the haptics of a scene")?;
        let samples = self.model.samples()?;
        let corrections = self.model.corrections()?;
        let (mut link, haptics) = join(options, prior, corrections, self.integrator(), samples)?;
        self.took_s = 0.0;
        let shared = lock_read(published);
        if let Some(step) = self.stepped(&shared) {
            link.publish(&step)?;
        }
        drop(shared);
        self.hands.push(link);
        Ok(haptics)
    }

    /// The last state, as hands are told of it.
    fn stepped<'a>(&'a self, shared: &'a Published) -> Option<Stepped<'a>> {
        Some(Stepped {
            isa: self.machine.isa,
            pool: &self.machine.pool,
            prior: self.model.prior.as_ref()?,
            corrections: self.model.corrections().ok()?,
            motion: &self.corrected.as_ref()?.solver.motion,
            problem: self.problem.as_deref(),
            rest: &self.mesh.positions,
            u: &shared.last.field,
            took_s: self.took_s,
            integrator: self.integrator(),
            let_go: (self.loads.as_ref()).map_or(0, |loads| loads.let_go()),
        })
    }

    /// Publishes the last state for each hand.
    pub(super) fn publish_to_hands(&mut self, published: &RwLock<Published>) {
        if !HAS_INSTRUMENTS || self.hands.is_empty() {
            return;
        }
        self.hands.retain(|hand| !hand.is_over());
        let mut hands = std::mem::take(&mut self.hands);
        let shared = lock_read(published);
        if let Some(step) = self.stepped(&shared) {
            for hand in &mut hands {
                // The step is made and cannot fail any more: what lacked memory is tried once more, and then the hand goes on from the
                // step before.
                if let Err(error) = hand.publish(&step).or_else(|_| hand.publish(&step)) {
                    tracing::error!("haptics: the step was not published: {error}");
                }
            }
        }
        drop(shared);
        self.hands = hands;
    }
}
