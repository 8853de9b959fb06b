//! The coarse level on modes alone, without a field: what local iterations ask of the preconditioner.
//!
//! Local iterations carry the far field as amplitudes of the modes. What they need of the
//! preconditioner then are products with small dense matrices, `[r,r]`, and with the rows of the
//! modes in the blocks near the tools.

use std::ops::Range;

use super::{Env, Preconditioner};
use crate::error::Result;
use crate::kernels::project::{row_dots, row_dots_in};
use crate::kernels::respond::{accumulate_in, accumulate_rows};
use crate::kernels::rows::Stored;

impl Preconditioner {
    /// `out = G^-1 load` with `G = Phi^T (K + kappa M) Phi`: what the modes have of the response to loads on them, mm.
    /// By the inverse and not a factor: a product reads it once and in order.
    pub fn respond_on_modes(&self, env: Env<'_>, load: &[f32], out: &mut [f32]) -> Result<()> {
        let inverse = Stored::F32(&self.galerkin.inverse);
        Ok(row_dots(
            env.isa,
            env.pool,
            inverse,
            env.space.rows(),
            load,
            out,
        )?)
    }

    /// `out = G c`, µN.
    /// `out [r]`, of amplitudes `c [r]`, mm.
    pub fn stiffen(&self, env: Env<'_>, c: &[f32], out: &mut [f32]) -> Result<()> {
        let galerkin = Stored::F32(&self.galerkin.narrow);
        Ok(row_dots(
            env.isa,
            env.pool,
            galerkin,
            env.space.rows(),
            c,
            out,
        )?)
    }

    /// The block coordinates of `Phi c`, as `coordinates`.
    /// At all nodes; [`Env::near_coordinates`] is the part near the tools.
    pub fn take_coordinates(&mut self, env: Env<'_>, c: &[f32]) -> Result<()> {
        let (modes, rows) = (env.space.modes(), env.space.rows());
        let (isa, pool, q) = (env.isa, env.pool, &mut self.coordinates);
        Ok(accumulate_rows(isa, pool, modes, rows, c, false, q)?)
    }
}

impl Env<'_> {
    /// `out = Phi^T E f`, µN, of forces on degrees of freedom with columns, mN.
    /// The factor 1e3 takes mN to µN.
    pub fn work_of_modes(&self, forces: &[(u32, f32)], out: &mut [f32]) {
        out.fill(0.0);
        for &(dof, force) in forces {
            for (sum, own) in out.iter_mut().zip(self.space.at_contact(dof as usize)) {
                *sum += 1e3 * force * own;
            }
        }
    }

    /// The block coordinates of `Phi c` in some ranges; the others keep what they hold.
    pub fn near_coordinates(&self, c: &[f32], ranges: &[Range<usize>], q: &mut [f32]) {
        let modes = (self.space.rows(), c);
        accumulate_in(self.isa, self.space.modes(), modes, ranges, false, q);
    }

    /// `Phi^T r` from `coordinates = U^T r [Q]`.
    pub fn on_modes(&self, q: &[f32], out: &mut [f32]) -> Result<()> {
        let (modes, rows) = (self.space.modes(), self.space.rows());
        Ok(row_dots(self.isa, self.pool, modes, rows, q, out)?)
    }

    /// The same for `n` lists of coordinates `[n,Q]` that are zero outside of some ranges, to `out [n,r]`.
    /// Each row of the modes is read once for three of the lists.
    pub fn on_modes_in(&self, ranges: &[Range<usize>], q: &[f32], out: &mut [f32]) {
        let (modes, rows) = (self.space.modes(), self.space.rows());
        row_dots_in(self.isa, modes, rows, ranges, q, out);
    }
}
