//! Responses of `K + kappa M` through the prior's columns and the modes: to prescribed nodes, to loads, to what the natural modes do
//! by themselves.

use super::{Env, Preconditioner, mask_held};
use crate::error::Result;
use crate::kernels::project::{project_field, row_dots};
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::decode_rows;

impl Preconditioner {
    /// `L_C^T r` at the prescribed nodes with columns, from `r [K,3]` that is zero there: what the free nodes' residual adds to the contact
    /// forces, µN.
    /// It writes over `coordinates`: whoever needs the field of those from before has decoded it.
    pub fn reaction(
        &mut self,
        env: Env<'_>,
        r: &[f32],
        mut take: impl FnMut(u32, [f32; 3]),
    ) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        if self.contact.dofs.is_empty() {
            return Ok(());
        }
        let basis = env.prior.basis();
        let q = &mut self.coordinates;
        project_field(isa, pool, &basis, &self.basis.starts, r, q)?;
        let (modes, rows) = (env.space.modes(), env.space.rows());
        row_dots(isa, pool, modes, rows, q, &mut self.on_modes)?;
        self.contact_work(env)?;
        self.contact
            .compliance
            .solve(isa, &self.contact.moved, &mut self.contact.forces);
        for (&column, force) in self
            .contact
            .columns
            .iter()
            .zip(self.contact.forces.as_chunks::<3>().0)
        {
            take(env.prior.contact_nodes[column as usize], *force);
        }
        Ok(())
    }

    /// `coordinates` of `Phi solved + W forces`.
    /// The columns `W` are those of the static response. What inertia takes off the natural modes'
    /// part of it is taken off in their amplitudes.
    pub(super) fn spread(&mut self, env: Env<'_>) -> Result<()> {
        for (&dof, force) in self.contact.dofs.iter().zip(&self.contact.forces) {
            let own = env.space.at_contact(dof as usize);
            for ((y, inertial_compliance), own) in self
                .solved
                .iter_mut()
                .zip(&self.modal.inertial_compliance)
                .zip(own)
            {
                *y -= inertial_compliance * own * force;
            }
        }
        let (isa, pool, q) = (env.isa, env.pool, &mut self.coordinates);
        let rows = env.space.rows();
        accumulate_rows(isa, pool, env.space.modes(), rows, &self.solved, false, q)?;
        let dofs = env
            .prior
            .stored_dofs(&self.contact.dofs, &mut self.contact.stored)?;
        let loads = (dofs, self.contact.forces.as_slice());
        env.prior.response.accumulate(isa, pool, loads, true, q)
    }

    /// Adds the response of `K + kappa M` that takes the prescribed nodes to their targets: `u += L_C(target - u_C)`.
    ///
    /// `target(i)` is that of the `i`-th prescribed node, mm; `scratch [K,3]`.
    pub fn respond(
        &mut self,
        env: Env<'_>,
        target: impl Fn(usize) -> [f32; 3],
        scratch: &mut [f32],
        u: &mut [f32],
    ) -> Result<()> {
        let isa = env.isa;
        let mut slot = 0;
        for (index, &node) in self.nodes.iter().enumerate() {
            // Only nodes with a column of the prior can be moved by a response.
            if !matches!(env.prior.column_for(&env.held.is, node), Some((_, true))) {
                continue;
            }
            let target = target(index);
            for axis in 0..3 {
                self.contact.moved[slot] = target[axis] - u[3 * node as usize + axis];
                slot += 1;
            }
        }
        if slot > 0 {
            self.contact
                .compliance
                .solve(isa, &self.contact.moved, &mut self.contact.forces);
        }
        self.solved.fill(0.0);
        self.spread(env)?;
        self.add_decoded(env, scratch, u)
    }

    /// For each natural mode what inertia takes off its part of the compliance, mm/mN.
    pub fn inertial_compliance(&self) -> &[f32] {
        &self.modal.inertial_compliance
    }

    /// `coordinates += A_k f` of forces `f` (mN) on degrees of freedom with columns.
    /// `A_k = W - N diag(lost) N^T`: the static columns, less what inertia holds back in a step of
    /// this length.
    pub fn add_load(&mut self, env: Env<'_>, dofs: &[u32], forces: &[f32]) -> Result<()> {
        let count = self.modal.inertial_compliance.len();
        self.solved.fill(0.0);
        for (&dof, force) in dofs.iter().zip(forces) {
            let own = env.space.at_contact(dof as usize);
            for ((y, inertial_compliance), own) in self
                .solved
                .iter_mut()
                .zip(&self.modal.inertial_compliance)
                .zip(own)
            {
                *y -= inertial_compliance * own * force;
            }
        }
        let (isa, pool, q) = (env.isa, env.pool, &mut self.coordinates);
        let rows = &env.space.rows()[..count];
        // The natural modes come first among the modes, and they alone have an inertial part.
        let natural = &self.solved[..count];
        let modes = env.space.modes();
        accumulate_rows(isa, pool, modes, rows, natural, true, q)?;
        let dofs = env.prior.stored_dofs(dofs, &mut self.contact.stored)?;
        (env.prior.response).accumulate(isa, pool, (dofs, forces), true, q)
    }

    /// `coordinates = -N diag(1 / (m (w² + kappa))) N^T r` of a residual `[K,3]`, µN, that is zero at held nodes.
    /// `kappa` stands for the inertia of BDF2: `w² + kappa` is what a natural mode has of `K +
    /// kappa M` over its mass.
    pub fn move_natural(&mut self, env: Env<'_>, r: &[f32]) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        let count = self.modal.inertial_compliance.len();
        self.project(env, r)?;
        let q = &mut self.coordinates;
        let (modes, rows) = (env.space.modes(), &env.space.rows()[..count]);
        let natural = &mut self.on_modes[..count];
        row_dots(isa, pool, modes, rows, q, natural)?;
        for (value, moved) in natural.iter_mut().zip(&self.modal.moved_freely) {
            *value *= -moved;
        }
        Ok(accumulate_rows(isa, pool, modes, rows, natural, false, q)?)
    }

    /// `coordinates = U^T r` of a field `[K,3]`.
    pub fn project(&mut self, env: Env<'_>, r: &[f32]) -> Result<()> {
        Ok(project_field(
            env.isa,
            env.pool,
            &env.prior.basis(),
            &self.basis.starts,
            r,
            &mut self.coordinates,
        )?)
    }

    /// `to = U coordinates`, `[K,3]`.
    pub fn decode(&mut self, env: Env<'_>, to: &mut [f32]) -> Result<()> {
        Ok(decode_rows(
            env.isa,
            env.pool,
            &env.prior.basis(),
            &self.basis.plan,
            &self.coordinates,
            to,
        )?)
    }

    /// The same at the nodes of the domain only; other rows keep their values.
    pub fn decode_domain(&mut self, env: Env<'_>, to: &mut [f32]) -> Result<()> {
        Ok(decode_rows(
            env.isa,
            env.pool,
            &env.prior.basis(),
            &self.basis.domain,
            &self.coordinates,
            to,
        )?)
    }

    /// `N^T r` of a field `[K,3]` that is zero at held nodes: what it has of each natural mode.
    pub fn on_natural(&mut self, env: Env<'_>, r: &[f32], out: &mut [f32]) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        let q = &mut self.coordinates;
        project_field(isa, pool, &env.prior.basis(), &self.basis.starts, r, q)?;
        let rows = &env.space.rows()[..out.len()];
        Ok(row_dots(isa, pool, env.space.modes(), rows, q, out)?)
    }

    /// `out = N y [K,3]` of natural modes' amplitudes.
    pub fn of_natural(&mut self, env: Env<'_>, y: &[f32], out: &mut [f32]) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        let q = &mut self.coordinates;
        let rows = &env.space.rows()[..y.len()];
        let modes = env.space.modes();
        accumulate_rows(isa, pool, modes, rows, y, false, q)?;
        let basis = env.prior.basis();
        decode_rows(isa, pool, &basis, &self.basis.plan, q, out)?;
        // A field of the body is zero at held nodes, whatever the basis has there.
        mask_held(&env.held.is, out);
        Ok(())
    }

    /// Adds the field of `coordinates`.
    /// `scratch` has the change alone afterwards.
    fn add_decoded(&mut self, env: Env<'_>, scratch: &mut [f32], u: &mut [f32]) -> Result<()> {
        let basis = env.prior.basis();
        decode_rows(
            env.isa,
            env.pool,
            &basis,
            &self.basis.plan,
            &self.coordinates,
            scratch,
        )?;
        mask_held(&env.held.is, scratch);
        for (u, change) in u.iter_mut().zip(&*scratch) {
            *u += change;
        }
        Ok(())
    }
}
