//! A build without instruments: every step is free or has a collision field.

use std::sync::RwLock;
use std::time::Instant;

use super::StepInput;
use super::core::Core;
use super::published::Published;
use crate::error::Result;
use crate::stats::SceneStats;

impl Core {
    /// No tool is near.
    pub(super) fn meet_tools(&mut self, _: &RwLock<Published>, _: &StepInput<'_>) -> Result<bool> {
        Ok(false)
    }

    /// Nothing drives.
    pub(super) fn drive(
        &mut self,
        _: &RwLock<Published>,
        _: bool,
        _: Instant,
        _: &mut SceneStats,
    ) -> Result<bool> {
        self.next_corrected = false;
        Ok(false)
    }

    /// Nothing is held.
    pub(super) fn problem_bytes(&self) -> usize {
        0
    }
}
