//! Decay of the field after a release, fitted to true motion.

/// Least-squares decay per frame of free motion: `sum u[t+1] . u[t] / sum |u[t]|²`.
#[derive(Debug, Clone, Copy, Default)]
pub struct DecayFit {
    product: f64,
    square: f64,
}

impl DecayFit {
    /// Adds a pair of consecutive true fields, the second of a frame without contact.
    pub fn add(&mut self, before: &[[f32; 3]], after: &[[f32; 3]]) {
        for (a, b) in before.iter().flatten().zip(after.iter().flatten()) {
            self.product += f64::from(*a) * f64::from(*b);
            self.square += f64::from(*a) * f64::from(*a);
        }
    }

    /// The fitted factor, within `[0, 1]`; `None` before any motion was added.
    pub fn decay(&self) -> Option<f32> {
        (self.square > 0.0).then(|| (self.product / self.square).clamp(0.0, 1.0) as f32)
    }
}
