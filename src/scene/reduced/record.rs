//! The latent state of kind `reduced`.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::memory::HeldBytes;
use crate::model::ReducedModel;
use crate::prior::PriorTable;
use crate::{memory, stored};

pub(super) const STATE: &str = "a scene's reduced states";

/// The reduced state after one step.
#[derive(Debug, HeldBytes, Serialize, Deserialize)]
pub struct ReducedRecord {
    /// Residual state `[r]`, mm.
    #[serde(with = "stored")]
    pub b: Vec<f32>,
    /// Linear response in its leading modes `[r_z]`; this and the next three follow from the rest ([`super::ReducedEngine::rebuild`]).
    #[serde(skip)]
    pub z: Vec<f32>,
    /// Linear response in the residual modes `[r]`, mm.
    #[serde(skip)]
    pub p: Vec<f32>,
    /// Linear response in block coordinates `[Q]`.
    #[serde(skip)]
    pub q_prior: Vec<f32>,
    /// The whole field in block coordinates `[Q]`.
    #[serde(skip)]
    pub q: Vec<f32>,
    /// State of the free vibration, mm; empty with a learned map.
    #[serde(with = "stored")]
    pub vibration: Vec<f32>,
    /// `|L|` over all nodes, mm.
    pub prior_norm: f32,
    /// Bound of `|b|`, mm.
    pub bound: f32,
    /// In contact.
    pub contact: bool,
}

impl ReducedRecord {
    pub(super) fn new(model: &ReducedModel, table: &PriorTable) -> Result<ReducedRecord> {
        let entry = model.learned.as_ref().map(|map| &map.entry);
        let (modes, response_modes) = entry.map_or((0, 0), |e| (e.modes, e.response_modes));
        let swinging = table.vibration.as_ref().map_or(0, |v| v.state_len());
        Ok(ReducedRecord {
            b: memory::zeros(modes, STATE)?,
            z: memory::zeros(response_modes, STATE)?,
            p: memory::zeros(modes, STATE)?,
            vibration: memory::zeros(swinging, STATE)?,
            q_prior: memory::zeros(table.width(), STATE)?,
            q: memory::zeros(table.width(), STATE)?,
            prior_norm: 0.0,
            bound: 0.0,
            contact: false,
        })
    }

    /// A copy.
    pub fn copy(&self) -> Result<ReducedRecord> {
        Ok(ReducedRecord {
            b: memory::copied(&self.b, STATE)?,
            z: memory::copied(&self.z, STATE)?,
            p: memory::copied(&self.p, STATE)?,
            q_prior: memory::copied(&self.q_prior, STATE)?,
            q: memory::copied(&self.q, STATE)?,
            vibration: memory::copied(&self.vibration, STATE)?,
            ..*self
        })
    }

    /// Checks what was read against a record of the scene, and makes room for what follows from it.
    pub fn admit(&mut self, own: &ReducedRecord) -> Result<()> {
        let ReducedRecord {
            b,
            z,
            p,
            q_prior,
            q,
            vibration,
            prior_norm: _,
            bound: _,
            contact: _,
        } = own;
        stored::check(&self.b, b.len())?;
        stored::check(&self.vibration, vibration.len())?;
        stored::check(&[self.prior_norm, self.bound], 2)?;
        self.z = memory::copied(z, STATE)?;
        self.p = memory::copied(p, STATE)?;
        self.q_prior = memory::copied(q_prior, STATE)?;
        self.q = memory::copied(q, STATE)?;
        Ok(())
    }

    /// Rest: no amplitudes.
    pub(super) fn clear(&mut self) {
        for values in [
            &mut self.b,
            &mut self.z,
            &mut self.p,
            &mut self.q_prior,
            &mut self.q,
            &mut self.vibration,
        ] {
            values.fill(0.0);
        }
        self.prior_norm = 0.0;
        self.bound = 0.0;
        self.contact = false;
    }
}
