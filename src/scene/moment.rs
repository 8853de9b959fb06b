//! What a published step leaves for frames after it.

use crate::contact::Past;

/// Velocities, tools and forces of a published step.
#[derive(Debug, Default)]
pub struct Moment {
    /// `[K,3]`, mm/s.
    pub velocity: Vec<f32>,
    /// Where the tools were, and their forces.
    pub past: Past,
    /// Nodes in contact, ascending, and the forces on them, mN `[m,3]`; none where tools push.
    pub nodes: Vec<u32>,
    pub forces: Vec<f32>,
    /// Steps made, by which a new one is known.
    pub step: u64,
}
