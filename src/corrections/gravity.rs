//! What the bundle's body does under gravity, beside its natural modes.

/// By axis `[K,3]`, mm of an acceleration of 1 mm/s² (`super::gravity_columns`).
pub struct GravityResponse(pub(super) [Vec<f32>; 3]);
