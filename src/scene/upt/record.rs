//! What a `upt` scene keeps of a step.

/// The latent state after one step.
#[derive(Debug, Clone)]
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
