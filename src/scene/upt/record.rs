//! What a `upt` scene keeps of a step.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::memory::HeldBytes;
use crate::{memory, stored};

/// The latent state after one step.
#[derive(Debug, HeldBytes, Serialize, Deserialize)]
pub struct UptRecord {
    /// Decoder keys `[L,h]`.
    #[serde(with = "stored")]
    pub keys: Vec<f32>,
    /// Decoder values `[L,h]`.
    #[serde(with = "stored")]
    pub values: Vec<f32>,
    /// Linear response, or its free vibration without contact, in block coordinates; empty where the bundle does not use it.
    #[serde(with = "stored")]
    pub q_prior: Vec<f32>,
    /// The same at the plan's nodes `[K,3]`; empty where the bundle does not use it. Follows from the rest.
    #[serde(skip)]
    pub prior_field: Vec<f32>,
    /// Amplitudes `[m]` of the free modes, mm, and their velocities times the step `[m]`; empty where there are none.
    #[serde(with = "stored")]
    pub vibration: Vec<f32>,
}

impl UptRecord {
    /// A copy.
    pub fn copy(&self) -> Result<UptRecord> {
        let copy = |values: &[f32]| memory::copied(values, "a scene's latent states");
        Ok(UptRecord {
            keys: copy(&self.keys)?,
            values: copy(&self.values)?,
            q_prior: copy(&self.q_prior)?,
            prior_field: copy(&self.prior_field)?,
            vibration: copy(&self.vibration)?,
        })
    }

    /// Checks what was read against a record of the scene, and makes room for what follows from it.
    ///
    /// # Errors
    /// [`crate::Error::Snapshot`], [`crate::Error::OutOfMemory`].
    pub fn admit(&mut self, own: &UptRecord) -> Result<()> {
        let UptRecord {
            keys,
            values,
            q_prior,
            prior_field,
            vibration,
        } = own;
        stored::check(&self.keys, keys.len())?;
        stored::check(&self.values, values.len())?;
        stored::check(&self.q_prior, q_prior.len())?;
        stored::check(&self.vibration, vibration.len())?;
        self.prior_field = memory::copied(prior_field, "a scene's latent states")?;
        Ok(())
    }

    /// Rest.
    pub fn clear(&mut self) {
        for values in [
            &mut self.keys,
            &mut self.values,
            &mut self.q_prior,
            &mut self.prior_field,
            &mut self.vibration,
        ] {
            values.fill(0.0);
        }
    }
}
