//! A step that tools drive, made again where its end calls for it: a tool that no single step follows stops on its way, a grasp tears off, ties break.

use super::{ToolStep, state};
use crate::contact::ContactProblem;
use crate::corrections::input::{Input, Report, SolverContext};
use crate::corrections::solver::ImplicitSolver;
use crate::error::Result;

/// Where broad tools stop that thrust farther than the step can follow, in half thicknesses from where they were.
const STOPS: [f32; 2] = [0.8, 0.0];

/// How often a step is made again because ties break; what is pulled too hard then breaks in the next.
const MOST_BREAKS: u32 = 6;

/// Makes the step from `input.last` that the tools of `problem` cause, and tells them what they feel; from the pairs of the last published state, or
/// from those that there are.
pub(in crate::corrections) fn make_loaded(
    solver: &mut ImplicitSolver,
    context: SolverContext<'_>,
    input: &Input<'_>,
    problem: &mut ContactProblem,
    next: &mut [f32],
    from_published: bool,
) -> Result<Report> {
    let mut step = ToolStep {
        solver,
        context,
        input,
        problem,
        report: Report::default(),
    };
    step.make(next, from_published)
}

impl ToolStep<'_> {
    /// Makes the step with the pairs of the last published state, or with those that there are; once more where a grasp tears off, which then holds nothing
    /// at the end, and where ties break.
    fn make(&mut self, next: &mut [f32], from_published: bool) -> Result<Report> {
        let _awake = self.context.pool.keep_awake();
        self.make_once(next, from_published, true)?;
        // Tools that no single step follows stop on their way, at last where they were; beside one that was put elsewhere they do so at once.
        let first = usize::from(self.problem.ways.has_leapt);
        for thicknesses in &STOPS[first..] {
            if !(self.problem.ways).has_passed(
                &self.problem.past,
                &self.problem.next,
                self.report.fell_back,
            ) {
                break;
            }
            (self.problem.ways).stop_after(
                &self.problem.past,
                &mut self.problem.next,
                *thicknesses,
            );
            self.problem.work.renew();
            self.make_once(next, from_published, true)?;
        }
        if self.problem.next.tears() {
            self.make_once(next, from_published, true)?;
        }
        // Each time those break that bear least of what they are pulled with.
        let mut left = MOST_BREAKS;
        while self.problem.tied.broke {
            left -= 1;
            self.make_once(next, from_published, left > 0)?;
        }
        self.problem.ways.tell_lag(&mut self.problem.next);
        Ok(self.report)
    }

    /// A step with the tools where they are now, from the pairs of the last published state or from those that there are; ties may break.
    fn make_once(&mut self, next: &mut [f32], from_published: bool, breaks: bool) -> Result<()> {
        if from_published {
            self.solver.begin_pairs();
        }
        // The problem's `past` and the solver's `motion` are those of the last published step: an attempt leaves both as they were.
        self.balance_loaded(next)?;
        self.problem.finish(state(self.input, next), breaks);
        Ok(())
    }
}
