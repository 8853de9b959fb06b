//! Tools of a scene that a hand feels: made here, told of each published state.

use std::sync::RwLock;

use super::Scene;
use super::core::Core;
use super::hands::stepped;
use super::published::Published;
use super::published::lock_read;
use crate::error::{Error, Result};
use crate::haptics::publish::join;
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
        self.core()?
            .call(|core, published| core.add_hand(published, options))
    }
}

impl Core {
    /// A hand gets the last published state at once, so that it renders before the next step.
    fn add_hand(
        &mut self,
        published: &RwLock<Published>,
        options: &HapticOptions,
    ) -> Result<Haptics> {
        let Core { maker, hands } = self;
        let model = &maker.body.model;
        let (Some(prior), Some(_)) = (&model.prior, &maker.corrected) else {
            return Err(Error::Unsupported(
                "haptics: the bundle has no linear response, or the scene makes no corrections; use a bundle with both, and leave `corrections` on".into(),
            ));
        };
        hands.forget_gone();
        if hands.links.len() >= MOST_HANDS {
            return Err(Error::Argument(format!(
                "the scene already has {MOST_HANDS} haptics objects; destroy one first"
            )));
        }
        memory::reserve(&mut hands.links, 1, "the haptics of a scene")?;
        let samples = model.samples()?;
        let corrections = model.corrections()?;
        let integrator = maker.body.integrator;
        let (mut link, haptics) = join(options, prior, corrections, integrator, samples)?;
        hands.took_s = 0.0;
        let shared = lock_read(published);
        if let Some(step) = stepped(maker, &shared, hands.took_s) {
            link.publish(&step)?;
        }
        drop(shared);
        hands.links.push(link);
        Ok(haptics)
    }
}
