//! The iterations over the whole field: L-BFGS ([`super::memory`]) around the preconditioner, with a line search. They bring prescribed contact, free steps
//! and the parts of a guess to balance; where tools push, [`super::local`] iterates near them instead.

use crate::clock::Instant;

use super::estimate::EXCUSED;
use super::fields::Fields;
use super::input::{Input, Report, SolverContext};
use super::line_search::{LineSearch, SHORTENINGS, Tried};
use super::passes;
use super::precondition::{Env, mask};
use super::solver::{ImplicitSolver, SMALLEST_DET};
use crate::error::Result;
use crate::kernels::vectors::dots;

/// A step, or a trial of one, that iterates over the whole field: prescribed contact ([`super::prescribed`]), free motion ([`super::free`]), and the body's answer
/// to a support ([`super::lift`]). A step that tools drive is [`super::tool_contact`].
///
/// The solver's last motion does not change while it is made; `report` adds up what its iterations and evaluations did.
pub(super) struct FieldStep<'a> {
    /// Its `fields`, `balance` and pairs are written to; `motion` is read alone.
    pub solver: &'a mut ImplicitSolver,
    /// Tables and threads.
    pub context: SolverContext<'a>,
    /// What the step starts from and is asked to do.
    pub input: &'a Input<'a>,
    /// Of this step so far.
    pub report: Report,
}

impl FieldStep<'_> {
    /// The iterations from a guess whose smallest det F is `det`.
    pub(super) fn relax(&mut self, mut det: f32, u: &mut [f32], g: &mut [f32]) -> Result<()> {
        let (context, input) = (self.context, self.input);
        let env = context.env();
        // `|r|` of the guess: what the report's residual is a part of.
        let start = self.solver.balance.size(env, g)?;
        // Invariant: `u`, its residual `g` and its smallest det F belong together at the head of each iteration.
        for iteration in 0..input.enough.iterations {
            let size = self.solver.balance.size(env, g)?;
            let until = input.enough.until;
            // A budget never takes the first iteration: a guess without one may be anywhere.
            let late = until.is_some_and(|until| Instant::now() >= until);
            if !size.is_finite() || det < SMALLEST_DET || (iteration > 0 && late) {
                break;
            }
            det = self.improve(u, g, det)?;
            self.report.effort.iterations += 1;
            // What a further iteration would move is told from what this one has moved and how far it has brought the residual down.
            self.report.remaining_mm = self.remaining(env, g, size)?;
            if self.solver.motion.suffices(
                iteration + 1,
                self.report.remaining_mm,
                input.enough,
                EXCUSED,
            ) {
                break;
            }
        }
        let end = self.solver.balance.size(env, g)?;
        if !end.is_finite() || det < SMALLEST_DET {
            u.fill(0.0);
            // Linear elasticity from rest takes the place of a state that inverts elements, and its pairs would lead back there.
            det = self.lead(1.0, u, g)?;
            self.report.fell_back = true;
            self.solver.memory.clear();
        }
        self.report.residual = (end / start.max(f64::MIN_POSITIVE)) as f32;
        self.report.min_det = det;
        Ok(())
    }

    /// One iteration: `u`, its residual `g` and its smallest det F become those of a better state.
    ///
    /// The line search tries `u + t d` in `q`, with its residual in `g_new`; `u` and `g` change only where a state is accepted.
    pub(super) fn improve(&mut self, u: &mut [f32], g: &mut [f32], det: f32) -> Result<f32> {
        let (context, last) = (self.context, self.input.last);
        let ImplicitSolver {
            preconditioner,
            balance,
            fields: Fields { d, q, g_new, .. },
            memory,
            ..
        } = &mut *self.solver;
        let env = context.env();
        // `d = -H r` with `H` the inverse Hessian that the pairs stand for, and `P` where an initial matrix would stand.
        let nodes = &balance.nodes;
        memory.direction(env, g, q, d, |q, z| {
            mask(nodes, q);
            preconditioner.apply(env, q, z)
        })?;
        mask(&balance.nodes, d);
        // `r . d` at `t = 0`, nJ: what the line search measures its gain by.
        let mut slope = [0.0];
        dots(env.isa, env.pool, &[g], d, &mut balance.partial, &mut slope)?;
        let [slope] = slope;
        let mut search = LineSearch::new(slope, SHORTENINGS);
        loop {
            let t = search.t;
            // `q = u + t d`: the state tried.
            passes::shorten(env, u, d, t, q)?;
            let (det_new, slope_new) =
                balance.residual(context, [last, q, d], g_new, &mut self.report)?;
            match search.judge(det_new > SMALLEST_DET, slope_new) {
                Tried::Accepted => {
                    balance.stand();
                    u.copy_from_slice(q);
                    // The pair is `s = t d` and `y = r_new - r`; `q` is free to hold `y` once the state has been taken.
                    passes::difference(env, g_new, g, q)?;
                    memory.store(env, d, t, q)?;
                    g.copy_from_slice(g_new);
                    return Ok(det_new);
                }
                Tried::Shortened => {}
                Tried::GivenUp => {
                    memory.clear();
                    return Ok(det);
                }
            }
        }
    }

    /// What a further iteration would move, from the last one's step and by how much it lessened the residual, mm.
    fn remaining(&mut self, env: Env<'_>, g: &[f32], before: f64) -> Result<f32> {
        let moved = passes::square(env, &self.solver.fields.d, &mut self.solver.balance.partial)?
            / (self.solver.fields.d.len() / 3) as f64;
        let left = self.solver.balance.size(env, g)? / before.max(f64::MIN_POSITIVE);
        Ok((moved.sqrt() * left) as f32)
    }
}
