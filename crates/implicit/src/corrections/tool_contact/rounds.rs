//! The iterations of a step, in rounds: each from a base whose residual is known everywhere.

use super::thrown::has_thrown;
use super::{Iterate, KEPT_MM, SUNK_MM, ToolStep, is_sound, is_spent, state};
use crate::contact::ContactProblem;

use crate::corrections::estimate::{EXCUSED, EXCUSED_IN_CUT};
use crate::corrections::input::Input;
use crate::corrections::local::{Base, LocalSolver, StepContext};
use crate::corrections::solver::SMALLEST_DET;
use crate::error::Result;
use crate::memory;

/// A needle, whose tip slides to other tissue, may be left so deep, mm; and so deep by a short part of a direction, which else would lead nowhere.
const KEPT_THIN_MM: f32 = 0.28 * SUNK_MM;
const KEPT_THIN_SHORT_MM: f32 = 1.12 * KEPT_THIN_MM;
/// A part of a direction is short below this.
const SHORT: f32 = 0.25;
/// Iterations from one base at most: the far field is that of the base, in all but its clusters,
/// and falls behind as the modes move.
const ROUND: u32 = 16;

/// Whole modes may move the tissue so far after the iterations without an evaluation of what that leaves, mm.
const FAR_MM: f32 = 0.2;
/// Where an iteration's smallest det F is below this, all elements are evaluated once more where it ends; and where a far node has gone
/// farther than this since the base, mm: of the far elements the iterations know the mean of their clusters alone.
const LOOKED_AT_DET: f32 = 0.5;
const LOOKED_AT_MM: f32 = 2.0;

/// What the iterations of a step have made.
#[derive(Default)]
struct Made {
    /// In all rounds.
    iterations: u32,
    /// One after another that led nowhere.
    failed: u32,
    /// `|r - loads|` near the tools before the first iteration and now, µN.
    start: f64,
    size: f64,
    /// The last round ended because nothing more is asked for, and not because its base is used up.
    is_enough: bool,
}

impl ToolStep<'_> {
    /// The iterations from a guess; returns the length of what they left unbalanced near the tools, without bounds where they have thrown the tissue.
    pub(super) fn improve_loaded(&mut self, at: &mut Iterate<'_>) -> Result<f64> {
        let mut made = Made::default();
        if at.det < SMALLEST_DET {
            self.report.residual = 1.0;
            return Ok(f64::INFINITY);
        }
        let work = &self.problem.work;
        // A near set is not begun with less than half of the work of a step that is bounded.
        if work.is_spent() || work.is_short() {
            // No iteration would begin, and its base takes as long as several.
            self.report.residual = 1.0;
            return Ok(0.0);
        }
        // A round is a base, its iterations, and the field decoded at their end.
        loop {
            self.begin_round(at)?;
            self.improve_round(at, &mut made)?;
            self.end_round(at)?;
            let most = self.input.enough.iterations;
            // A tool that was put elsewhere comes out of the tissue over a few steps: none of them is worth another base.
            let is_last = made.iterations >= most || self.problem.ways.has_leapt;
            if made.is_enough || is_last || self.problem.work.is_spent() {
                break;
            }
            self.evaluate(at)?;
        }
        // What the far elements really have is asked of them where the means may hide it.
        let far_moved_mm = self
            .solver
            .local
            .as_ref()
            .map_or(0.0, |local| local.measured.far_moved_mm);
        if at.det < LOOKED_AT_DET || far_moved_mm > LOOKED_AT_MM {
            self.evaluate(at)?;
        }
        self.report.residual = (made.size / made.start.max(f64::MIN_POSITIVE)) as f32;
        if let Some(local) = &self.solver.local {
            self.report.far_mm = local.measured.far_mm;
            // What a leap does to the far nodes says nothing of the reach.
            if !self.problem.ways.has_leapt {
                self.report.extent = local.next_extent(at.u);
            }
        }
        match has_thrown(self.problem, [made.start, made.size]) {
            true => Ok(f64::INFINITY),
            false => Ok(made.size),
        }
    }

    /// Iterations from one base.
    fn improve_round(&mut self, at: &mut Iterate<'_>, made: &mut Made) -> Result<()> {
        made.size = self.unbalanced()?;
        if made.iterations == 0 {
            made.start = made.size;
        }
        let first = made.iterations;
        // Every way out of the loop means that no further round is asked for, but for one: the base is used up.
        made.is_enough = true;
        while made.iterations < self.input.enough.iterations {
            let spent = is_spent(
                self.input,
                self.problem,
                &self.report,
                self.input.enough.iterations,
            );
            // The host's budget of time ends it too; where it has none, only counted work does, and the bits are the same on every machine.
            let spent = self.problem.work.is_spent() || (made.iterations > 0 && spent);
            if spent || !is_sound(made.size, at.det) {
                return Ok(());
            }
            let better = self.improve_at(at, 1.0)?;
            self.report.effort.iterations += 1;
            made.iterations += 1;
            // A failure forgets the pairs, so that the next direction is another one: where that fails too, nothing helps. Where it is dear
            // none is worth a second one.
            made.failed = if better { 0 } else { made.failed + 1 };
            let is_dear =
                (self.solver.local.as_ref()).is_some_and(|local| local.is_dear(self.problem));
            if made.failed > u32::from(!is_dear) {
                return Ok(());
            }
            // What is left to go: the last move, less by as much as the residual is, as if the moves were a geometric series.
            let before = made.size;
            made.size = self.unbalanced()?;
            let moved = f64::from(
                self.solver
                    .local
                    .as_ref()
                    .map_or(0.0, |local| local.measured.moved_mm),
            );
            self.report.remaining_mm = (moved * made.size / before.max(f64::MIN_POSITIVE)) as f32;
            let excused = match self.context.corrections.changed.is_empty() {
                true => EXCUSED,
                false => EXCUSED_IN_CUT,
            };
            if self.solver.motion.suffices(
                made.iterations,
                self.report.remaining_mm,
                self.input.enough,
                excused,
            ) {
                return Ok(());
            }
            // Tools that slide out of the inside nodes push on what the iterations know from the modes alone.
            let holds = (self.solver.local.as_ref())
                .is_none_or(|local| local.holds_loads(self.problem, &self.context.env().held.is));
            if !holds || made.iterations - first == ROUND {
                made.is_enough = false;
                return Ok(());
            }
        }
        Ok(())
    }

    /// Makes `at` the base of local iterations.
    pub(super) fn begin_round(&mut self, at: &Iterate<'_>) -> Result<()> {
        let env = self.context.env();
        // The reach of the published state, not of the round before: a step that is made again reaches as far.
        let moves_all = self.context.moves_all(self.input);
        let extent = self.solver.motion.reach(moves_all);
        let (local, mut step, problem) = self.local_solver()?;
        let nodes = problem.reached(&env.held.is);
        local.reach.extent = extent;
        memory::replace(&mut local.reach.touched, nodes, "local iterations")?;
        let base = Base {
            u: at.u,
            residual: at.g,
        };
        local.begin(&mut step, base)?;
        problem
            .work
            .take_base(std::mem::take(&mut local.measured.work));
        Ok(())
    }

    /// The state of the iterations into `at`, whose residual is not known then.
    /// `at.g` is that of the base still: whoever needs the residual evaluates.
    pub(super) fn end_round(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        // What loads do far from the tools is not in the span of the iterations. What has been let go has moved before them, and is near.
        let is_loaded = self.input.load.is_some() && self.context.held.let_go == 0;
        let with_whole = is_loaded && self.ask_whole(at)? <= FAR_MM;
        let mut q = std::mem::take(&mut self.solver.fields.q);
        let (local, mut step, _) = self.local_solver()?;
        // Here the base, `t` and the modes become one field again.
        let result = local.settle(&mut step, at.g, (&mut q, at.u), with_whole);
        self.solver.fields.q = q;
        result?;
        match is_loaded && !with_whole {
            true => self.move_whole(at, FAR_MM),
            false => Ok(()),
        }
    }

    /// One local iteration with the tools at part `way` of their way; tells whether it leads to another state.
    pub(super) fn improve_at(&mut self, at: &mut Iterate<'_>, way: f32) -> Result<bool> {
        let input = self.input;
        let (local, mut step, problem) = self.local_solver()?;
        let over =
            |problem: &mut ContactProblem, u: &[f32], t| over_kept(input, problem, u, (way, t));
        let is_better = local.improve(&mut step, problem, at.u, way, over)?;
        problem
            .work
            .take_whole(std::mem::take(&mut local.measured.work));
        if is_better {
            at.det = local.measured.det;
        }
        Ok(is_better)
    }

    /// What is out of balance near the tools.
    fn unbalanced(&mut self) -> Result<f64> {
        match &mut self.solver.local {
            Some(local) => local.unbalanced(self.problem),
            None => Ok(0.0),
        }
    }

    /// What iterates near the tools, what it is lent, and the tools' contact.
    fn local_solver(&mut self) -> Result<(&mut LocalSolver, StepContext<'_>, &mut ContactProblem)> {
        let solver = &mut *self.solver;
        let local = LocalSolver::made(&mut solver.local, self.context)?;
        let step = StepContext {
            context: self.context,
            input: self.input,
            preconditioner: &mut solver.preconditioner,
            scratch: &mut solver.balance.scratch,
            drift: &solver.balance.drift,
        };
        Ok((local, step, self.problem))
    }
}

/// How deep tissue `u` and the tools lie in each other, at part `way` of their way, over what part `t` of an iteration's direction may leave; without bounds
/// where forces are no contact.
fn over_kept(
    input: &Input<'_>,
    problem: &mut ContactProblem,
    u: &[f32],
    (way, t): (f32, f32),
) -> f32 {
    let thin = if t < SHORT {
        KEPT_THIN_SHORT_MM
    } else {
        KEPT_THIN_MM
    };
    let kept = [KEPT_MM, thin];
    match problem.next.is_wedged(&problem.past) {
        true => f32::MAX,
        false => problem.depths().over(state(input, u), way, kept),
    }
}
