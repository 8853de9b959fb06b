//! What corrections remember from step to step.

use serde::{Deserialize, Serialize};

use super::local::{Course, Record};
use super::motion::Motion;
use super::relaxing::Remembered;
use crate::error::{Error, Result};
use crate::stored;

/// L-BFGS pairs kept; 3 are six times worse than 8.
pub const PAIRS: usize = 8;

/// An L-BFGS pair, `[K,3]` each.
#[derive(Debug, Serialize, Deserialize)]
pub struct Pair {
    /// Change of the displacement, mm.
    #[serde(with = "stored")]
    pub step: Vec<f32>,
    /// Change of the residual, µN.
    #[serde(with = "stored")]
    pub change: Vec<f32>,
}

/// All that a [`super::ImplicitSolver`] knows of the past.
#[derive(Debug, Serialize, Deserialize)]
pub struct History {
    /// Velocities and contact forces.
    pub motion: Motion,
    /// L-BFGS pairs, oldest first.
    pub pairs: Vec<Pair>,
    /// Those of local iterations.
    pub local: Vec<Record>,
    /// What is near.
    pub course: Course,
    /// Stresses of tissue that relaxes.
    pub relaxing: Option<Remembered>,
}

impl History {
    /// Checks what was read: fields of `len` numbers, forces at `contacts` nodes.
    ///
    /// # Errors
    /// [`Error::Snapshot`].
    pub fn check(&self, len: usize, contacts: usize) -> Result<()> {
        let History {
            motion,
            pairs,
            local,
            course,
            // Against the elements of the scene: `ImplicitSolver::admit`.
            relaxing: _,
        } = self;
        motion.check(len, contacts)?;
        if pairs.len().max(local.len()) > PAIRS {
            return Err(Error::Snapshot(format!(
                "holds {} pairs of corrections, more than any scene has",
                pairs.len().max(local.len())
            )));
        }
        course.check(len / 3)?;
        for Pair { step, change } in pairs {
            stored::check(step, len)?;
            stored::check(change, len)?;
        }
        Ok(())
    }
}
