//! What a step and a decode of either kind read.

use super::plan::NodePlan;
use super::points::AttachedPoints;
use crate::field::ContactSet;

/// What a step reads.
pub struct Inputs<'a> {
    /// The host's displacement `[K,3]`, where it is not the scene's own state.
    pub given: Option<&'a [f32]>,
    /// `u[t]` `[K,3]`.
    pub displacement: &'a [f32],
    /// `u[t-1]` `[K,3]`.
    pub previous: &'a [f32],
    /// `c[t+1]`.
    pub contact: &'a ContactSet,
    /// The contact nodes differ from those of the last step.
    pub contact_changed: bool,
    /// Held nodes `[K]`.
    pub held: &'a [bool],
    /// Decoded nodes.
    pub plan: &'a NodePlan,
    /// Whether the learned part runs; a step that is corrected needs the linear response alone.
    pub learned: bool,
}

/// Which state to decode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// The step being made.
    Next,
    /// The last published.
    Last,
    /// The one before.
    Before,
}

/// A state to decode.
pub struct Decode<'a> {
    /// Which state.
    pub which: Which,
    /// The nodes.
    pub plan: &'a NodePlan,
    /// The state `[K,3]` before it.
    pub displacement: &'a [f32],
    /// The attached points.
    pub points: &'a AttachedPoints,
}
