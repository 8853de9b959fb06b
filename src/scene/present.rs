//! The tissue at the present moment: between steps, and while one is in flight, with the instruments where they are now.
//!
//! REQ-052: The arrival of a step moves no frame at its moment.

use std::sync::{Arc, RwLock};

use super::core::Core;
use super::corrected::Corrector;
use super::frame_state::FrameState;
use super::published::{Published, View};
use super::published::{lock_read, lock_write};
use super::shared::lock;
use super::step_input::FrameInput;
use super::step_states::StepStates;
use super::supports;
use super::tissue::Tissue;
use super::{Scene, StepInput};
use crate::contact::Past;
use crate::error::{Error, Result};
use crate::kernels::FlushToZero;
use crate::memory::{self, HeldBytes};
use crate::output::Output;

const WHAT: &str = "the present state of a scene";

impl Scene {
    /// The displacements `[n,3]` of a view at a moment between steps, with the instruments or nodes and the support groups of `input` where they are then.
    ///
    /// `when` is on the clock of [`StepInput::time_s`]; where a host gives its steps no time, it is the time since the last
    /// published step, s. An input without a drive is tissue that nothing touches any more.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, View};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// scene.step(Contact::None, None)?;
    /// let mut u = vec![0.0; 3 * scene.node_count()];
    /// scene.present(Contact::None, 0.01, View::Region, &mut u)?; // 10 ms after the step, without tools
    /// assert!(u.iter().all(|x| x.is_finite()));
    /// # upt::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`Error::NonFinite`] and [`Error::Argument`] for `when`, an instrument or nodes that are not of the mesh or there twice, and for an
    /// input with a displacement or a time, [`Error::Unsupported`] for a bundle without linear response or corrections or a scene
    /// that does not correct, [`Error::Busy`] while another thread presents, and at the first call while a step is in flight,
    /// [`Error::State`] for the points where none are attached, and for the surface where the body has changed since its update.
    pub fn present<'a>(
        &self,
        input: impl Into<StepInput<'a>>,
        when: f64,
        view: View,
        out: &mut [f32],
    ) -> Result<()> {
        self.present_to(input.into(), when, view, out.into())
    }

    /// [`Scene::present`] into memory that need not be initialised.
    pub(crate) fn present_to(
        &self,
        input: StepInput<'_>,
        when: f64,
        view: View,
        out: Output<'_, f32>,
    ) -> Result<()> {
        if !when.is_finite() {
            return Err(Error::NonFinite(format!("when is {when}")));
        }
        input.check_of_frame()?;
        supports::check(input.loads.supports, &self.mesh.supports)?;
        if view != View::Surface {
            lock_read(&self.shared.published).check_len(view, out.len())?;
        }
        let _mode = FlushToZero::of(self.model.execution.isa);
        let mut presenters = lock(&self.tools.presenters)?;
        let attached = match view {
            View::Region => None,
            View::Points => Some(Arc::clone(&lock_read(&self.shared.published).attached)),
            View::Surface => Some(self.surface().points(out.len())?),
        };
        // While frames are held no body changes.
        let cut = lock_read(&self.shared.published).body.cut.clone();
        let model = cut.as_ref().map_or(&self.model, |cut| &cut.0);
        let mesh = cut.as_ref().map_or(&self.mesh, |cut| &cut.0.mesh);
        let tissue = Tissue {
            published: &self.shared.published,
            model,
            mesh,
            intact_nodes: self.mesh.node_count(),
            integrator: self.integrator,
        };
        presenters.prepare(&tissue, view, || {
            let begun = lock_read(&self.shared.published).frame_state.is_some();
            match begun {
                true => Ok(()),
                false => self
                    .core()?
                    .call(|core, published| core.start_frame_states(published)),
            }
        })?;
        let driven = FrameInput {
            contact: input.contact,
            supports: input.loads.supports,
        };
        presenters.frame(&tissue, (view, when), driven, (attached, out))
    }

    /// Bytes of what presents.
    pub(super) fn presenter_bytes(&self) -> usize {
        lock(&self.tools.presenters).map_or(0, |presenters| presenters.held_bytes())
    }
}

impl Core {
    /// From now on each published step leaves a moment.
    pub(super) fn start_frame_states(&mut self, published: &RwLock<Published>) -> Result<()> {
        let maker = &self.maker;
        if maker.corrected.is_none() {
            return Err(Error::Unsupported(
                "present: the scene makes no corrections (`corrections`); show its steps with upt_scene_sample".into(),
            ));
        }
        let mut shared = lock_write(published);
        if shared.frame_state.is_none() {
            let len = shared.last.field.len();
            let mut frame_state = FrameState {
                velocity: memory::zeros(len, WHAT)?,
                past: Past::with_room(1024)?,
                next: Past::with_room(1024)?,
                groups: Vec::new(),
                next_groups: Vec::new(),
                nodes: memory::room(1024, WHAT)?,
                forces: memory::room(3 * 1024, WHAT)?,
                step: 0,
                time_s: 0.0,
            };
            let (past, groups) = (maker.tools.past(false), maker.loads.groups(false));
            frame_state.prepare(past, groups, maker.states.contact.len())?;
            shared.frame_state = Some(frame_state);
        }
        shared.publish_frame_state(maker.corrected.as_deref(), &maker.states);
        Ok(())
    }

    /// Asks for all room that publishing the step being made takes: from there on nothing fails.
    pub(super) fn fit_published(&self, published: &RwLock<Published>) -> Result<()> {
        let maker = &self.maker;
        let mut shared = lock_write(published);
        let next = maker.tools.past(true);
        let counts = next.map_or((0, 0, 0), |next| {
            (next.tools.len(), next.ties.len(), next.forces.len())
        });
        shared.tools.fit(counts.0, counts.1, counts.2)?;
        let (groups, nodes) = (maker.loads.groups(true), maker.states.incoming.len());
        match &mut shared.frame_state {
            Some(frame_state) => frame_state.prepare(next, groups, nodes),
            None => Ok(()),
        }
    }

    /// The same for a state that is about to be published without a step.
    pub(super) fn fit_state(&self, published: &RwLock<Published>) -> Result<()> {
        let maker = &self.maker;
        let (past, groups) = (maker.tools.past(false), maker.loads.groups(false));
        match &mut lock_write(published).frame_state {
            Some(frame_state) => frame_state.prepare(past, groups, maker.states.contact.len()),
            None => Ok(()),
        }
    }
}

impl Published {
    /// Leaves the moment of the state that has just been published, where frames are made of it.
    pub(super) fn publish_frame_state(
        &mut self,
        corrected: Option<&Corrector>,
        states: &StepStates,
    ) {
        let (Some(frame_state), Some(corrected)) = (&mut self.frame_state, corrected) else {
            return;
        };
        frame_state
            .velocity
            .copy_from_slice(&corrected.solver.motion.velocity);
        std::mem::swap(&mut frame_state.past, &mut frame_state.next);
        std::mem::swap(&mut frame_state.groups, &mut frame_state.next_groups);
        frame_state.nodes.clear();
        frame_state.forces.clear();
        let reaction = &corrected.solver.motion.reaction;
        if frame_state.past.forces.is_empty() && reaction.len() == 3 * states.contact.len() {
            frame_state.nodes.extend_from_slice(&states.contact.nodes);
            frame_state
                .forces
                .extend(reaction.iter().map(|force| 1e-3 * force));
        }
        frame_state.step += 1;
        frame_state.time_s = states.counters.time_s;
    }
}
