//! The equation of motion of a step: what is out of balance in a state, `F(u) = f_int(u) + M (a + alpha v) - p`, µN.
//!
//! BDF2 makes `M (a + alpha v)` linear in the displacement, `kappa M (u - u_n)` and what the past gives ([`Balance::drift`]); loads beside contact are taken off
//! that. Forces of contact are not part of it: the pairs of L-BFGS hold `F` alone.

use super::history::PAIRS;
use super::input::{Report, SolverContext};
use super::passes;
use super::precondition::{Env, mask};
use crate::error::{Error, Result};
use crate::kernels::vectors::PartialSums;
use crate::memory::{self, HeldBytes};

/// See the module.
#[derive(HeldBytes)]
pub(super) struct Balance {
    /// Room of the elements, and the smallest det F of each chunk at the last evaluation.
    pub scratch: elements::Scratch,
    /// `M p`: inertia of the step at the last displacement, less the loads `[K,3]`, µN.
    pub drift: Vec<f32>,
    /// Loads beside contact at the end of the step `[K,3]`, µN; empty where there are none.
    pub load: Vec<f32>,
    /// Nodes in contact whose place is prescribed and that nothing holds, ascending; none where tools drive.
    pub nodes: Vec<u32>,
    /// `r` at `nodes` `[m,3]`, µN, of the last evaluation and of the state that stands.
    pub at_nodes: [Vec<f32>; 2],
    /// Sums of the pieces of a field, added in their order whatever the threads did: the same bits for any number of them.
    pub partial: PartialSums,
}

impl Balance {
    /// Of a body at rest.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(context: SolverContext<'_>) -> Result<Balance> {
        let body = context.env().body;
        let len = 3 * body.mass.len();
        Ok(Balance {
            scratch: (body.forces.scratch(context.pool.threads())).map_err(|_| {
                Error::OutOfMemory("no memory for the element forces of a scene".into())
            })?,
            drift: memory::zeros(len, "the corrections of a scene")?,
            load: Vec::new(),
            nodes: memory::room(len / 3, "the corrections of a scene")?,
            at_nodes: [
                memory::room(len, "contact forces")?,
                memory::room(len, "contact forces")?,
            ],
            partial: PartialSums::with_room(len, PAIRS)?,
        })
    }

    /// `r(u)` to `out`, zero at held and prescribed nodes; returns the smallest det F and `r . d` with a field that is zero there.
    pub fn residual(
        &mut self,
        context: SolverContext<'_>,
        [last, u, d]: [&[f32]; 3],
        out: &mut [f32],
        report: &mut Report,
    ) -> Result<(f32, f64)> {
        let env = context.env();
        let failed = std::sync::Mutex::new(None);
        let det = env
            .body
            .forces
            .evaluate(u, &mut self.scratch, out, &|count, task| {
                if let Err(error) = context.pool.run(count, task) {
                    *failed
                        .lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner) = Some(error);
                }
            });
        let failed = failed.into_inner();
        if let Some(error) = failed.unwrap_or_else(std::sync::PoisonError::into_inner) {
            return Err(error.into());
        }
        let kappa = context.time_step.integrator.kappa() as f32;
        let fields = [self.drift.as_slice(), u, last, d];
        let slope = passes::inertia(env, kappa, fields, out, &mut self.partial)?;
        self.at_nodes[0].clear();
        for &node in &self.nodes {
            let at = 3 * node as usize;
            self.at_nodes[0].extend_from_slice(&out[at..at + 3]);
        }
        mask(&self.nodes, out);
        report.effort.evaluations += 1;
        Ok((det, slope))
    }

    /// `|a|`.
    pub fn size(&mut self, env: Env<'_>, a: &[f32]) -> Result<f64> {
        Ok(passes::square(env, a, &mut self.partial)?.sqrt())
    }

    /// The state of the last evaluation is the one that stands.
    pub fn stand(&mut self) {
        // Only a state that was accepted has forces: one that the line search tried and left must not be felt.
        let [last, stands] = &mut self.at_nodes;
        std::mem::swap(last, stands);
    }
}
