//! Snapshots: the state of a scene as bytes, from which it resumes to the bit.
//!
//! Little-endian: magic, version, SHA-256 of the bundle's manifest, the mesh hash, counters, both contact sets, both
//! latent states, and the fields where they are kept rather than decoded; at the end the SHA-256 of all before it.
//! Region, attached points and options are the host's and are not part of it.

mod bytes;
#[cfg(feature = "contact")]
mod tools;

use std::sync::RwLock;

use sha2::{Digest, Sha256};

use super::contact::ContactSet;
use super::core::{Core, lock_read, lock_write};
use super::counters::Counters;
use super::engine::Engine;
use super::published::Published;
use super::reduced::ReducedRecord;
use super::upt::UptRecord;
use crate::corrections::{Motion, PAIRS};
use crate::error::{Error, Result};
use crate::kernels::FlushToZero;
use crate::memory;
use bytes::{Reader, Writer};

const MAGIC: &[u8; 8] = b"UPTSNAP\0";
const VERSION: u32 = 6;
const DIGEST: usize = 32;

/// L-BFGS pairs.
type Pairs = Vec<[Vec<f32>; 2]>;

/// Latent lists of a record, in the order in which they are stored.
fn lists(engine: &mut Engine) -> Vec<&mut Vec<f32>> {
    match engine {
        Engine::Upt(engine) => [&mut engine.last, &mut engine.before]
            .into_iter()
            .flat_map(|record| {
                [
                    &mut record.keys,
                    &mut record.values,
                    &mut record.q_prior,
                    &mut record.vibration,
                ]
            })
            .collect(),
        Engine::Reduced(engine) => [&mut engine.last, &mut engine.before]
            .into_iter()
            .flat_map(|record| [&mut record.b, &mut record.vibration])
            .collect(),
    }
}

impl Core {
    /// Bytes of a snapshot at most.
    fn most_bytes(&mut self) -> usize {
        let count = self.mesh.node_count();
        let latents: usize = lists(&mut self.engine)
            .iter()
            .map(|list| 4 + 4 * list.len())
            .sum();
        let (contacts, fields) = (2 * (8 + 16 * count), 2 * (4 + 12 * count));
        let past = match &self.corrected {
            // Velocities, contact forces, pairs.
            Some(_) => (4 + 2 * PAIRS) * (4 + 12 * count),
            None => 0,
        };
        #[cfg(feature = "contact")]
        let past = past + self.most_tool_bytes();
        1024 + contacts + latents + fields + past
    }

    /// The length of a step in whole microseconds.
    fn step_us(&self) -> u32 {
        (1e6 * self.step_s()).round() as u32
    }

    /// The state as bytes.
    pub(super) fn save(&mut self, published: &RwLock<Published>) -> Result<Vec<u8>> {
        let most = self.most_bytes();
        let mut w = Writer(memory::room(most, "a snapshot")?);
        w.0.extend_from_slice(MAGIC);
        w.u32(VERSION);
        w.0.extend_from_slice(&self.model.hash);
        w.0.extend_from_slice(&Sha256::digest(self.mesh.sha256.as_bytes()));
        w.counters(&self.counters);
        w.u32(self.step_us());
        for contact in [&self.contact, &self.contact_before] {
            w.indices(&contact.nodes);
            w.floats(&contact.vectors);
        }
        for list in lists(&mut self.engine) {
            w.floats(list);
        }
        if let Engine::Reduced(engine) = &self.engine {
            for record in [&engine.last, &engine.before] {
                w.floats(&[record.prior_norm, record.bound, f32::from(record.contact)]);
            }
        }
        let keeps = self.keeps_all_nodes();
        w.u32(u32::from(keeps));
        if keeps {
            let shared = lock_read(published);
            w.floats(&shared.last.field);
            w.floats(&shared.before.field);
        }
        match &self.corrected {
            None => w.u32(0),
            Some(corrected) => {
                let stage = &corrected.stage;
                w.u32(1 + stage.pairs().count() as u32);
                w.floats(&stage.motion.velocity);
                w.floats(&stage.motion.velocity_before);
                w.floats(&stage.motion.inertia);
                let motion = &stage.motion;
                w.floats(&[motion.min_det, motion.truncated_mm, motion.error_mm]);
                // The guard may have dropped the contact that they belonged to.
                let contacts = 3 * self.contact.len();
                w.u32(contacts as u32);
                for at in 0..contacts {
                    let force = stage.motion.reaction.get(at).copied().unwrap_or(0.0);
                    w.u32(force.to_bits());
                }
                for (step, change) in stage.pairs() {
                    w.floats(step);
                    w.floats(change);
                }
            }
        }
        for was in self.counters.was_corrected {
            w.u32(u32::from(was));
        }
        #[cfg(feature = "contact")]
        self.save_tools(&mut w);
        #[cfg(not(feature = "contact"))]
        w.u32(0);
        let digest = Sha256::digest(&w.0);
        w.0.extend_from_slice(&digest);
        Ok(w.0)
    }

    /// Takes a saved state; on error nothing has changed.
    pub(super) fn restore(&mut self, published: &RwLock<Published>, bytes: &[u8]) -> Result<()> {
        // Asked first: a count that was never set is not followed to the end of the host's memory.
        if bytes.len() > self.most_bytes() {
            return Err(Error::Snapshot(format!(
                "has {} bytes, more than any of this scene",
                bytes.len()
            )));
        }
        if bytes.len() < MAGIC.len() + 4 + DIGEST || &bytes[..MAGIC.len()] != MAGIC {
            return Err(Error::Snapshot("is not a snapshot of a scene".into()));
        }
        let (body, digest) = bytes.split_at(bytes.len() - DIGEST);
        let mut r = Reader(&body[MAGIC.len()..]);
        let version = r.u32()?;
        if version != VERSION {
            return Err(Error::Version(format!(
                "snapshot: version {version}, this library reads version {VERSION}"
            )));
        }
        if Sha256::digest(body).as_slice() != digest {
            return Err(Error::Snapshot(
                "is damaged: its checksum does not match".into(),
            ));
        }
        if r.take(32)? != self.model.hash {
            return Err(Error::Snapshot("is of another model".into()));
        }
        if r.take(32)? != Sha256::digest(self.mesh.sha256.as_bytes()).as_slice() {
            return Err(Error::Snapshot("is of another mesh".into()));
        }
        let count = self.mesh.node_count();
        let mut counters = r.counters()?;
        let (step_us, own_us) = (r.u32()?, self.step_us());
        if step_us != own_us {
            return Err(Error::Snapshot(format!(
                "was saved by a scene with steps of {step_us} µs; restore it in one with that `step_s`, here {own_us} µs"
            )));
        }
        let contact = r.contact(count)?;
        let contact_before = r.contact(count)?;
        let mut latents = Vec::new();
        for list in lists(&mut self.engine) {
            latents.push(r.floats(list.len())?);
        }
        let mut scalars = Vec::new();
        if matches!(self.engine, Engine::Reduced(_)) {
            scalars = vec![r.floats(3)?, r.floats(3)?];
        }
        let mut fields = Vec::new();
        if r.u32()? != 0 {
            fields = vec![r.floats(3 * count)?, r.floats(3 * count)?];
        } else if self.keeps_all_nodes() {
            return Err(Error::Snapshot(
                "was saved by a scene that steps without step.onnx; restore it in a scene with `step_path` split".into(),
            ));
        }
        let past = r.past(3 * count, contact.len())?;
        if past.is_some() != self.corrected.is_some() {
            return Err(Error::Snapshot(
                "was saved by a scene with other `corrections`; restore it in one that corrects where that one did".into(),
            ));
        }
        counters.was_corrected = [r.u32()? != 0, r.u32()? != 0];
        #[cfg(feature = "contact")]
        let driven = self.read_tools(&mut r)?;
        #[cfg(not(feature = "contact"))]
        if r.u32()? != 0 {
            return Err(Error::Snapshot(
                "was saved by a scene with instruments; this build has no feature \"contact\""
                    .into(),
            ));
        }
        if !r.0.is_empty() {
            return Err(Error::Snapshot(format!("has {} bytes too many", r.0.len())));
        }

        // Everything is read and checked. What is computed from it may still fail: the old state is kept until then.
        let _flush = FlushToZero::enter();
        let old = self.keep(published)?;
        for (list, saved) in lists(&mut self.engine).into_iter().zip(latents) {
            *list = saved;
        }
        if let Engine::Reduced(engine) = &mut self.engine {
            for (record, saved) in [&mut engine.last, &mut engine.before]
                .into_iter()
                .zip(&scalars)
            {
                record.prior_norm = saved[0];
                record.bound = saved[1];
                record.contact = saved[2] != 0.0;
            }
        }
        self.contact = contact;
        self.contact_before = contact_before;
        self.counters = counters;
        #[cfg(feature = "contact")]
        let old_tools = self.swap_tools(driven)?;
        if let [last, before] = fields.as_slice() {
            let mut shared = lock_write(published);
            shared.last.field.copy_from_slice(last);
            shared.before.field.copy_from_slice(before);
        }
        if let Err(error) = self
            .recompute(published)
            .and_then(|()| self.restore_past(past))
        {
            self.take_back(old, published);
            #[cfg(feature = "contact")]
            self.swap_tools(old_tools)?;
            return Err(error);
        }
        let mut shared = lock_write(published);
        shared.stats = self.blank_stats();
        self.show_contacts(&mut shared);
        #[cfg(feature = "contact")]
        shared.tools.clear();
        #[cfg(feature = "contact")]
        self.leave_moment(&mut shared);
        drop(shared);
        #[cfg(feature = "haptics")]
        self.tell_hands(published);
        Ok(())
    }

    /// What a snapshot leaves out because it follows from the rest.
    fn recompute(&mut self, published: &RwLock<Published>) -> Result<()> {
        if let Engine::Reduced(engine) = &mut self.engine {
            engine.rebuild(
                self.machine.compute(),
                &self.held,
                &self.contact_before,
                &self.contact,
            )?;
        }
        let region = self.region_copy(published)?;
        let points = std::sync::Arc::clone(&self.points);
        self.set_plan(published, region, points)
    }

    /// A copy of everything that a restore overwrites.
    fn keep(&self, published: &RwLock<Published>) -> Result<Kept> {
        let fields = if self.keeps_all_nodes() {
            let shared = lock_read(published);
            let copy = |field: &[f32]| memory::copied(field, "a copy of the scene's state");
            Some([copy(&shared.last.field)?, copy(&shared.before.field)?])
        } else {
            None
        };
        Ok(Kept {
            records: match &self.engine {
                Engine::Upt(engine) => {
                    Records::Upt(Box::new([engine.last.copy()?, engine.before.copy()?]))
                }
                Engine::Reduced(engine) => {
                    Records::Reduced(Box::new([engine.last.copy()?, engine.before.copy()?]))
                }
            },
            contacts: [self.contact.copy()?, self.contact_before.copy()?],
            counters: self.counters,
            fields,
            past: match &self.corrected {
                None => None,
                Some(corrected) => {
                    let copied = |values: &[f32]| memory::copied(values, "a copy of L-BFGS pairs");
                    let pairs = corrected.stage.pairs();
                    let pairs: Result<Pairs> =
                        pairs.map(|(s, y)| Ok([copied(s)?, copied(y)?])).collect();
                    Some((corrected.stage.motion.copy()?, pairs?))
                }
            },
        })
    }

    /// Takes a kept state back.
    fn take_back(&mut self, kept: Kept, published: &RwLock<Published>) {
        match (&mut self.engine, kept.records) {
            (Engine::Upt(engine), Records::Upt(records)) => {
                [engine.last, engine.before] = *records;
            }
            (Engine::Reduced(engine), Records::Reduced(records)) => {
                [engine.last, engine.before] = *records;
            }
            _ => unreachable!("a scene's engine never changes its kind"),
        }
        // Copied, so that the room for every node of the mesh stays.
        let [contact, contact_before] = &kept.contacts;
        self.contact.copy_from(contact);
        self.contact_before.copy_from(contact_before);
        self.counters = kept.counters;
        // Fails only where a worker panics, which has been reported by then.
        let _ = self.restore_past(kept.past);
        if let Some([last, before]) = kept.fields {
            let mut shared = lock_write(published);
            shared.last.field = last;
            shared.before.field = before;
        }
    }
}

/// The last and the previous latent state.
enum Records {
    Upt(Box<[UptRecord; 2]>),
    Reduced(Box<[ReducedRecord; 2]>),
}

/// A scene's state while another one is taken.
struct Kept {
    records: Records,
    contacts: [ContactSet; 2],
    counters: Counters,
    fields: Option<[Vec<f32>; 2]>,
    past: Option<(Motion, Pairs)>,
}
