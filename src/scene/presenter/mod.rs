//! What makes frames between steps: the tissue after the last step ([`between`]), solved once for the region and the attached points ([`solves`]),
//! and on over the arrival of the next ([`step_blend`]).

mod between;
mod contact_response;
mod extrapolation;
mod known_step;
mod led;
mod nodes;
mod solves;
mod step_blend;
#[cfg(test)]
mod tests;
mod touched;

use std::sync::Arc;

use super::points::AttachedPoints;
use super::published::lock_read;
use super::published::{Published, View};
use super::step_input::FrameInput;
use super::tissue::Tissue;
use crate::error::{Error, Result};
use crate::kernels::rows::RowPlan;
use crate::memory::{self, HeldBytes};
use crate::model::Model;
use crate::output::Output;
use between::{AT_ONCE_S, Between, ShownNodes, WHAT};
use solves::Solves;
use step_blend::StepBlend;

/// What makes a scene's frames, each part from its first use.
#[derive(Default, HeldBytes)]
pub struct Presenters {
    /// One each for the region, the attached points and the vertices of a cut surface: each has its own blend between
    /// steps, and a host may show them at different moments.
    region: Option<Box<Presenter>>,
    points: Option<Box<Presenter>>,
    surface: Option<Box<Presenter>>,
    /// The contact of a frame, for all three: views of one moment ask the same.
    solves: Solves,
}

/// What makes frames of the region, or of points at fixed weights on nodes: attached ones, the vertices of the surface.
#[derive(HeldBytes)]
struct Presenter {
    /// What it shows by the nodes around them; none: the region.
    #[held(skip)]
    attached: Option<Arc<AttachedPoints>>,
    /// The known step and the tissue after it.
    between: Between,
    /// The region and its rows.
    region: Vec<u32>,
    plan: RowPlan,
    /// In the region: what the contact moves, and what the step before would show, `[n,3]`.
    moved: Vec<f32>,
    shown: Vec<f32>,
    /// The frame at the region's nodes.
    nodal: Vec<f32>,
    /// What is left of the difference that the last step's arrival made.
    step_blend: StepBlend,
    /// Time of the last frame, after its step.
    before_s: f64,
}

impl Presenters {
    /// Makes what shows this view, unless it is there; `begin` makes steps leave moments.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a bundle without linear response or corrections, [`Error::OutOfMemory`], and what `begin` gives.
    /// A presenter costs several fields of the body and makes each step leave a moment, so only
    /// hosts that ask for frames have it.
    pub fn prepare(
        &mut self,
        scene: &Tissue<'_>,
        view: View,
        begin: impl FnOnce() -> Result<()>,
    ) -> Result<()> {
        let place = match view {
            View::Region => &mut self.region,
            View::Points => &mut self.points,
            View::Surface => &mut self.surface,
        };
        if place.is_none() {
            let made = memory::boxed(Presenter::new(scene)?, WHAT)?;
            begin()?;
            *place = Some(made);
        }
        Ok(())
    }

    /// The view at `when`, into `out`; where it is one of points, these. Nothing happens before [`Presenters::prepare`].
    ///
    /// # Errors
    /// Those of [`Scene::present`](crate::Scene::present).
    pub fn frame(
        &mut self,
        scene: &Tissue<'_>,
        (view, when): (View, f64),
        driven: FrameInput<'_>,
        (attached, out): (Option<Arc<AttachedPoints>>, Output<'_, f32>),
    ) -> Result<()> {
        let presenter = match view {
            View::Region => &mut self.region,
            View::Points => &mut self.points,
            View::Surface => &mut self.surface,
        };
        match presenter {
            Some(own) => own.frame(scene, when, driven, &mut self.solves, (attached, out)),
            None => Ok(()),
        }
    }
}

impl Presenter {
    /// Nothing is known yet: the first frame takes the step and the nodes that it shows.
    fn new(scene: &Tissue<'_>) -> Result<Presenter> {
        Ok(Presenter {
            attached: None,
            between: Between::new(scene)?,
            region: Vec::new(),
            plan: RowPlan::default(),
            moved: Vec::new(),
            shown: Vec::new(),
            nodal: Vec::new(),
            step_blend: StepBlend::default(),
            before_s: 0.0,
        })
    }

    /// Takes the nodes of the host's output of `len` floats.
    fn take_region(
        &mut self,
        model: &Model,
        shared: &Published,
        attached: Option<Arc<AttachedPoints>>,
        len: usize,
    ) -> Result<()> {
        if attached.is_none() {
            shared.check_len(View::Region, len)?;
        }
        let count = self.between.shown.free.len() / 3;
        let wanted = shared.region.as_deref();
        let same = match (&attached, wanted) {
            (Some(points), _) => self
                .attached
                .as_ref()
                .is_some_and(|own| Arc::ptr_eq(own, points)),
            (None, Some(region)) => self.region == region,
            (None, None) => self.region.len() == count && self.region.is_sorted(),
        };
        if same && !self.region.is_empty() {
            return Ok(());
        }
        let Some(prior) = &model.prior else {
            return Ok(());
        };
        let region = match (&attached, wanted) {
            (Some(points), _) => {
                let mut nodes = memory::copied(points.needed_nodes(), WHAT)?;
                nodes.sort_unstable();
                nodes.dedup();
                nodes
            }
            (None, Some(region)) => memory::copied(region, WHAT)?,
            (None, None) => memory::collected(count, 0..count as u32, WHAT)?,
        };
        // All of it is there before any of it changes.
        let plan = RowPlan::try_region(&prior.basis(), &region, true)?;
        let field = || memory::zeros(3 * region.len(), WHAT);
        let (moved, shown, nodal) = (field()?, field()?, field()?);
        self.step_blend = StepBlend::of(region.len())?;
        (self.moved, self.shown, self.nodal) = (moved, shown, nodal);
        self.plan = plan;
        self.region = region;
        self.attached = attached;
        self.between.known.step = None;
        Ok(())
    }

    /// The region or the points at `when`, into `out`.
    fn frame(
        &mut self,
        scene: &Tissue<'_>,
        when: f64,
        driven: FrameInput<'_>,
        solves: &mut Solves,
        (attached, out): (Option<Arc<AttachedPoints>>, Output<'_, f32>),
    ) -> Result<()> {
        let step_s = scene.integrator.step_s;
        let (step, tau) = {
            let shared = lock_read(scene.published);
            self.take_region(scene.model, &shared, attached, out.len())?;
            step_before(&shared, when)?
        };
        let mut nodal = std::mem::take(&mut self.nodal);
        let made = match self.between.known.step == Some(step) {
            true => {
                self.step_blend.look(tau);
                self.show(scene, tau, driven, solves, &mut nodal)
            }
            false => self.arrive(scene, (step, tau), driven, solves, &mut nodal),
        };
        let made = made.and_then(|()| {
            self.before_s = tau;
            self.shown.copy_from_slice(&nodal);
            if self.step_blend.blend(tau, step_s, &mut nodal) {
                // The way from one step to the next must not lead through a tool.
                let frame = (&*self.region, &*nodal);
                if self.between.sinks(scene, driven, solves, frame)? {
                    self.step_blend.forget(tau);
                    nodal.copy_from_slice(&self.shown);
                }
            }
            Ok(())
        });
        if made.is_ok() {
            match &self.attached {
                None => out.copy_from(&nodal),
                Some(attached) => {
                    let field = &mut self.between.shown.free;
                    for (u, &node) in nodal.as_chunks::<3>().0.iter().zip(&self.region) {
                        field[3 * node as usize..][..3].copy_from_slice(u);
                    }
                    let out = out.filled(0.0);
                    attached.add_interpolated(1.0, field, out);
                }
            }
        }
        self.nodal = nodal;
        made
    }

    /// The region's nodes `tau` after the step that is known, into `out`; nothing blended in.
    fn show(
        &mut self,
        scene: &Tissue<'_>,
        tau: f64,
        driven: FrameInput<'_>,
        solves: &mut Solves,
        out: &mut [f32],
    ) -> Result<()> {
        let view = ShownNodes {
            region: &self.region,
            plan: &self.plan,
            moved: &mut self.moved,
        };
        self.between.show(scene, tau, driven, (view, solves), out)
    }

    /// The first frame of a step.
    fn arrive(
        &mut self,
        scene: &Tissue<'_>,
        (step, tau): (u64, f64),
        driven: FrameInput<'_>,
        solves: &mut Solves,
        out: &mut [f32],
    ) -> Result<()> {
        let step_s = scene.integrator.step_s;
        let known = self.between.known.step;
        let mut since_s = 0.0;
        if let Some(known) = known {
            // What the frame would have been without the new step: it goes on from there.
            let steps = step.saturating_sub(known) as f64;
            let then = tau + steps * step_s;
            since_s = (then - self.before_s).max(0.0);
            let mut shown = std::mem::take(&mut self.shown);
            let made = self.show(scene, then, driven, solves, &mut shown);
            self.step_blend.blend(then, step_s, &mut shown);
            self.shown = shown;
            made?;
        }
        {
            let shared = lock_read(scene.published);
            if let Some(frame_state) = &shared.frame_state {
                let steps = known.map(|known| frame_state.step.saturating_sub(known));
                let later_s = steps.map(|steps| steps as f64 * step_s);
                self.between
                    .take(&shared.last.field, frame_state, later_s)?;
            }
        }
        if let Err(error) = self.show(scene, tau, driven, solves, out) {
            // The step arrives anew at the next frame.
            self.between.give_back();
            return Err(error);
        }
        let seen_s = tau - since_s;
        match known {
            Some(_) if tau > AT_ONCE_S => self.step_blend.begin(seen_s, &self.shown, out),
            _ => self.step_blend.forget(seen_s),
        }
        Ok(())
    }
}

/// The steps made, by which a new one is known, and how long the last of them is ago at `when`, s.
fn step_before(shared: &Published, when: f64) -> Result<(u64, f64)> {
    let Some(frame_state) = &shared.frame_state else {
        return Err(Error::State("present: the scene keeps no moments".into()));
    };
    let since = when - frame_state.time_s;
    if since < 0.0 {
        return Err(Error::Argument(format!(
            "when is {when}, before the last published step, whose time_s is {}",
            frame_state.time_s
        )));
    }
    Ok((frame_state.step, since))
}
