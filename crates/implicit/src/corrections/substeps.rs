//! A step that tools drive, made of shorter ones: where one of the scene's length leaves out more than the target allows, no iteration brings
//! that back, and a tool on the verge of slipping takes another way.

use ::contact::{Pose, Vector, pose};

use super::input::{Enough, Input, Report, SolverContext};
use super::load::part_of;
use super::solver::{ImplicitSolver, SMALLEST_DET};
use super::substepper::Substepper;
use super::tool_contact::make_loaded;
use crate::contact::{
    ContactProblem, Delassus, MAX_TIES, MAX_TOOLS, Past, Placed, Tool, bound_work,
};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the substeps of a scene";
/// Iterations of a substep at most, after one that has lost the contact: more of them would lose it
/// again.
const ONCE_LOST: u32 = 2;

/// What contact has in them, made at the first.
#[derive(HeldBytes)]
pub struct Substeps {
    /// A step is made of substeps where it leaves out more than this, mm, before the bundle's calibration.
    limit_mm: f32,
    /// Responses of the contact at the substeps' length, kept apart from those of whole steps: both stay known.
    responses: Delassus,
    /// Contact at the start of the step: it comes back when the parts are done, for the host has seen no other.
    past: Past,
    /// Where they are in each part.
    tools: ToolsOnTheirWay,
    /// Where their far ends are in each part.
    ties: TiesOnTheirWay,
}

/// The tools of the step, in the host's order.
#[derive(HeldBytes)]
struct ToolsOnTheirWay {
    /// At the end of the step.
    end: Vec<Tool>,
    /// Where each was at its start.
    from: Vec<Pose>,
    /// Where they are at the end of the part being made: on a straight line, turned about one axis.
    now: Vec<Tool>,
    /// Whose grasp has torn off in a part so far.
    torn: [bool; MAX_TOOLS],
}

/// The ties of the step, and their far ends, mm.
#[derive(HeldBytes)]
struct TiesOnTheirWay {
    /// At the end of the step.
    end: Vec<Placed>,
    /// Where each far end was at its start.
    from: Vec<Vector>,
    /// At the end of the part being made.
    now: Vec<Placed>,
    /// Which have broken in a part so far.
    broke: [bool; MAX_TIES],
}

impl Substeps {
    /// Of steps that leave out more than `limit_mm`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(limit_mm: f32) -> Result<Substeps> {
        Ok(Substeps {
            limit_mm,
            responses: Delassus::default(),
            past: Past::with_room(1024)?,
            tools: ToolsOnTheirWay {
                end: memory::room(MAX_TOOLS, WHAT)?,
                from: memory::room(MAX_TOOLS, WHAT)?,
                now: memory::room(MAX_TOOLS, WHAT)?,
                torn: [false; MAX_TOOLS],
            },
            ties: TiesOnTheirWay {
                end: Vec::new(),
                from: Vec::new(),
                now: Vec::new(),
                broke: [false; MAX_TIES],
            },
        })
    }

    /// Whether a step with an error of this size from its length is made of substeps, mm.
    fn helps(&self, left_out_mm: f32) -> bool {
        left_out_mm > self.limit_mm
    }
}

impl ImplicitSolver {
    /// Makes the step from `input.last` that the tools of `problem` cause, and tells them what they feel; of substeps where that is called
    /// for: by what the last step left out, or else by what this one does.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`], a panic on another thread of the pool; the past of solver and problem stays.
    pub fn drive(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        substeps: Option<(&mut Substeps, &mut Substepper)>,
        next: &mut [f32],
    ) -> Result<Report> {
        problem.work.end_by(input.enough.until);
        // From an inverted state a step begins at rest, and so would each of its parts.
        let lost = self.motion.min_det < SMALLEST_DET;
        bound_work(problem, input.rest, input.last, lost);
        let _awake = context.pool.keep_awake();
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.remember(context, input, false, &mut self.balance.scratch)?;
        }
        let Some((substeps, substepper)) = substeps else {
            return make_loaded(self, context, input, problem, next, true);
        };
        // Nor does a step help in parts whose work is bounded as a whole.
        let is_bounded = problem.work.is_bounded();
        if substeps.helps(self.motion.truncated_mm) && !lost && !is_bounded {
            return substeps.drive(self, context, input, problem, substepper, next);
        }
        let whole = make_loaded(self, context, input, problem, next, true)?;
        // Where the iterations have lost the contact they would lose it again.
        let helps = substeps.helps(libm::hypotf(self.next.truncated_mm, whole.remaining_mm));
        if whole.fell_back || !helps || is_bounded {
            return Ok(whole);
        }
        // A tool that the whole step stopped on its way is where the host has put it again.
        problem.ways.aim();
        let parts = substeps.drive(self, context, input, problem, substepper, next)?;
        Ok(whole.and(&parts))
    }
}

impl Substeps {
    /// The step in parts: the solver and the contact change over to the shorter step's coefficients, make the parts, and change back.
    /// What the host sees of it is one step: the pasts of before it come back, and the last part's end is the step's.
    fn drive(
        &mut self,
        solver: &mut ImplicitSolver,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        substepper: &mut Substepper,
        next: &mut [f32],
    ) -> Result<Report> {
        if let Some(relaxing) = &mut solver.relaxing {
            relaxing.remember(context, input, true, &mut solver.balance.scratch)?;
        }
        substepper.start(
            &solver.motion,
            input,
            context.time_step.integrator.step_s as f32,
        )?;
        self.past.take(&problem.past)?;
        self.tools.end.clear();
        self.tools.end.extend_from_slice(&problem.ways.tools);
        self.tools.from.clear();
        self.tools.from.extend_from_slice(&problem.ways.before);
        memory::replace(&mut self.ties.end, &problem.tied.list, WHAT)?;
        memory::replace(&mut self.ties.from, &problem.tied.from, WHAT)?;
        memory::fit(&mut self.ties.now, self.ties.end.len(), WHAT)?;
        substepper.exchange(solver);
        problem.solution.responses.exchange(&mut self.responses);
        // Solver and contact have the shorter steps' diagonal, pasts and responses between these two exchanges, and their own again after them, also where it fails.
        let result = self.each_substep(solver, context, input, problem, substepper);
        substepper.exchange(solver);
        problem.solution.responses.exchange(&mut self.responses);
        solver.end_substeps();
        std::mem::swap(&mut problem.past, &mut self.past);
        let report = result?;
        substepper.arrive(solver, context, input, next)?;
        Ok(report)
    }

    /// The parts one after the other: tools and ties at their places of the way, the loads of the part, and the forces that the part before ended with.
    fn each_substep(
        &mut self,
        solver: &mut ImplicitSolver,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        substepper: &mut Substepper,
    ) -> Result<Report> {
        let (tools, ties) = (&mut self.tools, &mut self.ties);
        let count = substepper.count();
        let mut told = Report::default();
        let mut lost = false;
        tools.torn.fill(false);
        ties.broke.fill(false);
        // Those of another length of step: their curvature has another inertia in it.
        solver.begin_pairs();
        solver.clear_pairs();
        for part in 1..=count {
            let way = part as f32 / count as f32;
            tools.now.clear();
            tools.now.extend_from_slice(&tools.end);
            for (tool, from) in tools.now.iter_mut().zip(&tools.from) {
                tool.pose = pose::between(from, &tool.pose, way);
            }
            ties.now.clear();
            ties.now.extend_from_slice(&ties.end);
            for (tied, from) in ties.now.iter_mut().zip(&ties.from) {
                tied.place = *from + (tied.place - *from) * way;
            }
            let Substepper {
                time_step,
                last,
                before,
                next,
                ..
            } = &mut *substepper;
            // A substep is a step to the contact: it goes on from the forces of the one before.
            problem.enter(&tools.now, &ties.now, input.rest, last)?;
            let short = SolverContext {
                time_step,
                ..context
            };
            let most = if lost { ONCE_LOST } else { u32::MAX };
            let enough = Enough {
                iterations: input.enough.iterations.min(most),
                ..input.enough
            };
            let own = Input {
                last,
                before,
                enough,
                load: input.load.map(|load| load.of_part(part, count)),
                way: part_of(part, count),
                ..*input
            };
            let report = make_loaded(solver, short, &own, problem, next, false)?;
            for (torn, held) in tools.torn.iter_mut().zip(&mut problem.next.tools) {
                *torn |= held.reading.torn;
                held.reading.torn = *torn;
            }
            for (broke, held) in ties.broke.iter_mut().zip(&mut problem.next.ties) {
                *broke |= held.reading.broke;
                held.reading.broke = *broke;
            }
            std::mem::swap(&mut solver.motion, &mut solver.next);
            // The last one is published by the scene, or not.
            if part < count {
                problem.commit();
            }
            substepper.advance();
            lost |= report.fell_back;
            told = told.and(&report);
        }
        Ok(Report {
            substeps: count,
            ..told
        })
    }
}
