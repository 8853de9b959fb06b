//! What corrections know of the past: velocities of two states, and the contact forces of the last.

use serde::{Deserialize, Serialize};

use super::extent::Extent;
use crate::error::Result;
use crate::memory::HeldBytes;
use crate::{memory, stored};

/// What BDF2 knows of the past, `[K,3]` each.
#[derive(Debug, PartialEq, HeldBytes, Serialize, Deserialize)]
pub struct Motion {
    /// Velocity at the last state, mm/s.
    #[serde(with = "stored")]
    pub velocity: Vec<f32>,
    /// Velocity at the state before.
    #[serde(with = "stored")]
    pub velocity_before: Vec<f32>,
    /// `M (a + alpha v)` at the last state, less the loads beside contact, µN.
    #[serde(with = "stored")]
    pub inertia: Vec<f32>,
    /// These loads at the last state, relaxing tissue's among them; empty where there were none. Inertia and loads together are `M (a + alpha v)`.
    #[serde(with = "stored")]
    pub load: Vec<f32>,
    /// Smallest det F of the last corrected state.
    pub min_det: f32,
    /// How far from the tools the next step iterates.
    #[held(skip)]
    pub extent: Extent,
    /// What a step of this length leaves out in the last state, and the whole estimated error of it, before the bundle's
    /// calibration: root mean squares over the nodes, mm. The error is 0 where nothing was corrected.
    pub truncated_mm: f32,
    pub error_mm: f32,
    /// `r` at the contact nodes of the last corrected state `[m,3]`, in their order, zero at held ones, µN.
    #[serde(with = "stored")]
    pub reaction: Vec<f32>,
}

impl Motion {
    /// How far from the tools the next step iterates. What `moves_all` of the body brings all of it near: in a narrower set, what the modes near the tools do not
    /// span of it would gather from step to step, the faster the shorter the steps.
    pub(super) fn reach(&self, moves_all: bool) -> Extent {
        match moves_all {
            true => self.extent.whole(),
            false => self.extent,
        }
    }

    /// No velocity and no inertia, of a body of `len` degrees of freedom.
    pub(super) fn at_rest(len: usize) -> Result<Motion> {
        Ok(Motion {
            velocity: memory::zeros(len, "velocities")?,
            velocity_before: memory::zeros(len, "velocities")?,
            inertia: memory::zeros(len, "inertia")?,
            load: Vec::new(),
            min_det: 1.0,
            extent: Extent::default(),
            truncated_mm: 0.0,
            error_mm: 0.0,
            reaction: memory::room(len, "contact forces")?,
        })
    }

    /// Checks what was read: fields of `len` numbers, forces at `contacts` nodes.
    pub(super) fn check(&self, len: usize, contacts: usize) -> Result<()> {
        let Motion {
            velocity,
            velocity_before,
            inertia,
            load,
            min_det,
            extent,
            truncated_mm,
            error_mm,
            reaction,
        } = self;
        for field in [velocity, velocity_before, inertia] {
            stored::check(field, len)?;
        }
        // Empty where no load acted: snapshots of scenes without loads do not hold a field of zeros.
        if !load.is_empty() {
            stored::check(load, len)?;
        }
        extent.check()?;
        stored::check(&[*min_det, *truncated_mm, *error_mm], 3)?;
        stored::check(reaction, 3 * contacts)
    }

    /// A copy.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn copy(&self) -> Result<Motion> {
        let copied = |values: &[f32]| memory::copied(values, "a copy of velocities");
        Ok(Motion {
            velocity: copied(&self.velocity)?,
            velocity_before: copied(&self.velocity_before)?,
            inertia: copied(&self.inertia)?,
            load: copied(&self.load)?,
            min_det: self.min_det,
            extent: self.extent,
            truncated_mm: self.truncated_mm,
            error_mm: self.error_mm,
            reaction: copied(&self.reaction)?,
        })
    }

    /// Takes another one's values; the room stays.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`]: nothing has changed.
    pub(super) fn take(&mut self, other: &Motion) -> Result<()> {
        memory::fit(&mut self.reaction, other.reaction.len(), "contact forces")?;
        memory::fit(&mut self.load, other.load.len(), "the loads of a scene")?;
        self.velocity.copy_from_slice(&other.velocity);
        self.velocity_before.copy_from_slice(&other.velocity_before);
        self.inertia.copy_from_slice(&other.inertia);
        self.load.clear();
        self.load.extend_from_slice(&other.load);
        self.min_det = other.min_det;
        self.extent = other.extent;
        self.truncated_mm = other.truncated_mm;
        self.error_mm = other.error_mm;
        self.reaction.clear();
        self.reaction.extend_from_slice(&other.reaction);
        Ok(())
    }

    /// Back to rest; the room stays.
    pub(super) fn clear(&mut self) {
        self.velocity.fill(0.0);
        self.velocity_before.fill(0.0);
        self.inertia.fill(0.0);
        self.load.clear();
        self.min_det = 1.0;
        self.extent = Extent::default();
        self.truncated_mm = 0.0;
        self.error_mm = 0.0;
        self.reaction.clear();
    }
}
