//! A state without instruments: this build has no feature "contact".

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::scene::core::Core;

/// There is none.
#[derive(Debug, Serialize, Deserialize)]
pub enum Tools {}

impl Core {
    pub(super) fn tools(&self) -> Result<Option<Tools>> {
        Ok(None)
    }

    pub(super) fn admit_tools(&self, tools: &mut Tools) -> Result<()> {
        match *tools {}
    }

    pub(super) fn put_tools(&mut self, _tools: Option<Tools>) -> Result<()> {
        Ok(())
    }

    pub(super) fn tool_bytes(&self) -> usize {
        0
    }
}
