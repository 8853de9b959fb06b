//! The iterations over the whole field: L-BFGS ([`super::memory`]) around the preconditioner, with a line search. They bring prescribed contact, free steps
//! and the parts of a guess to balance; where tools push, [`super::local`] iterates near them instead.

use crate::clock::Instant;

use super::input::{Input, Report, SolverContext};
use super::line_search::{LineSearch, SHORTENINGS, Tried};
use super::passes;
use super::precondition::mask;
use super::solver::{ImplicitSolver, SMALLEST_DET};
use crate::error::Result;
use crate::kernels::vectors::dots;

impl ImplicitSolver {
    /// The iterations from a guess whose smallest det F is `det`.
    pub(super) fn relax(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        mut det: f32,
        u: &mut [f32],
        g: &mut [f32],
        report: &mut Report,
    ) -> Result<()> {
        let env = context.env();
        // `|r|` of the guess: what the report's residual is a part of.
        let start = self.balance.size(env, g)?;
        // Invariant: `u`, its residual `g` and its smallest det F belong together at the head of each iteration.
        for iteration in 0..input.enough.iterations {
            let size = self.balance.size(env, g)?;
            let until = input.enough.until;
            // A budget never takes the first iteration: a guess without one may be anywhere.
            let late = until.is_some_and(|until| Instant::now() >= until);
            if !size.is_finite() || det < SMALLEST_DET || (iteration > 0 && late) {
                break;
            }
            det = self.improve(context, input.last, u, g, det, report)?;
            report.iterations += 1;
            // What a further iteration would move is told from what this one has moved and how far it has brought the residual down.
            report.remaining_mm = self.remaining(env, g, size)?;
            if self.suffices(iteration + 1, report.remaining_mm, input.enough) {
                break;
            }
        }
        let end = self.balance.size(env, g)?;
        if !end.is_finite() || det < SMALLEST_DET {
            u.fill(0.0);
            // Linear elasticity from rest takes the place of a state that inverts elements, and its pairs would lead back there.
            det = self.lead(context, input, 1.0, u, g, report)?;
            report.fell_back = true;
            self.memory.clear();
        }
        report.residual = (end / start.max(f64::MIN_POSITIVE)) as f32;
        report.min_det = det;
        Ok(())
    }

    /// One iteration: `u`, its residual `g` and its smallest det F become those of a better state.
    pub(super) fn improve(
        &mut self,
        context: SolverContext<'_>,
        last: &[f32],
        u: &mut [f32],
        g: &mut [f32],
        det: f32,
        report: &mut Report,
    ) -> Result<f32> {
        self.with_fields(|solver, fields| {
            solver.improve_in(context, (last, u, g), det, fields, report)
        })
    }

    /// Calls with `d`, `q` and the new residual, which come back whatever the call gives.
    pub(super) fn with_fields<T>(
        &mut self,
        call: impl FnOnce(&mut ImplicitSolver, [&mut Vec<f32>; 3]) -> Result<T>,
    ) -> Result<T> {
        let [mut d, mut q, mut g_new] = [
            &mut self.fields.d,
            &mut self.fields.q,
            &mut self.fields.g_new,
        ]
        .map(std::mem::take);
        let made = call(self, [&mut d, &mut q, &mut g_new]);
        (self.fields.d, self.fields.q, self.fields.g_new) = (d, q, g_new);
        made
    }

    /// One iteration, its fields lent: the line search tries `u + t d` in `q`, with its residual in `g_new`; `u` and `g` change only where a state is accepted.
    fn improve_in(
        &mut self,
        context: SolverContext<'_>,
        (last, u, g): (&[f32], &mut [f32], &mut [f32]),
        det: f32,
        [d, q, g_new]: [&mut Vec<f32>; 3],
        report: &mut Report,
    ) -> Result<f32> {
        let env = context.env();
        // `d = -H r` with `H` the inverse Hessian that the pairs stand for, and `P` where an initial matrix would stand.
        let preconditioner = &mut self.preconditioner;
        let nodes = &self.balance.nodes;
        self.memory.direction(env, g, q, d, |q, z| {
            mask(nodes, q);
            preconditioner.apply(env, q, z)
        })?;
        mask(&self.balance.nodes, d);
        // `r . d` at `t = 0`, nJ: what the line search measures its gain by.
        let mut slope = [0.0];
        dots(
            env.isa,
            env.pool,
            &[g],
            d,
            &mut self.balance.partial,
            &mut slope,
        )?;
        let [slope] = slope;
        let mut search = LineSearch::new(slope, SHORTENINGS);
        loop {
            let t = search.t;
            // `q = u + t d`: the state tried.
            passes::shorten(env, u, d, t, q)?;
            let (det_new, slope_new) =
                self.balance
                    .residual(context, [last, q, d], g_new, report)?;
            match search.judge(det_new > SMALLEST_DET, slope_new) {
                Tried::Accepted => {
                    self.balance.stand();
                    u.copy_from_slice(q);
                    // The pair is `s = t d` and `y = r_new - r`; `q` is free to hold `y` once the state has been taken.
                    passes::difference(env, g_new, g, q)?;
                    self.memory.store(env, d, t, q)?;
                    g.copy_from_slice(g_new);
                    return Ok(det_new);
                }
                Tried::Shortened => {}
                Tried::GivenUp => {
                    self.memory.clear();
                    return Ok(det);
                }
            }
        }
    }
}
