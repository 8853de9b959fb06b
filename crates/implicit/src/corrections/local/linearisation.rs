//! The state at which the near factor takes its tangent: what of it outlives a step, and snapshots.

use serde::{Deserialize, Serialize};

use super::linear::WHAT;
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use crate::stored;

/// One state: for which steps, and where the near nodes are.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize, HeldBytes)]
pub struct Linearisation {
    /// `kappa` of the steps, 1/s².
    pub kappa: f32,
    /// Displacements at the near nodes, by place, mm; none: there is no state.
    #[serde(with = "stored")]
    pub u: Vec<f32>,
}

impl Linearisation {
    /// There is none.
    pub(super) fn clear(&mut self) {
        self.kappa = 0.0;
        self.u.clear();
    }

    /// Whether it is of so many near nodes and these steps.
    pub(super) fn is_of(&self, nodes: usize, kappa: f32) -> bool {
        !self.u.is_empty() && self.u.len() == 3 * nodes && self.kappa == kappa
    }

    /// Makes room for another's values, so that taking them does not fail.
    pub(super) fn fit(&mut self, other: &Linearisation) -> Result<()> {
        memory::fit(&mut self.u, other.u.len(), WHAT)
    }

    /// Takes another's values.
    pub(super) fn take(&mut self, other: &Linearisation) {
        self.kappa = other.kappa;
        self.u.clone_from(&other.u);
    }

    /// Takes a state `[K,3]` at the near nodes.
    pub(super) fn set(&mut self, nodes: &[u32], kappa: f32, u: &[f32]) -> Result<()> {
        memory::fit(&mut self.u, 3 * nodes.len(), WHAT)?;
        self.kappa = kappa;
        self.u.clear();
        let rows = nodes.iter().map(|&node| &u[3 * node as usize..][..3]);
        self.u.extend(rows.flatten());
        Ok(())
    }

    /// Checks what was read, of a body of some nodes.
    pub fn check(&self, nodes: usize) -> Result<()> {
        let sound = self.u.len() <= 3 * nodes && self.kappa.is_finite();
        match sound {
            true => stored::check(&self.u, self.u.len()),
            false => Err(crate::Error::Snapshot(
                "holds corrections of another body".into(),
            )),
        }
    }
}
