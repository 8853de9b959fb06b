//! What the forces of a frame's contact move: `A_k(tau) B^T (f - f_n)` in the coordinates of the linear response.

use crate::contact::problem::Change;
use crate::error::Result;
use crate::kernels::respond::accumulate_rows;
use crate::kernels::{Isa, Pool};
use crate::memory::{self, HeldBytes};
use crate::prior::{CoarseSpace, PriorTable};

const WHAT: &str = "the modes of a frame";

/// What the forces of a contact move, in the coordinates of the linear response.
pub(super) struct ContactResponse<'a> {
    pub isa: Isa,
    pub pool: &'a Pool,
    pub prior: &'a PriorTable,
    pub space: &'a CoarseSpace,
    pub inertial_compliance: &'a [f32],
    /// Those of the natural modes.
    pub rows: &'a [u32],
}

/// The natural modes in a frame.
#[derive(HeldBytes)]
pub(super) struct FrameModes {
    /// Their amplitudes.
    pub natural: Vec<f32>,
    /// What inertia takes off their compliance at the time of the frame.
    pub inertial_compliance: Vec<f32>,
    /// `0..n`.
    pub rows: Vec<u32>,
}

impl FrameModes {
    /// Of `count` modes.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(count: usize) -> Result<FrameModes> {
        Ok(FrameModes {
            natural: memory::zeros(count, WHAT)?,
            inertial_compliance: memory::zeros(count, WHAT)?,
            rows: memory::collected(count, 0..count as u32, WHAT)?,
        })
    }
}

impl ContactResponse<'_> {
    /// A change of forces into `q`, or onto it; `natural` has room for the amplitudes of the natural modes.
    ///
    /// # Errors
    /// A panic on another thread of the pool.
    pub fn add(
        &self,
        change: Change<'_>,
        natural: &mut [f32],
        onto: bool,
        q: &mut [f32],
    ) -> Result<()> {
        natural.fill(0.0);
        for (&dof, force) in change.dofs.iter().zip(change.forces) {
            let own = self.space.at_contact(dof as usize);
            let held_back = natural.iter_mut().zip(self.inertial_compliance);
            for ((y, inertial_compliance), own) in held_back.zip(own) {
                *y -= inertial_compliance * own * force;
            }
        }
        let (isa, pool, modes) = (self.isa, self.pool, self.space.modes());
        accumulate_rows(isa, pool, modes, self.rows, natural, onto, q)?;
        let response = &self.prior.response;
        if !self.prior.borrows() {
            return response.accumulate(isa, pool, (change.dofs, change.forces), true, q);
        }
        for (&dof, &force) in change.dofs.iter().zip(change.forces) {
            let row = self.prior.stored_dof(dof);
            response.accumulate(isa, pool, (&[row], &[force]), true, q)?;
        }
        Ok(())
    }
}
