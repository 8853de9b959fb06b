//! A scene takes the loads of its steps, and gives and takes those of saved states.

use std::sync::RwLock;

use super::core::{Core, lock_read};
use super::loads::{Acting, LoadState, Loads, WHAT};
use super::published::Published;
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
        loads.check(&self.mesh)?;
        if self.loads.is_none() && !loads.acts() {
            return Ok(false);
        }
        let step_s = self.step_s();
        let Some(corrected) = &self.corrected else {
            return Err(Error::Unsupported(
                "loads: the scene makes no corrections, in which gravity, forces and pressure act; set `corrections`".into(),
            ));
        };
        self.model.prepare_loads()?;
        let mass = &self.model.corrections()?.body.mass;
        let state = match &mut self.loads {
            Some(state) => state,
            slot => slot.insert(memory::boxed(LoadState::new(&self.mesh)?, WHAT)?),
        };
        let shared = lock_read(published);
        let (u, v) = (&shared.last.field, &corrected.solver.motion.velocity);
        state.take(loads, &self.mesh, mass, (u, v, step_s))?;
        Ok(state.acts())
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
        self.model.prepare_loads()?;
        let state = match &mut self.loads {
            Some(state) => state,
            slot => slot.insert(memory::boxed(LoadState::new(&self.mesh)?, WHAT)?),
        };
        state.last = acting;
        Ok(())
    }

    /// Bytes of saved loads at most.
    pub(super) fn load_bytes(&self) -> usize {
        4 * (self.mesh.positions.len() + self.mesh.surface_faces.len()) + 64
    }
}
