//! What a `upt` scene keeps of a step.

use crate::error::Result;
use crate::memory;

/// The latent state after one step.
#[derive(Debug)]
pub struct UptRecord {
    /// Decoder keys `[L,h]`.
    pub keys: Vec<f32>,
    /// Decoder values `[L,h]`.
    pub values: Vec<f32>,
    /// Linear response, or its free vibration without contact, in block coordinates; empty where the bundle does not use it.
    pub q_prior: Vec<f32>,
    /// The same at the plan's nodes `[K,3]`; empty where the bundle does not use it.
    pub prior_field: Vec<f32>,
    /// Amplitudes `[m]` of the free modes, mm, and their velocities times the step `[m]`; empty where there are none.
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

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.keys.len()
            + self.values.len()
            + self.q_prior.len()
            + self.prior_field.len()
            + self.vibration.len())
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
