//! The state of a scene: all that lasts from one step to the next.
//!
//! [`State`] says what that is. A snapshot is its bytes, a restore puts one back, a restore that fails puts back the one before.
//! What a part is, how it is written, and what of it follows from the rest is said where the part is declared.

mod records;

use std::sync::RwLock;

use serde::{Deserialize, Serialize};

use super::core::Core;
use super::counters::Counters;
use super::engine::Engine;
use super::loading;
use super::loads::Acting;
use super::maker::StepMaker;
use super::published::Published;
use super::published::{lock_read, lock_write};
use crate::contact::Past;
use crate::corrections::{History, PAIRS};
use crate::error::{Error, Result};
use crate::field::ContactSet;
use crate::{memory, stored};
use records::Records;

/// What lasts from one step to the next. Region, attached points and options are the host's and are not part of it.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    /// Numbers of steps and the times that go with them.
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
    tools: Option<Past>,
}

/// `[K,3]`, mm.
#[derive(Debug, Serialize, Deserialize)]
struct Field(#[serde(with = "stored")] Vec<f32>);

impl State {
    /// Whether instruments are part of it.
    pub(super) fn is_driven(&self) -> bool {
        self.tools.is_some()
    }

    /// A copy of the state.
    pub(super) fn of(maker: &StepMaker, published: &RwLock<Published>) -> Result<State> {
        let states = &maker.states;
        let fields = if maker.keeps_all_nodes() {
            let shared = lock_read(published);
            let copy = |field: &[f32]| memory::copied(field, "a copy of a scene's fields");
            let (last, before) = (copy(&shared.last.field)?, copy(&shared.before.field)?);
            Some([Field(last), Field(before)])
        } else {
            None
        };
        let corrected = maker.corrected.as_ref();
        Ok(State {
            counters: states.counters,
            contact: states.contact.copy()?,
            contact_before: states.contact_before.copy()?,
            records: maker.engine.records()?,
            fields,
            history: corrected
                .map(|corrected| corrected.solver.history(states.contact.len()))
                .transpose()?,
            acting: maker.loads.acting()?,
            tools: maker.tools.saved()?,
        })
    }

    /// Bytes of a saved state at most.
    pub(super) fn most_bytes(maker: &StepMaker) -> usize {
        let count = maker.body.mesh.node_count();
        // Three velocities, loads, contact forces, pairs; of local ones six fields, and numbers of chunks and modes.
        let history = maker.corrected.as_ref().map(|corrected| {
            let stresses = corrected.solver.remembered_bytes();
            (5 + 8 * PAIRS) * 12 * count + PAIRS * 16384 + stresses
        });
        let (contacts, fields) = (2 * 16 * count, 2 * 12 * count);
        let tools = maker.tools.saved_bytes(&maker.body);
        let loads = loading::saved_bytes(&maker.body);
        let rest = history.unwrap_or(0) + tools + loads + 2048;
        maker.engine.record_bytes() + contacts + fields + rest
    }

    /// Checks a state that was read, and makes room for what follows from it.
    pub(super) fn admit(&mut self, maker: &StepMaker) -> Result<()> {
        let State {
            counters,
            contact,
            contact_before,
            records,
            fields,
            history,
            acting,
            tools,
        } = self;
        let count = maker.body.mesh.node_count();
        stored::check(&[counters.max_displacement], 1)?;
        if !counters.time_s.is_finite() {
            return Err(Error::Snapshot("its time is not finite".into()));
        }
        contact.admit(count)?;
        contact_before.admit(count)?;
        maker.engine.admit(records)?;
        match (&history, &maker.corrected) {
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
        match (&fields, maker.keeps_all_nodes()) {
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
        if !maker.keeps_all_nodes() {
            // Decoded again.
            *fields = None;
        }
        if let Some(acting) = acting {
            acting.admit(&maker.body.mesh)?;
        }
        match tools {
            Some(tools) => tools.check(&*maker.body.model.samples()?, count),
            None => Ok(()),
        }
    }

    /// Takes a state that is the scene's own or was admitted; the room of its lists stays.
    pub(super) fn put(self, maker: &mut StepMaker, published: &RwLock<Published>) -> Result<()> {
        let State {
            counters,
            contact,
            contact_before,
            records,
            fields,
            history,
            acting,
            tools,
        } = self;
        maker.states.counters = counters;
        // There is room for all nodes.
        maker.states.contact.copy_from(&contact)?;
        maker.states.contact_before.copy_from(&contact_before)?;
        if let Some([Field(last), Field(before)]) = fields {
            let mut shared = lock_write(published);
            (shared.last.field, shared.before.field) = (last, before);
        }
        maker.engine.put(records)?;
        // Loads before history: the solver asks which support groups are held.
        maker.tools.put(&maker.body, tools)?;
        maker.loads.put(&maker.body, acting)?;
        match (&mut maker.corrected, history) {
            (Some(corrected), Some(history)) => {
                let time_step = &corrected.time_step;
                let context = (maker.loads).context(&maker.body, &maker.machine, time_step)?;
                context.map_or(Ok(()), |context| {
                    corrected.solver.restore(context, &history)
                })
            }
            _ => Ok(()),
        }
    }
}

impl Core {
    /// What a state leaves out because it follows from the rest.
    pub(super) fn recompute(&mut self, published: &RwLock<Published>) -> Result<()> {
        let maker = &mut self.maker;
        let states = &maker.states;
        match &mut maker.engine {
            Engine::Reduced(engine) => engine.rebuild(
                maker.machine.compute(),
                &maker.body.held,
                &states.contact_before,
                &states.contact,
            )?,
            // The plan's nodes alone, below.
            Engine::Upt(_) => {}
        }
        let region = lock_read(published).region_copy()?;
        let points = std::sync::Arc::clone(&maker.shown.points);
        self.set_plan(published, region, points)
    }

    /// Back to rest.
    pub(super) fn reset(&mut self, published: &RwLock<Published>) -> Result<()> {
        if self.maker.body.cut.is_some() {
            let next = self.with_body(None)?;
            let shown = Published::rest(&next)?;
            return self.put_back(published, next, shown);
        }
        let maker = &mut self.maker;
        maker.states.counters = Counters::REST;
        maker.states.contact.clear();
        maker.states.contact_before.clear();
        maker.loads.clear();
        maker.engine.reset();
        if let Some(corrected) = &mut maker.corrected {
            corrected.solver.reset();
        }
        maker.tools.reset();
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
        maker.watch.logged_flags = 0;
        // Of empty lists, for which there is room.
        self.fit_state(published)?;
        self.publish_state(published);
        Ok(())
    }

    /// Publishes a state that no step led to: without statistics and readings.
    pub(super) fn publish_state(&mut self, published: &RwLock<Published>) {
        let mut shared = lock_write(published);
        shared.stats = self.blank_stats();
        let maker = &self.maker;
        maker.states.show_contacts(&mut shared);
        shared.tools.clear();
        shared.publish_frame_state(maker.corrected.as_deref(), &maker.states);
        drop(shared);
        self.hands.publish(maker, published);
    }
}
