//! A scene that records itself: begun, taken, ended.

use std::borrow::Cow;
use std::sync::RwLock;
use std::sync::atomic::Ordering;

use super::Scene;
use super::core::Core;
use super::published::Published;
use super::published::lock_read;
use super::record::WHAT;
use crate::error::{Error, Result};
use crate::memory;
use crate::options::{Corrections, StepPath};
use crate::replay::Recorder;
use crate::replay::base64::Bytes;
use crate::replay::lines::{Header, Line, SceneFields, VERSION};

impl Scene {
    /// Begins to record what the scene is given, in steps, cuts, restored snapshots and all else that later steps depend on, with the hash of every
    /// `every`-th step's displacements; 0 ends the recording. A scene that is not at rest puts its state first. [`Scene::take_record`] gives the lines.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model, &SceneOptions::default())?;
    /// scene.record(1)?;
    /// scene.step(Contact::None, None)?;
    /// scene.record(0)?;
    /// let text = String::from_utf8(scene.take_record()?).unwrap(); // for `upt replay --verify`
    /// assert_eq!(text.lines().count(), 3);
    /// # upt::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`Error::State`] where a recording is on, where there is none to end, and where the last one has not been taken; [`Error::Unsupported`] for a scene
    /// whose steps depend on the clock, or that has a mesh of its own.
    pub fn record(&self, every: u32) -> Result<()> {
        self.core()?.call(|core, published| {
            let mut place = self.shared.record.lock();
            match (&mut *place, every) {
                (Some(recorder), 0) if recorder.is_on() => {
                    recorder.end()?;
                    self.shared.record.on.store(false, Ordering::Release);
                }
                (_, 0) => {
                    return Err(Error::State(
                        "record: no recording is on; begin one first".into(),
                    ));
                }
                (Some(recorder), _) if recorder.is_on() => {
                    return Err(Error::State(
                        "record: a recording is on; end it with 0 first".into(),
                    ));
                }
                (Some(recorder), _) if !recorder.text().is_empty() => {
                    return Err(Error::State(
                        "record: the lines of the last recording were not taken; take them first"
                            .into(),
                    ));
                }
                (place, every) => {
                    *place = Some(memory::boxed(core.recorder(published, every)?, WHAT)?);
                    self.shared.record.on.store(true, Ordering::Release);
                }
            }
            Ok(())
        })
    }

    /// The lines of the recording that were not taken before, UTF-8; empty where there are none. Also while a step is in flight.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; the lines stay.
    pub fn take_record(&self) -> Result<Vec<u8>> {
        self.with_record(|text| Ok((memory::copied(text, WHAT)?, true)))
    }

    /// Calls with the lines that were not taken; they are forgotten if it says so.
    pub(crate) fn with_record<T>(
        &self,
        call: impl FnOnce(&[u8]) -> Result<(T, bool)>,
    ) -> Result<T> {
        let mut place = self.shared.record.lock();
        let text = place.as_ref().map_or(&[][..], |own| own.text());
        let (made, taken) = call(text)?;
        if let (true, Some(recorder)) = (taken, &mut *place) {
            recorder.forget();
        }
        Ok(made)
    }
}

impl Core {
    /// A recorder whose first lines say with which scene, and in which state, what follows was called.
    fn recorder(&self, published: &RwLock<Published>, every: u32) -> Result<Recorder> {
        let refused = |what: &str| Err(Error::Unsupported(format!("record: {what}")));
        let maker = &self.maker;
        let options = &maker.options;
        if options.mesh_path.is_some() {
            return refused(
                "the scene has a mesh of its own (mesh_path), which a recording cannot name",
            );
        }
        if let Corrections::RecommendedWithin { budget_us } | Corrections::Auto { budget_us, .. } =
            options.corrections
            && budget_us != 0
        {
            return refused(
                "corrections.budget_us counts by the clock, so that no replay has its bits; give a count or a target",
            );
        }
        let mut scene = SceneFields::new(options, maker.engine.precision());
        if scene.step_path == StepPath::Measured {
            scene.step_path = maker.engine.path();
        }
        let header = Header {
            upt_replay: VERSION,
            libupt: env!("CARGO_PKG_VERSION").into(),
            bundle: maker.body.model.manifest.name.clone(),
            bundle_sha256: Some(crate::bundle::hex(&maker.body.model.hash)),
            portable: maker.machine.isa == crate::kernels::Isa::Portable,
            scene,
        };
        let is_at_rest = maker.states.counters.step_count == 0 && maker.body.cut.is_none();
        let state = match is_at_rest {
            true => None,
            false => Some(Line::Restore(Bytes(Cow::Owned(self.save(published)?)))),
        };
        let mut recorder = Recorder::new(&header, u64::from(every), state)?;
        let region = lock_read(published).region_copy()?;
        if let Some(region) = region {
            recorder.open(&Line::Region(Some(Cow::Owned(region))))?;
            recorder.close(|| [0; 32]);
        }
        Ok(recorder)
    }
}
