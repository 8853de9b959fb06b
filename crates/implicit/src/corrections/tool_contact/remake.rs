//! A step that tools drive, made again where its end calls for it: a tool that no single step follows stops on its way, a grasp tears off, ties break.

use super::state;
use crate::contact::ContactProblem;
use crate::corrections::input::{Input, Report, SolverContext};
use crate::corrections::solver::ImplicitSolver;
use crate::error::Result;

/// Where broad tools stop that thrust farther than the step can follow, in half thicknesses from where they were.
const STOPS: [f32; 2] = [0.8, 0.0];

/// How often a step is made again because ties break; what is pulled too hard then breaks in the next.
const MOST_BREAKS: u32 = 6;

impl ImplicitSolver {
    /// Makes the step from `input.last` that the tools of `problem` cause, and tells them what they feel.
    pub(in crate::corrections) fn correct_loaded(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        next: &mut [f32],
    ) -> Result<Report> {
        self.make_loaded(context, input, problem, next, true)
    }

    /// The same with the pairs of the last published state, or with those that there are; once more where a grasp tears off, which then holds nothing at the end,
    /// and where ties break.
    pub(in crate::corrections) fn make_loaded(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        next: &mut [f32],
        from_published: bool,
    ) -> Result<Report> {
        let _awake = context.pool.keep_awake();
        let mut report = self.make_once(context, input, problem, next, from_published, true)?;
        // Tools that no single step follows stop on their way, at last where they were; beside one that was put elsewhere they do so at once.
        let first = usize::from(problem.ways.has_leapt);
        for thicknesses in &STOPS[first..] {
            if !(problem.ways).has_passed(&problem.past, &problem.next, report.fell_back) {
                break;
            }
            (problem.ways).stop_after(&problem.past, &mut problem.next, *thicknesses);
            problem.work.renew();
            report = self.make_once(context, input, problem, next, from_published, true)?;
        }
        if problem.next.tears() {
            report = self.make_once(context, input, problem, next, from_published, true)?;
        }
        // Each time those break that bear least of what they are pulled with.
        let mut left = MOST_BREAKS;
        while problem.tied.broke {
            left -= 1;
            report = self.make_once(context, input, problem, next, from_published, left > 0)?;
        }
        problem.ways.tell_lag(&mut problem.next);
        Ok(report)
    }

    /// A step with the tools where they are now, from the pairs of the last published state or from those that there are; ties may break.
    fn make_once(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        next: &mut [f32],
        from_published: bool,
        breaks: bool,
    ) -> Result<Report> {
        if from_published {
            self.begin_pairs();
        }
        let report = self.balance_loaded(context, input, problem, next)?;
        problem.finish(state(input, next), breaks);
        Ok(report)
    }
}
