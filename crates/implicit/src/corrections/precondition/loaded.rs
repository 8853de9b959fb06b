//! The coarse level of steps under loads, with the bundle's whole modes ([`crate::corrections::whole`]).

use super::{Env, Preconditioner, WHAT, mask_held};
use crate::corrections::whole::{WholeModes, WholeSolve};
use crate::error::Result;
use crate::kernels::Compute;
use crate::kernels::project::{project_field, row_dots};
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::decode_rows;
use crate::memory;

impl<'a> Env<'a> {
    /// Instruction set and threads alone.
    pub(super) fn compute(self) -> Compute<'a> {
        Compute {
            isa: self.isa,
            pool: self.pool,
        }
    }
}

impl Preconditioner {
    /// Whether the step has a load that acts everywhere: its steps have the bundle's whole modes in the coarse level.
    pub(in crate::corrections) fn expect_load(
        &mut self,
        env: Env<'_>,
        has_load: bool,
    ) -> Result<()> {
        self.whole.has_load = has_load;
        if self.whole.let_go != env.held.let_go {
            self.whole.let_go = env.held.let_go;
            self.whole.solve = None;
        }
        if let (true, Some(modes), None) = (has_load, env.whole, &self.whole.solve) {
            let kappa = env.time_step.integrator.kappa();
            let made = WholeSolve::new(env.compute(), modes, env.space, kappa)?;
            self.whole.solve = Some(memory::boxed(made, WHAT)?);
        }
        Ok(())
    }

    /// The whole modes of a step that has them.
    pub(super) fn whole_modes<'a>(&self, env: Env<'a>) -> Option<&'a WholeModes> {
        env.whole.filter(|_| self.whole.has_load)
    }

    /// `u -= V' S^-1 V'^T r`: what the whole modes of a step that has them make of a residual; `scratch [K,3]`.
    pub(in crate::corrections) fn move_whole(
        &mut self,
        env: Env<'_>,
        r: &[f32],
        scratch: &mut [f32],
        u: &mut [f32],
    ) -> Result<()> {
        let (Some(modes), Some(own)) = (self.whole_modes(env), &mut self.whole.solve) else {
            return Ok(());
        };
        let (basis, phi, rows) = (env.prior.basis(), env.space.modes(), env.space.rows());
        let q = &mut self.coordinates;
        project_field(env.isa, env.pool, &basis, &self.basis.starts, r, q)?;
        row_dots(env.isa, env.pool, phi, rows, q, &mut self.on_modes)?;
        own.solve(env.compute(), modes, r, &self.on_modes)?;
        self.solved.fill(0.0);
        own.take_off(&mut self.solved);
        accumulate_rows(env.isa, env.pool, phi, rows, &self.solved, false, q)?;
        decode_rows(env.isa, env.pool, &basis, &self.basis.plan, q, scratch)?;
        own.add(env.compute(), modes, scratch)?;
        mask_held(&env.held.is, scratch);
        u.iter_mut().zip(&*scratch).for_each(|(u, z)| *u -= z);
        Ok(())
    }
}
