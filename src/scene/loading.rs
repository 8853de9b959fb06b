//! A scene takes the loads of its steps, and gives and takes those of saved states.
//!
//! A scene that never has loads keeps nothing of them: the state is made at the first step that has
//! any, and lives as long as the scene, since tissue that has been loaded springs back for a while
//! after. What the answer to gravity or to a moved group costs is made once for a model, at the
//! first scene's first such step, and shared.

use topology::Push;

use super::body::{SceneBody, at_rest};
use super::load_limits::WHAT;
use super::load_state::LoadState;
use super::loads::{Acting, Loads};
use super::supports::{self, GroupState};
use std::sync::Arc;

use crate::corrections::{Corrections, Held, Load, SolverContext, TimeStep, let_go};
use crate::error::{Error, Result};
use crate::kernels::Machine;
use crate::memory::{self, HeldBytes};

/// The loads of a scene beside contact: gravity, forces, pressure, supports.
#[derive(Default, HeldBytes)]
pub struct SceneLoads {
    /// From the first step that has loads.
    state: Option<Box<LoadState>>,
    /// Whether loads act in the step being made, or did and the body has not come back from where they took it.
    pub(super) loaded: bool,
}

impl SceneLoads {
    /// Takes the loads of a step of a body that is displaced by `u` `[K,3]`, mm, at its start and moves at `v`, mm/s; `v` is none in a scene that
    /// makes no corrections. Says whether the step has any, at its start or its end.
    ///
    /// # Errors
    /// [`Error::Unsupported`] in a scene that does not correct, [`Error::Argument`] and [`Error::NonFinite`] for the loads: what was published stays.
    pub(super) fn take(
        &mut self,
        body: &SceneBody,
        machine: &Machine,
        loads: &Loads<'_>,
        (u, v): (&[f32], Option<&[f32]>),
    ) -> Result<bool> {
        let intact = body.intact_mesh();
        loads.check(intact.node_count())?;
        let loads = &loads.scanned_under(body.model.manifest.gravity_at_rest_m_s2);
        supports::check(loads.supports, &intact.supports)?;
        if self.state.is_none() && !loads.acts() {
            return Ok(false);
        }
        // Asked before anything is made: a refused step leaves no state behind.
        let Some(v) = v else {
            return Err(Error::Unsupported(
                "loads: the scene makes no corrections, in which gravity, forces and pressure act; set `corrections`".into(),
            ));
        };
        prepare(body)?;
        let state = match &mut self.state {
            Some(state) => state,
            none => none.insert(blank(body)?),
        };
        let mass = &body.model.corrections()?.body.mass;
        let cut = body.cut.as_ref().map(|cut| &cut.body);
        state.take(loads, &body.mesh, mass, (u, v, body.step_s()), cut)?;
        let acts = state.acts();
        // On a cut body the answer to gravity is the intact body's, made there once and followed by the copies of nodes.
        if state.turns() {
            follow_turning(body, machine)?;
        }
        if !state.next.supports.is_empty() {
            follow_groups(body, machine)?;
        }
        self.prepare_let_go(body, machine)?;
        Ok(acts)
    }

    /// What the groups do that are let go, where another set of them was in the step before.
    ///
    /// Made again only when the set changes: it takes a solver of its own and products with the
    /// whole body.
    fn prepare_let_go(&mut self, body: &SceneBody, machine: &Machine) -> Result<()> {
        let state = self.state.as_mut();
        let held = state.and_then(|loads| loads.held.as_deref_mut());
        match (held, at_rest(&body.model, machine)?) {
            (Some(held), Some(context)) if held.let_go != 0 && !held.modes.is_made() => {
                let_go(context, &body.mesh.positions, held)
            }
            _ => Ok(()),
        }
    }

    /// What solves on a body under them; none for a bundle without a linear response.
    ///
    /// # Errors
    /// Of a bundle that cannot correct.
    pub(super) fn context<'a>(
        &'a self,
        body: &'a SceneBody,
        machine: &'a Machine,
        time_step: &'a Arc<TimeStep>,
    ) -> Result<Option<SolverContext<'a>>> {
        let Some(prior) = &body.model.prior else {
            return Ok(None);
        };
        let corrections = body.model.corrections()?;
        Ok(Some(SolverContext {
            isa: machine.isa,
            pool: &machine.pool,
            prior,
            corrections,
            time_step,
            held: self.held(corrections),
        }))
    }

    /// What holds the body in the step being made.
    pub(super) fn held<'a>(&'a self, corrections: &'a Corrections) -> &'a Held {
        let own = self.state.as_ref().and_then(|loads| loads.held.as_deref());
        own.unwrap_or(&corrections.body.held)
    }

    /// Whether support groups are led or let go in the step being made.
    pub(super) fn leads(&self) -> bool {
        self.state
            .as_ref()
            .is_some_and(|loads| loads.held.is_some())
    }

    /// Support groups that are let go in the step that was made last, a bit each.
    pub(super) fn let_go(&self) -> u64 {
        self.state.as_ref().map_or(0, |loads| loads.let_go())
    }

    /// What the step being made has of them; none where none act.
    pub(super) fn load(&self) -> Option<Load<'_>> {
        self.state.as_ref().and_then(|loads| loads.load())
    }

    /// The support groups of the last published state, or of the one being made.
    pub(super) fn groups(&self, next: bool) -> &[GroupState] {
        match (&self.state, next) {
            (None, _) => &[],
            (Some(loads), true) => &loads.next.supports,
            (Some(loads), false) => &loads.last.supports,
        }
    }

    /// Takes what acted on the body before it was changed; `source` is the node that each of its nodes was.
    pub(super) fn follow(
        &mut self,
        (before, then): (&SceneLoads, &SceneBody),
        body: &SceneBody,
        source: impl Fn(usize) -> usize,
    ) -> Result<()> {
        let Some(old) = &before.state else {
            return Ok(());
        };
        let mut state = blank(body)?;
        let [was, is] = [then, body].map(|body| body.model.corrections());
        state.follow(&old.last, [&was?.body.mass, &is?.body.mass], &source)?;
        let meshes = (&*then.mesh, &*body.mesh);
        state.last.supports = supports::cut(&old.last.supports, meshes, source)?;
        state.held = supports::restored(&body.mesh, &state.last.supports)?;
        self.state = Some(state);
        Ok(())
    }

    /// The next step ends with what a blade has done to the tissue.
    pub(super) fn push(&mut self, body: &SceneBody, pushes: &[Push]) -> Result<()> {
        if pushes.is_empty() {
            return Ok(());
        }
        let state = match &mut self.state {
            Some(state) => state,
            none => none.insert(blank(body)?),
        };
        state.push(pushes)
    }

    /// The loads of the step being made become those of the last.
    pub(super) fn commit(&mut self) {
        if let Some(loads) = &mut self.state {
            loads.commit();
        }
    }

    /// No load acts, and none did.
    pub(super) fn clear(&mut self) {
        if let Some(state) = &mut self.state {
            state.last.clear();
            state.next.clear();
            state.held = None;
        }
    }

    /// A copy of what acts in the last published state, where anything does.
    pub(super) fn acting(&self) -> Result<Option<Acting>> {
        match &self.state {
            Some(state) => state.last.copy(),
            None => Ok(None),
        }
    }

    /// Takes what acts in a state that was saved or admitted.
    pub(super) fn put(&mut self, body: &SceneBody, acting: Option<Acting>) -> Result<()> {
        self.clear();
        let Some(acting) = acting else {
            return Ok(());
        };
        prepare(body)?;
        let state = match &mut self.state {
            Some(state) => state,
            none => none.insert(blank(body)?),
        };
        state.held = supports::restored(&body.mesh, &acting.supports)?;
        state.last = acting;
        Ok(())
    }
}

/// Bytes of saved loads at most.
pub(super) fn saved_bytes(body: &SceneBody) -> usize {
    4 * (2 * body.mesh.positions.len() + body.mesh.surface.faces.len()) + 128
}

/// No loads, of the body as it is.
fn blank(body: &SceneBody) -> Result<Box<LoadState>> {
    let cut = body.cut.as_ref().map(|cut| &cut.body);
    let domain = &body.intact_mesh().domain.faces;
    memory::boxed(LoadState::new(&body.mesh, cut, domain)?, WHAT)
}

/// Makes what steps under loads need: read by the intact body's model, and followed by that of a cut one.
fn prepare(body: &SceneBody) -> Result<()> {
    body.intact().prepare_loads()?;
    match &body.cut {
        Some(cut) => cut.intact.cut_loads(&cut.body, &body.model),
        None => Ok(()),
    }
}

/// What a step in which gravity turns needs of a cut body: the intact one's answer to it.
fn follow_turning(body: &SceneBody, machine: &Machine) -> Result<()> {
    let Some((cut, context)) = body.intact_context(machine)? else {
        return Ok(());
    };
    (body.model.corrections()?).follow_gravity(context, cut.body.parents())
}

/// What a step with support groups needs of a cut body, likewise.
fn follow_groups(body: &SceneBody, machine: &Machine) -> Result<()> {
    let Some((cut, context)) = body.intact_context(machine)? else {
        return Ok(());
    };
    let (rest, parents) = (&cut.intact.mesh.positions, cut.body.parents());
    (body.model.corrections()?).follow_groups(context, rest, parents)
}
