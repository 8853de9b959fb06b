//! A step that frames start from, or the one before it.

use super::extrapolation::ToolPaths;
use crate::contact::Past;
use crate::memory::HeldBytes;
use crate::scene::supports::GroupState;

/// A step: its state and velocity `[K,3]`, where tools were and pushed, nodes in contact and their forces, the tools' paths.
#[derive(Default, HeldBytes)]
pub(super) struct KnownStep {
    /// Which step that is.
    pub(super) step: Option<u64>,
    pub(super) last: Vec<f32>,
    pub(super) velocity: Vec<f32>,
    /// Where tools were and pushed.
    pub(super) past: Past,
    /// Nodes in contact, ascending, and the forces on them `[m,3]`, mN.
    pub(super) then: Vec<u32>,
    pub(super) forces: Vec<f32>,
    /// Where the support groups were.
    pub(super) groups: Vec<GroupState>,
    /// How the tools had moved, from which a frame guesses how the tissue goes on.
    pub(super) paths: ToolPaths,
}

/// The state of the step that frames start from, `[K,3]`.
#[derive(HeldBytes)]
pub(super) struct StepState {
    /// Which step that is.
    pub step: Option<u64>,
    pub last: Vec<f32>,
    pub velocity: Vec<f32>,
}
