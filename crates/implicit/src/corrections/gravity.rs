//! What the bundle's body does under gravity, beside its natural modes.

use std::sync::Arc;

/// By axis `[K,3]`, mm of an acceleration of 1 mm/s² (`super::gravity_columns`).
pub struct GravityResponse {
    pub(super) columns: Arc<[Vec<f32>; 3]>,
    /// Of each copy of a node of a cut body: the node that it stems from, whose answer it has.
    pub(super) parents: Vec<u32>,
}
