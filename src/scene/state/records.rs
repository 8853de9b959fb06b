//! The latent states of each kind: those of the last two steps.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::scene::engine::Engine;
use crate::scene::reduced::ReducedRecord;
use crate::scene::upt::UptRecord;

const WHAT: &str = "a copy of a scene's state";

/// The last latent state and the one before.
#[derive(Debug, Serialize, Deserialize)]
pub enum Records {
    Upt(Box<[UptRecord; 2]>),
    Reduced(Box<[ReducedRecord; 2]>),
}

/// Latent states of a network are none of a reduced model, and the reverse.
fn other_kind() -> Error {
    Error::Snapshot("belongs to a model of another kind".into())
}

impl Engine {
    /// A copy of its records.
    pub(super) fn records(&self) -> Result<Records> {
        Ok(match self {
            Engine::Upt(engine) => {
                let records = [engine.last.copy()?, engine.before.copy()?];
                Records::Upt(memory::boxed(records, WHAT)?)
            }
            Engine::Reduced(engine) => {
                let records = [engine.last.copy()?, engine.before.copy()?];
                Records::Reduced(memory::boxed(records, WHAT)?)
            }
        })
    }

    /// Checks records that were read, and makes room for what follows from them.
    pub(super) fn admit(&self, records: &mut Records) -> Result<()> {
        match self {
            Engine::Upt(engine) => {
                let Records::Upt(records) = records else {
                    return Err(other_kind());
                };
                records.iter_mut().try_for_each(|r| r.admit(&engine.last))
            }
            Engine::Reduced(engine) => {
                let Records::Reduced(records) = records else {
                    return Err(other_kind());
                };
                records.iter_mut().try_for_each(|r| r.admit(&engine.last))
            }
        }
    }

    /// Takes records that are its own or were admitted.
    pub(super) fn put(&mut self, records: Records) -> Result<()> {
        match self {
            Engine::Upt(engine) => {
                let Records::Upt(records) = records else {
                    return Err(other_kind());
                };
                [engine.last, engine.before] = *records;
            }
            Engine::Reduced(engine) => {
                let Records::Reduced(records) = records else {
                    return Err(other_kind());
                };
                [engine.last, engine.before] = *records;
            }
        }
        Ok(())
    }

    /// Bytes of its records at most.
    pub(super) fn record_bytes(&self) -> usize {
        2 * match self {
            Engine::Upt(engine) => engine.last.held_bytes(),
            Engine::Reduced(engine) => engine.last.held_bytes(),
        }
    }
}
