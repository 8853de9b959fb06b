//! One iteration of a step that tools drive: a direction of the elements with the contact's answer in it, and how far along it.

use super::{Iterate, SUNK_MM, each_free_load, is_spent, sunk};
use crate::contact::ContactProblem;
use crate::corrections::input::{Input, Report, SolverContext};
use crate::corrections::passes;
use crate::corrections::precondition::Env;
use crate::corrections::solver::{ImplicitSolver, SHORTENINGS, SLOPE, SMALLEST_DET};
use crate::error::Result;

impl ImplicitSolver {
    /// `U^T F(u)` of the state that stands.
    fn project_standing(&mut self, env: Env<'_>, g: &[f32]) -> Result<()> {
        if !self.is_projected {
            self.preconditioner.project(env, g)?;
            self.projected
                .copy_from_slice(&self.preconditioner.coordinates);
            self.is_projected = true;
        }
        Ok(())
    }

    /// One iteration with the tools at part `way` of their way, from the residual in `q`; tells whether it leads to
    /// another state.
    pub(super) fn improve_at(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        at: &mut Iterate<'_>,
        way: f32,
        report: &mut Report,
    ) -> Result<bool> {
        self.with_fields(|solver, fields| {
            solver.improve_at_in(context, input, (problem, at), way, fields, report)
        })
    }

    fn improve_at_in(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        (problem, at): (&mut ContactProblem, &mut Iterate<'_>),
        way: f32,
        [d, q, g_new]: [&mut Vec<f32>; 3],
        report: &mut Report,
    ) -> Result<bool> {
        let env = context.env();
        let mut better = false;
        // The coordinates of the residual: those of F less those of the loads.
        self.project_standing(env, at.g)?;
        let pre = &mut self.preconditioner;
        pre.coordinates.copy_from_slice(&self.projected);
        each_free_load(problem, &env.body.held, |node, force| {
            env.prior
                .add_row(node, force.map(|f| -f), &mut pre.coordinates);
        });
        let starts = &pre.starts;
        let recursion = self
            .memory
            .descend(env, starts, q, d, &mut pre.coordinates)?;
        pre.coarse(env)?;
        self.memory.ascend(env, recursion, &pre.coordinates, d)?;
        pre.coordinates.iter_mut().for_each(|c| *c = -*c);
        // Where the tissue would be is u + d and the coordinates' field, which takes on what the contact changes.
        for &node in &pre.domain_nodes {
            let range = 3 * node as usize..3 * node as usize + 3;
            for ((q, u), d) in q[range.clone()]
                .iter_mut()
                .zip(&at.u[range.clone()])
                .zip(&d[range])
            {
                *q = u + d;
            }
        }
        self.press(context, input, problem, way, q)?;
        self.preconditioner.decode(env, q)?;
        let [along, moved] = passes::advance(env, [at.u, at.g], d, q, &mut self.partial)?;
        self.moved = moved;
        let work = work(problem, d);
        let slope = along - work;
        let mut t = 1.0f32;
        for attempt in 0..=SHORTENINGS {
            if attempt > 0 {
                passes::shorten(env, at.u, d, t, q)?;
            }
            let (det, slope_new) = self.residual(context, [input.last, q, d], g_new, report)?;
            let slope_new = slope_new - work;
            let left = match det > SMALLEST_DET {
                true => sunk(input, problem, q, way),
                false => f32::MAX,
            };
            // An iteration may not lose the contact, unless it had been lost.
            let keeps = left <= 0.5 * SUNK_MM || left <= sunk(input, problem, at.u, way);
            if keeps && 0.5 * (slope + slope_new) <= SLOPE * slope {
                std::mem::swap(at.u, q);
                passes::difference(env, g_new, at.g, q)?;
                if self.memory.store(env, d, t, q)? {
                    let starts = &self.preconditioner.starts;
                    let change = self.memory.newest(env, starts)?;
                    let own = self.projected.iter_mut();
                    own.zip(change).for_each(|(own, change)| *own += change);
                } else {
                    self.is_projected = false;
                }
                std::mem::swap(at.g, g_new);
                at.det = det;
                at.sunk_mm = (way >= 1.0).then_some(left);
                better = true;
                if t < 1.0 {
                    problem.blend(t);
                }
                break;
            }
            let spent = attempt > 1 && is_spent(input, problem, report, input.enough.iterations);
            if attempt == SHORTENINGS || spent || slope >= 0.0 {
                problem.undo();
                self.memory.clear();
                break;
            }
            t *= if keeps && slope_new.is_finite() {
                (-slope / (slope_new - slope)).clamp(0.1, 0.5) as f32
            } else {
                0.5
            };
        }
        Ok(better)
    }
}

/// Work of the tools' loads over a field, nJ.
fn work(problem: &ContactProblem, d: &[f32]) -> f64 {
    let mut sum = 0.0f64;
    problem.each_load(|node, force| {
        let at = 3 * node as usize;
        for (d, f) in d[at..at + 3].iter().zip(force.to_array()) {
            sum += 1e3 * f64::from(*d) * f64::from(f);
        }
    });
    sum
}
