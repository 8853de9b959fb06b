//! The two recursions of L-BFGS with the preconditioner between them in block coordinates: `z = U c + t` is never decoded to be
//! multiplied, since `y . z = (U^T y) . c + y . t`.

use super::{Memory, PAIRS, views};
use crate::corrections::passes;
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::kernels::project::project_field;
use crate::kernels::vectors::{add_scaled, dots};

/// What the second recursion needs of the first.
#[derive(Clone, Copy, Debug)]
pub struct Recursion {
    used: [usize; PAIRS],
    count: usize,
    alpha: [f64; PAIRS],
    /// `y . t`.
    work: [f64; PAIRS],
}

impl Memory {
    /// The first recursion: `r` becomes `r - sum_i alpha_i y_i` and `t = w D^-1 r` of that; `coordinates = U^T r` follows. `r [K,3]`
    /// is zero at held nodes.
    pub fn descend(
        &mut self,
        env: Env<'_>,
        starts: &[usize],
        r: &mut [f32],
        t: &mut [f32],
        coordinates: &mut [f32],
    ) -> Result<Recursion> {
        let (used, count) = self.used();
        let mut work = [0.0; PAIRS];
        for &slot in &used[..count] {
            self.project(env, starts, slot)?;
        }
        let steps = views(&self.steps, &used[..count]);
        let mut first = [0.0; PAIRS];
        dots(
            env.isa,
            env.pool,
            &steps[..count],
            r,
            &mut self.partial,
            &mut first[..count],
        )?;
        let alpha = self.alpha(&used[..count], &first);
        let factors = alpha.map(|a| -a as f32);
        let changes = views(&self.changes, &used[..count]);
        let work_of = &mut work[..count];
        passes::smooth(
            env,
            (&changes[..count], &factors[..count]),
            [r, t],
            &mut self.partial,
            work_of,
        )?;
        let projected = views(&self.coordinates, &used[..count]);
        add_scaled(
            env.isa,
            env.pool,
            &projected[..count],
            &factors[..count],
            coordinates,
        )?;
        Ok(Recursion {
            used,
            count,
            alpha,
            work,
        })
    }

    /// The second recursion: `t` becomes `-(t + sum_i w_i s_i)`, so that the direction is `t - U coordinates`.
    pub fn ascend(
        &mut self,
        env: Env<'_>,
        recursion: Recursion,
        coordinates: &[f32],
        t: &mut [f32],
    ) -> Result<()> {
        let used = &recursion.used[..recursion.count];
        let projected = views(&self.coordinates, used);
        let mut first = [0.0; PAIRS];
        let first = &mut first[..used.len()];
        dots(
            env.isa,
            env.pool,
            &projected[..used.len()],
            coordinates,
            &mut self.partial,
            first,
        )?;
        for (first, work) in first.iter_mut().zip(recursion.work) {
            *first += work;
        }
        let weight = self.weight(used, &recursion.alpha, first);
        let factors = weight.map(|w| w as f32);
        let steps = views(&self.steps, used);
        passes::negative_sum(env, &steps[..used.len()], &factors[..used.len()], t)
    }

    /// `U^T y` of the newest pair.
    pub fn newest(&mut self, env: Env<'_>, starts: &[usize]) -> Result<&[f32]> {
        let slot = *self.order.last().unwrap_or(&0);
        self.project(env, starts, slot)?;
        Ok(&self.coordinates[slot])
    }

    fn project(&mut self, env: Env<'_>, starts: &[usize], slot: usize) -> Result<()> {
        if !self.projected[slot] {
            project_field(
                env.isa,
                env.pool,
                &env.prior.basis(),
                starts,
                &self.changes[slot],
                &mut self.coordinates[slot],
            )?;
            self.projected[slot] = true;
        }
        Ok(())
    }
}
