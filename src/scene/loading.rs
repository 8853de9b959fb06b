//! A scene takes the loads of its steps, and gives and takes those of saved states.

use std::sync::RwLock;

use topology::Push;

use super::core::{Core, lock_read};
use super::cut_state::CutState;
use super::load_state::LoadState;
use super::loads::{Acting, Loads, WHAT};
use super::published::Published;
use super::supports::{self, GroupState};
use crate::corrections::{Corrections, Held, ImplicitSolver, SolverContext};
use crate::error::{Error, Result};
use crate::memory;

impl Core {
    /// Takes the loads of a step; says whether it has any, at its start or its end.
    ///
    /// # Errors
    /// [`Error::Unsupported`] in a scene that does not correct, [`Error::Argument`] and [`Error::NonFinite`] for the loads: what was published stays.
    pub(super) fn take_loads(
        &mut self,
        published: &RwLock<Published>,
        loads: &Loads<'_>,
    ) -> Result<bool> {
        loads.check(self.intact_mesh().node_count())?;
        let loads = &loads.scanned_under(self.model.manifest.gravity_at_rest_m_s2);
        supports::check(loads.supports, &self.intact_mesh().supports)?;
        if self.loads.is_none() && !loads.acts() {
            return Ok(false);
        }
        let step_s = self.step_s();
        let Some(corrected) = &self.corrected else {
            return Err(Error::Unsupported(
                "loads: the scene makes no corrections, in which gravity, forces and pressure act; set `corrections`".into(),
            ));
        };
        self.prepare_loads()?;
        if self.loads.is_none() {
            self.loads = Some(self.blank_loads()?);
        }
        let Some(state) = &mut self.loads else {
            return Ok(false);
        };
        let mass = &self.model.corrections()?.body.mass;
        let shared = lock_read(published);
        let (u, v) = (&shared.last.field, &corrected.solver.motion.velocity);
        state.take(loads, &self.mesh, mass, (u, v, step_s))?;
        let (acts, turns) = (state.acts(), state.turns());
        drop(shared);
        if turns {
            self.prepare_turning()?;
        }
        self.prepare_groups()?;
        self.prepare_let_go()?;
        Ok(acts)
    }

    /// What the groups do that are let go, where another set of them was in the step before.
    fn prepare_let_go(&mut self) -> Result<()> {
        let held = self
            .loads
            .as_mut()
            .and_then(|loads| loads.held.as_deref_mut());
        let (Some(held), Some(prior)) = (held, &self.model.prior) else {
            return Ok(());
        };
        if held.let_go == 0 || held.modes.is_made() {
            return Ok(());
        }
        let corrections = self.model.corrections()?;
        let context = SolverContext {
            isa: self.machine.isa,
            pool: &self.machine.pool,
            prior,
            corrections,
            time_step: &corrections.time_step,
            held: &corrections.body.held,
        };
        ImplicitSolver::let_go(context, &self.mesh.positions, held)
    }

    /// What holds the body in the step being made.
    pub(super) fn held_of<'a>(
        loads: &'a Option<Box<LoadState>>,
        corrections: &'a Corrections,
    ) -> &'a Held {
        let own = loads.as_ref().and_then(|loads| loads.held.as_deref());
        own.unwrap_or(&corrections.body.held)
    }

    /// The support groups of the last published state, or of the one being made.
    pub(super) fn groups(&self, next: bool) -> &[GroupState] {
        let Some(loads) = self.loads.as_deref() else {
            return &[];
        };
        match next {
            true => &loads.next.supports,
            false => &loads.last.supports,
        }
    }

    /// No loads, of the body as it is.
    fn blank_loads(&self) -> Result<Box<LoadState>> {
        let body = self.cut.as_ref().map(|cut| &cut.body);
        let domain = &self.intact_mesh().domain_faces;
        memory::boxed(LoadState::new(&self.mesh, body, domain)?, WHAT)
    }

    /// Makes what steps under loads need: read by the intact body's model, and followed by that of a cut one.
    fn prepare_loads(&self) -> Result<()> {
        self.intact().prepare_loads()?;
        match &self.cut {
            Some(cut) => cut.intact.cut_loads(&cut.body, &self.model),
            None => Ok(()),
        }
    }

    /// What a step in which gravity turns needs of a cut body: the intact one's answer to it.
    fn prepare_turning(&self) -> Result<()> {
        let Some((cut, context)) = self.intact_context()? else {
            return Ok(());
        };
        (self.model.corrections()?).follow_gravity(context, cut.body.parents())
    }

    /// What a step with support groups needs of a cut body, likewise.
    fn prepare_groups(&self) -> Result<()> {
        if self.groups(true).is_empty() {
            return Ok(());
        }
        let Some((cut, context)) = self.intact_context()? else {
            return Ok(());
        };
        let (rest, parents) = (&cut.intact.mesh.positions, cut.body.parents());
        (self.model.corrections()?).follow_groups(context, rest, parents)
    }

    /// What solves on the intact body, where this one has been cut.
    fn intact_context(&self) -> Result<Option<(&CutState, SolverContext<'_>)>> {
        let Some(cut) = &self.cut else {
            return Ok(None);
        };
        let (Some(prior), corrections) = (&cut.intact.prior, cut.intact.corrections()?) else {
            return Ok(None);
        };
        let context = SolverContext {
            isa: self.machine.isa,
            pool: &self.machine.pool,
            prior,
            corrections,
            time_step: &corrections.time_step,
            held: &corrections.body.held,
        };
        Ok(Some((cut, context)))
    }

    /// Takes what acts on the body before it was changed; `source` is the node that each of its nodes was.
    pub(super) fn follow_loads(
        &mut self,
        before: &Core,
        source: impl Fn(usize) -> usize,
    ) -> Result<()> {
        let Some(old) = &before.loads else {
            return Ok(());
        };
        let mut state = self.blank_loads()?;
        let mass = [&before.model, &self.model].map(|model| model.corrections());
        let [then, now] = mass;
        state.follow(&old.last, [&then?.body.mass, &now?.body.mass], &source)?;
        let meshes = (&*before.mesh, &*self.mesh);
        state.last.supports = supports::cut(&old.last.supports, meshes, source)?;
        state.held = supports::restored(&self.mesh, &state.last.supports)?;
        self.loads = Some(state);
        Ok(())
    }

    /// The next step ends with what a blade has done to the tissue.
    pub(super) fn take_pushes(&mut self, pushes: &[Push]) -> Result<()> {
        if pushes.is_empty() {
            return Ok(());
        }
        let mut state = match self.loads.take() {
            Some(state) => state,
            None => self.blank_loads()?,
        };
        state.push(pushes)?;
        self.loads = Some(state);
        Ok(())
    }

    /// The loads of the step being made become those of the last.
    pub(super) fn commit_loads(&mut self) {
        if let Some(loads) = &mut self.loads {
            loads.commit();
        }
    }

    /// No load acts, and none did.
    pub(super) fn clear_loads(&mut self) {
        if let Some(state) = &mut self.loads {
            state.last.clear();
            state.next.clear();
            state.held = None;
        }
    }

    /// A copy of what acts in the last published state, where anything does.
    pub(super) fn acting(&self) -> Result<Option<Acting>> {
        match &self.loads {
            Some(state) => state.last.copy(),
            None => Ok(None),
        }
    }

    /// Takes what acts in a state that was saved or admitted.
    pub(super) fn put_acting(&mut self, acting: Option<Acting>) -> Result<()> {
        self.clear_loads();
        let Some(acting) = acting else {
            return Ok(());
        };
        self.prepare_loads()?;
        let mut state = match self.loads.take() {
            Some(state) => state,
            None => self.blank_loads()?,
        };
        state.held = supports::restored(&self.mesh, &acting.supports)?;
        state.last = acting;
        self.loads = Some(state);
        Ok(())
    }

    /// Bytes of saved loads at most.
    pub(super) fn load_bytes(&self) -> usize {
        4 * (2 * self.mesh.positions.len() + self.mesh.surface_faces.len()) + 128
    }
}
