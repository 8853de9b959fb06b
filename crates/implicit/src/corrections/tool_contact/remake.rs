//! A step that tools drive, made again where its end calls for it: a tool that no single step follows stops on its way, a grasp tears off, ties break.

use super::ToolStep;
use crate::contact::ContactProblem;
use crate::corrections::input::{Input, Report, SolverContext};
use crate::corrections::solver::ImplicitSolver;
use crate::error::Result;

/// Where broad tools stop that thrust farther than the step can follow, in half thicknesses from where they were.
const STOPS: [f32; 2] = [0.8, 0.0];

/// How often a step is made again because ties break; what is pulled too hard then breaks in the
/// next. It bounds the work of a step in which a whole seam rips.
const MOST_BREAKS: u32 = 6;

/// Makes the step from `input.last` that the tools of `problem` cause, and tells them what they feel; from the pairs of the last published state, or
/// from those that there are. It is made once more where a grasp tears off, which then holds nothing at the end, and where ties break.
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
        guessed_from_rest: false,
        report: Report::default(),
    };
    let _awake = context.pool.keep_awake();
    if step.must_be_sound() {
        step.problem.work.unbound();
    }
    step.problem.work.attempt(true);
    step.balance_loaded(next, from_published, true)?;
    step.problem.work.attempt(false);
    // Tools that no single step follows stop on their way, at last where they were; beside one that was put elsewhere they do so at once, and where a budget of
    // time is over.
    let at_once = step.problem.ways.has_leapt || step.problem.work.is_late();
    for thicknesses in &STOPS[usize::from(at_once)..] {
        if !(step.problem.ways).has_passed(
            &step.problem.past,
            &step.problem.next,
            step.report.fell_back,
        ) {
            break;
        }
        (step.problem.ways).stop_after(&step.problem.past, &mut step.problem.next, *thicknesses);
        step.problem.work.renew();
        step.balance_loaded(next, from_published, true)?;
    }
    if step.problem.next.tears() {
        step.balance_loaded(next, from_published, true)?;
    }
    // Each time those break that bear least of what they are pulled with.
    let mut left = MOST_BREAKS;
    while step.problem.tied.broke {
        left -= 1;
        step.balance_loaded(next, from_published, left > 0)?;
    }
    step.problem.ways.tell_lag(&mut step.problem.next);
    Ok(step.report)
}
