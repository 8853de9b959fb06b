//! The coarse level on modes and columns alone, without a field: what local iterations ask of the preconditioner.

use std::ops::Range;

use super::{Env, Preconditioner};
use crate::error::Result;
use crate::kernels::project::{row_dots, row_dots_in};
use crate::kernels::respond::{accumulate_in, accumulate_rows};
use crate::kernels::rows::Stored;

impl Preconditioner {
    /// `out = Phi^T E f`, µN, of forces on degrees of freedom with columns, mN.
    pub fn work_of_modes(&self, env: Env<'_>, forces: &[(u32, f32)], out: &mut [f32]) {
        out.fill(0.0);
        for &(dof, force) in forces {
            for (sum, own) in out.iter_mut().zip(env.space.at_contact(dof as usize)) {
                *sum += 1e3 * force * own;
            }
        }
    }

    /// `out = G^-1 load` with `G = Phi^T (K + kappa M) Phi`: what the modes have of the response to loads on them, mm.
    pub fn respond_on_modes(&self, env: Env<'_>, load: &[f32], out: &mut [f32]) -> Result<()> {
        let inverse = Stored::F32(&self.galerkin_inverse);
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
    pub fn stiffen(&self, env: Env<'_>, c: &[f32], out: &mut [f32]) -> Result<()> {
        let galerkin = Stored::F32(&self.galerkin_narrow);
        Ok(row_dots(
            env.isa,
            env.pool,
            galerkin,
            env.space.rows(),
            c,
            out,
        )?)
    }

    /// The block coordinates of `Phi c + A_k E f` in some ranges; the others keep what they hold.
    pub fn near_coordinates(
        &mut self,
        env: Env<'_>,
        c: &[f32],
        forces: &[(u32, f32)],
        ranges: &[Range<usize>],
        q: &mut [f32],
    ) {
        self.split(env, c, forces);
        let modes = (env.space.rows(), self.solved.as_slice());
        accumulate_in(env.isa, env.space.modes(), modes, ranges, false, q);
        let columns = (self.load_dofs.as_slice(), self.load_forces.as_slice());
        let response = env.prior.response.stored();
        accumulate_in(env.isa, response, columns, ranges, true, q);
    }

    /// The block coordinates of `Phi c`, as `coordinates`.
    pub fn take_coordinates(&mut self, env: Env<'_>, c: &[f32]) -> Result<()> {
        let (modes, rows) = (env.space.modes(), env.space.rows());
        let (isa, pool, q) = (env.isa, env.pool, &mut self.coordinates);
        Ok(accumulate_rows(isa, pool, modes, rows, c, false, q)?)
    }

    /// `solved` on the modes, with what inertia takes off the responses, and the forces as two lists.
    fn split(&mut self, env: Env<'_>, c: &[f32], forces: &[(u32, f32)]) {
        self.solved.copy_from_slice(c);
        self.load_dofs.clear();
        self.load_forces.clear();
        for &(dof, force) in forces {
            let own = env.space.at_contact(dof as usize);
            let natural = self.inertial_compliance.iter().zip(own);
            for (y, (inertial_compliance, own)) in self.solved.iter_mut().zip(natural) {
                *y -= inertial_compliance * own * force;
            }
            self.load_dofs.push(dof);
            self.load_forces.push(force);
        }
    }

    /// `Phi^T r` from `coordinates = U^T r [Q]`.
    pub fn on_modes(&self, env: Env<'_>, q: &[f32], out: &mut [f32]) -> Result<()> {
        let (modes, rows) = (env.space.modes(), env.space.rows());
        Ok(row_dots(env.isa, env.pool, modes, rows, q, out)?)
    }

    /// The same of coordinates that are zero outside of some ranges.
    pub fn on_modes_in(&self, env: Env<'_>, ranges: &[Range<usize>], q: &[f32], out: &mut [f32]) {
        let (modes, rows) = (env.space.modes(), env.space.rows());
        row_dots_in(env.isa, modes, rows, ranges, q, out);
    }

    /// `(A_k E)^T r` of columns, mm/mN µN, from `U^T r [Q]`, zero outside of some ranges, and `Phi^T r`.
    pub fn on_columns(
        &self,
        env: Env<'_>,
        dofs: &[u32],
        ranges: &[Range<usize>],
        (q, on_modes): (&[f32], &[f32]),
        out: &mut [f32],
    ) {
        row_dots_in(env.isa, env.prior.response.stored(), dofs, ranges, q, out);
        for (work, &dof) in out.iter_mut().zip(dofs) {
            let own = env.space.at_contact(dof as usize);
            let natural = self.inertial_compliance.iter().zip(own).zip(on_modes);
            for ((inertial_compliance, own), on_mode) in natural {
                *work -= inertial_compliance * own * on_mode;
            }
        }
    }

    /// The coarse level from `Phi^T r` (µN) and `(A_k E)^T r` of the touched columns: modes (mm) and forces (mN) on those columns.
    pub fn coarse_on(
        &mut self,
        env: Env<'_>,
        on_modes: &[f32],
        at_contact: &[f32],
    ) -> (&[f32], &[f32]) {
        self.on_modes.copy_from_slice(on_modes);
        self.at_contact.copy_from_slice(at_contact);
        self.solve_coarse(env);
        (&self.solved, &self.forces)
    }

    /// Columns of the touched nodes, as degrees of freedom.
    pub fn dofs(&self) -> &[u32] {
        &self.dofs
    }
}
