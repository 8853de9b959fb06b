//! The coarse level of steps under loads, with the bundle's whole modes ([`crate::corrections::whole`]).
//!
//! Gravity or pressure moves the whole body, and the prior's block bases, which are made of
//! responses to contact, cannot show that. With whole modes the coarse level spans both; without a
//! load they are left out, since each costs a pass over all nodes.

use super::parts::WholeLevel;
use super::{Env, Preconditioner, WHAT, mask_held};
use crate::corrections::whole::{WholeModes, WholeSolve};
use crate::error::Result;
use crate::kernels::Compute;
use crate::kernels::project::{project_field, row_dots};
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::memory;

/// One of so many nodes says how far whole modes move: an estimate of the largest move, by which it
/// is decided whether all elements have to be asked.
const SAMPLED: usize = 16;

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
        // A step without a load that acts everywhere leaves the whole modes alone: they cost a pass
        // over all nodes.
        self.whole.has_load = has_load;
        // Another set of groups that are let go is another boundary, for which the solve is made
        // anew.
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
        self.whole.modes(env)
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

impl WholeLevel {
    /// The whole modes of a step that has them.
    fn modes<'a>(&self, env: Env<'a>) -> Option<&'a WholeModes> {
        env.whole.filter(|_| self.has_load)
    }

    /// Solves for what the whole modes make of a residual `r` less `loads` (by node, mN), which has `on_modes = Phi^T r` of the modes; [`WholeLevel::join`] and
    /// [`WholeLevel::add`] make a field of it. Says how far that moves a node along an axis, mm; none in a step without whole modes. `q [Q]` and `scratch [K,3]` are
    /// room to decode in by `plan`.
    pub(in crate::corrections) fn ask(
        &mut self,
        env: Env<'_>,
        (r, on_modes): (&[f32], &[f32]),
        each_load: impl Fn(&mut dyn FnMut(u32, [f32; 3])),
        room: (&RowPlan, &mut [f32], &mut [f32]),
    ) -> Result<Option<f32>> {
        let (Some(modes), Some(own)) = (self.modes(env), &mut self.solve) else {
            return Ok(None);
        };
        if own.sampled().is_empty() {
            *own.sampled() = sampled(env, modes, own, room)?;
        }
        own.project(env.compute(), modes, r)?;
        // Forces of the contact are in mN, residuals in µN.
        each_load(&mut |node, force| own.take_force(modes, node, force.map(|f| 1e3 * f)));
        own.finish(env.compute(), on_modes);
        // The residual points uphill, and what is asked for is the move down: hence the sign.
        own.turn();
        Ok(Some(own.most_mm()))
    }

    /// Adds what the whole modes of the last [`WholeLevel::ask`] have of the modes to their amplitudes.
    pub(in crate::corrections) fn join(&self, c: &mut [f32]) {
        if let Some(own) = &self.solve {
            own.take_off(c);
        }
    }

    /// Adds the rest of them to a field `[K,3]`.
    pub(in crate::corrections) fn add(&self, env: Env<'_>, u: &mut [f32]) -> Result<()> {
        match (self.modes(env), &self.solve) {
            (Some(modes), Some(own)) => own.add(env.compute(), modes, u),
            _ => Ok(()),
        }
    }
}

/// What each whole mode does at some nodes: fields as smooth as these go hardly farther between them.
/// Made once for each solve of the whole modes and then read by every step, `[3 n, m]` with one of
/// 16 nodes and `m` whole modes.
fn sampled(
    env: Env<'_>,
    modes: &WholeModes,
    own: &mut WholeSolve,
    (plan, q, scratch): (&RowPlan, &mut [f32], &mut [f32]),
) -> Result<Vec<f32>> {
    let count = modes.count();
    let nodes = env.body.mass.len().div_ceil(SAMPLED);
    let mut sampled = memory::zeros(3 * nodes * count, WHAT)?;
    let mut on_modes = memory::zeros(env.space.count(), WHAT)?;
    let (basis, phi, rows) = (env.prior.basis(), env.space.modes(), env.space.rows());
    for mode in 0..count {
        own.pick(mode);
        on_modes.fill(0.0);
        own.take_off(&mut on_modes);
        accumulate_rows(env.isa, env.pool, phi, rows, &on_modes, false, q)?;
        decode_rows(env.isa, env.pool, &basis, plan, q, scratch)?;
        own.add(env.compute(), modes, scratch)?;
        mask_held(&env.held.is, scratch);
        let nodes = scratch.as_chunks::<3>().0.iter().step_by(SAMPLED);
        for (row, value) in sampled.chunks_exact_mut(count).zip(nodes.flatten()) {
            row[mode] = *value;
        }
    }
    Ok(sampled)
}
