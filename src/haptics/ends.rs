//! Whether the scene and the hand are still there.

use std::sync::atomic::AtomicBool;

/// What both ends see of each other.
#[derive(Debug, Default)]
pub struct Ends {
    /// The scene is there no more.
    pub scene_gone: AtomicBool,
    /// The hand is there no more.
    pub hand_gone: AtomicBool,
}
