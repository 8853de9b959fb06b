//! The state of a scene: all that lasts from one step to the next.
//!
//! [`State`] says what that is. A snapshot is its bytes, a restore puts one back, a restore that fails puts back the one before.
//! What a part is, how it is written, and what of it follows from the rest is said where the part is declared.

mod records;
mod tools;

use std::sync::RwLock;

use serde::{Deserialize, Serialize};

use super::core::{Core, lock_read, lock_write};
use super::counters::Counters;
use super::engine::Engine;
use super::loads::Acting;
use super::published::Published;
use crate::corrections::{History, PAIRS};
use crate::error::{Error, Result};
use crate::field::ContactSet;
use crate::{memory, stored};
use records::Records;
use tools::Tools;

/// What lasts from one step to the next. Region, attached points and options are the host's and are not part of it.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    counters: Counters,
    /// Contact of the last step, and of the one before.
    contact: ContactSet,
    contact_before: ContactSet,
    /// Latent states.
    records: Records,
    /// The last two fields, where they are kept rather than decoded.
    fields: Option<[Field; 2]>,
    /// Of corrections.
    history: Option<History>,
    /// Loads beside contact; none where none act.
    acting: Option<Acting>,
    /// Of instruments; none where none were used.
    tools: Option<Tools>,
}

/// `[K,3]`, mm.
#[derive(Debug, Serialize, Deserialize)]
struct Field(#[serde(with = "stored")] Vec<f32>);

impl State {
    /// Whether instruments are part of it.
    pub(super) fn is_driven(&self) -> bool {
        self.tools.is_some()
    }
}

impl Core {
    /// A copy of the state.
    pub(super) fn state(&self, published: &RwLock<Published>) -> Result<State> {
        let fields = if self.keeps_all_nodes() {
            let shared = lock_read(published);
            let copy = |field: &[f32]| memory::copied(field, "a copy of a scene's fields");
            let (last, before) = (copy(&shared.last.field)?, copy(&shared.before.field)?);
            Some([Field(last), Field(before)])
        } else {
            None
        };
        let corrected = self.corrected.as_ref();
        Ok(State {
            counters: self.counters,
            contact: self.contact.copy()?,
            contact_before: self.contact_before.copy()?,
            records: self.engine.records()?,
            fields,
            history: corrected
                .map(|corrected| corrected.solver.history(self.contact.len()))
                .transpose()?,
            acting: self.acting()?,
            tools: self.tools()?,
        })
    }

    /// Bytes of a saved state at most.
    pub(super) fn most_bytes(&self) -> usize {
        let count = self.mesh.node_count();
        // Three velocities, loads, contact forces, pairs; of local ones six fields, and numbers of chunks and modes.
        let history = self.corrected.as_ref().map(|corrected| {
            let stresses = corrected.solver.remembered_bytes();
            (5 + 8 * PAIRS) * 12 * count + PAIRS * 16384 + stresses
        });
        let (contacts, fields) = (2 * 16 * count, 2 * 12 * count);
        let rest = history.unwrap_or(0) + self.tool_bytes() + self.load_bytes() + 2048;
        self.engine.record_bytes() + contacts + fields + rest
    }

    /// Checks a state that was read, and makes room for what follows from it.
    pub(super) fn admit(&self, state: &mut State) -> Result<()> {
        let State {
            counters,
            contact,
            contact_before,
            records,
            fields,
            history,
            acting,
            tools,
        } = state;
        let count = self.mesh.node_count();
        stored::check(&[counters.max_displacement], 1)?;
        if !counters.time_s.is_finite() {
            return Err(Error::Snapshot("its time is not finite".into()));
        }
        contact.admit(count)?;
        contact_before.admit(count)?;
        self.engine.admit(records)?;
        match (&history, &self.corrected) {
            (Some(history), Some(corrected)) => {
                history.check(3 * count, contact.len())?;
                corrected.solver.admit(history)?;
            }
            (None, None) => {}
            (Some(_), None) | (None, Some(_)) => {
                return Err(Error::Snapshot(
                    "was saved by a scene that corrects where this one does not, or the reverse; restore it in a scene with the same `corrections`".into(),
                ));
            }
        }
        match (&fields, self.keeps_all_nodes()) {
            (None, true) => {
                return Err(Error::Snapshot(
                    "was saved by a scene that steps without step.onnx; restore it in a scene with `step_path` split".into(),
                ));
            }
            (Some(kept), _) => {
                for Field(field) in kept {
                    stored::check(field, 3 * count)?;
                }
            }
            (None, false) => {}
        }
        if !self.keeps_all_nodes() {
            // Decoded again.
            *fields = None;
        }
        if let Some(acting) = acting {
            acting.admit(&self.mesh)?;
        }
        match tools {
            Some(tools) => self.admit_tools(tools),
            None => Ok(()),
        }
    }

    /// Takes a state that is the scene's own or was admitted; the room of its lists stays.
    pub(super) fn put(&mut self, published: &RwLock<Published>, state: State) -> Result<()> {
        let State {
            counters,
            contact,
            contact_before,
            records,
            fields,
            history,
            acting,
            tools,
        } = state;
        self.counters = counters;
        // There is room for all nodes.
        self.contact.copy_from(&contact)?;
        self.contact_before.copy_from(&contact_before)?;
        if let Some([Field(last), Field(before)]) = fields {
            let mut shared = lock_write(published);
            (shared.last.field, shared.before.field) = (last, before);
        }
        self.engine.put(records)?;
        self.put_tools(tools)?;
        self.put_acting(acting)?;
        self.put_history(history)
    }

    /// What a state leaves out because it follows from the rest.
    pub(super) fn recompute(&mut self, published: &RwLock<Published>) -> Result<()> {
        match &mut self.engine {
            Engine::Reduced(engine) => engine.rebuild(
                self.machine.compute(),
                &self.held,
                &self.contact_before,
                &self.contact,
            )?,
            // The plan's nodes alone, below.
            Engine::Upt(_) => {}
        }
        let region = self.region_copy(published)?;
        let points = std::sync::Arc::clone(&self.points);
        self.set_plan(published, region, points)
    }

    /// Back to rest.
    pub(super) fn reset(&mut self, published: &RwLock<Published>) -> Result<()> {
        if self.cut.is_some() {
            let next = self.with_body(None)?;
            let shown = next.blank_published()?;
            return self.put_back(published, next, shown);
        }
        self.counters = Counters::REST;
        self.contact.clear();
        self.contact_before.clear();
        self.clear_loads();
        self.engine.reset();
        if let Some(corrected) = &mut self.corrected {
            corrected.solver.reset();
        }
        if let Some(problem) = &mut self.problem {
            problem.reset();
        }
        {
            let mut shared = lock_write(published);
            let shared = &mut *shared;
            for frame in [&mut shared.last, &mut shared.before]
                .into_iter()
                .chain(shared.earlier.as_mut())
            {
                frame.field.fill(0.0);
                frame.points.fill(0.0);
            }
        }
        self.logged_flags = 0;
        // Of empty lists, for which there is room.
        self.fit_state(published)?;
        self.publish_state(published);
        Ok(())
    }

    /// Publishes a state that no step led to: without statistics and readings.
    pub(super) fn publish_state(&mut self, published: &RwLock<Published>) {
        let mut shared = lock_write(published);
        shared.stats = self.blank_stats();
        self.show_contacts(&mut shared);
        shared.tools.clear();
        self.publish_frame_state(&mut shared);
        drop(shared);
        self.publish_to_hands(published);
    }
}
