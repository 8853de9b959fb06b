//! A step that tools drive, made of shorter ones: where one of the scene's length leaves out more than the target allows, no iteration brings
//! that back, and a tool on the verge of slipping takes another way.
//!
//! The first substep starts from the last two states and their velocities, by the cubic through them, and without L-BFGS pairs.
//! So what lasts from step to step is the same with substeps and without, in snapshots too.

use std::sync::Arc;

use ::contact::{Pose, pose};

use super::input::{Input, Lent, Report};
use super::motion::Motion;
use super::pace::Pace;
use super::precondition::Preconditioner;
use super::stage::Stage;
use crate::contact::{Delassus, MAX_TOOLS, Past, Problem, Tool};
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the substeps of a scene";

/// What a scene has for them, made at its first contact.
pub struct Substeps {
    count: u32,
    /// A step is made of substeps where it leaves out more than this, mm, before the bundle's calibration.
    limit_mm: f32,
    pace: Arc<Pace>,
    preconditioner: Preconditioner,
    responses: Delassus,
    motion: Motion,
    /// The states that a substep starts from, the last and the one before, and where it ends.
    last: Vec<f32>,
    before: Vec<f32>,
    next: Vec<f32>,
    /// Contact at the start of the step, the tools at its end, where they came from, and where they are.
    past: Past,
    tools: Vec<Tool>,
    from: Vec<Pose>,
    on_their_way: Vec<Tool>,
    torn: [bool; MAX_TOOLS],
}

impl Substeps {
    /// `count` of them to a step of `lent`, of the length of `pace`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(lent: Lent<'_>, pace: Arc<Pace>, count: u32, limit_mm: f32) -> Result<Substeps> {
        let len = 3 * lent.corrections.body.mass.len();
        let field = || memory::zeros(len, WHAT);
        let short = Lent {
            pace: &pace,
            ..lent
        };
        Ok(Substeps {
            count,
            limit_mm,
            preconditioner: Preconditioner::new(short.env())?,
            pace,
            responses: Delassus::default(),
            motion: Motion::at_rest(len)?,
            last: field()?,
            before: field()?,
            next: field()?,
            past: Past::with_room(1024)?,
            tools: memory::room(MAX_TOOLS, WHAT)?,
            from: memory::room(MAX_TOOLS, WHAT)?,
            on_their_way: memory::room(MAX_TOOLS, WHAT)?,
            torn: [false; MAX_TOOLS],
        })
    }

    /// Whether a step that leaves out so much is to be made of substeps, mm.
    fn helps(&self, left_out_mm: f32) -> bool {
        left_out_mm > self.limit_mm
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let fields = 3 * self.last.len() + 3 * self.motion.velocity.len();
        let tools = self.tools.capacity() + self.on_their_way.capacity();
        4 * fields
            + self.pace.memory_bytes()
            + self.preconditioner.memory_bytes()
            + self.responses.memory_bytes()
            + self.past.memory_bytes()
            + size_of::<Tool>() * tools
            + size_of::<Pose>() * self.from.capacity()
    }

    /// The state a substep before `input.last`, and the velocity there: the cubic through two states `step_s` apart.
    fn start(&mut self, whole: &Motion, input: &Input<'_>, step_s: f32) {
        self.motion.take(whole);
        self.last.copy_from_slice(input.last);
        let s = 1.0 - 1.0 / self.count as f32;
        let (s2, s3) = (s * s, s * s * s);
        let place = [
            2.0 * s3 - 3.0 * s2 + 1.0,
            3.0 * s2 - 2.0 * s3,
            step_s * (s3 - 2.0 * s2 + s),
            step_s * (s3 - s2),
        ];
        let speed = [
            6.0 * (s2 - s) / step_s,
            6.0 * (s - s2) / step_s,
            3.0 * s2 - 4.0 * s + 1.0,
            3.0 * s2 - 2.0 * s,
        ];
        for (i, before) in self.before.iter_mut().enumerate() {
            let known = [
                input.before[i],
                input.last[i],
                whole.velocity_before[i],
                whole.velocity[i],
            ];
            let at = |weights: &[f32; 4]| -> f32 {
                let products = weights.iter().zip(&known);
                products.map(|(weight, value)| weight * value).sum()
            };
            *before = at(&place);
            self.motion.velocity_before[i] = at(&speed);
        }
    }
}

impl Stage {
    /// Makes the step from `input.last` that the tools of `problem` cause, and tells them what they feel; of substeps where that is called
    /// for: by what the last step left out, or else by what this one does.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`], a panic on another thread of the pool; the past of stage and problem stays.
    pub fn drive(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        problem: &mut Problem,
        substeps: Option<&mut Substeps>,
        next: &mut [f32],
    ) -> Result<Report> {
        let Some(substeps) = substeps else {
            return self.correct_loaded(lent, input, problem, next);
        };
        if substeps.helps(self.motion.truncated_mm) {
            return self.drive_substeps(lent, input, problem, substeps, next);
        }
        let whole = self.correct_loaded(lent, input, problem, next)?;
        if !substeps.helps(self.next.truncated_mm.hypot(whole.remaining_mm)) {
            return Ok(whole);
        }
        let parts = self.drive_substeps(lent, input, problem, substeps, next)?;
        Ok(whole.and(&parts))
    }

    fn drive_substeps(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        problem: &mut Problem,
        substeps: &mut Substeps,
        next: &mut [f32],
    ) -> Result<Report> {
        substeps.start(&self.motion, input, lent.pace.integrator.step_s as f32);
        substeps.past.take(&problem.past);
        substeps.tools.clear();
        substeps.tools.extend_from_slice(problem.tools());
        substeps.from.clear();
        substeps.from.extend_from_slice(problem.before());
        std::mem::swap(&mut self.motion, &mut substeps.motion);
        std::mem::swap(&mut self.preconditioner, &mut substeps.preconditioner);
        problem.exchange(&mut substeps.responses);
        let result = self.each_substep(lent, input, problem, substeps);
        std::mem::swap(&mut self.preconditioner, &mut substeps.preconditioner);
        problem.exchange(&mut substeps.responses);
        std::mem::swap(&mut self.motion, &mut substeps.motion);
        // The pairs are those of shorter steps.
        self.memory.begin();
        problem.past.take(&substeps.past);
        let report = result?;
        next.copy_from_slice(&substeps.last);
        // What a whole step would have left out, for the choice of the next; the rest is that of the last substep.
        self.finish(lent, input, next)?;
        let (own, last) = (&mut self.next, &substeps.motion);
        own.velocity.copy_from_slice(&last.velocity);
        own.inertia.copy_from_slice(&last.inertia);
        own.min_det = last.min_det;
        own.error_mm = last.error_mm;
        Ok(report)
    }

    fn each_substep(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        problem: &mut Problem,
        substeps: &mut Substeps,
    ) -> Result<Report> {
        let Substeps {
            count,
            pace,
            last,
            before,
            next,
            tools,
            from,
            on_their_way,
            torn,
            ..
        } = substeps;
        let short = Lent { pace, ..lent };
        let mut told: Option<Report> = None;
        torn.fill(false);
        self.memory.clear();
        for part in 1..=*count {
            let way = part as f32 / *count as f32;
            on_their_way.clear();
            on_their_way.extend_from_slice(tools);
            for (tool, from) in on_their_way.iter_mut().zip(&*from) {
                tool.pose = pose::between(from, &tool.pose, way);
            }
            problem.enter(on_their_way, input.rest, last)?;
            let own = Input {
                last,
                before,
                ..*input
            };
            let report = self.make_loaded(short, &own, problem, next, |_| ())?;
            for (torn, held) in torn.iter_mut().zip(&mut problem.next.tools) {
                *torn |= held.reading.torn;
                held.reading.torn = *torn;
            }
            std::mem::swap(&mut self.motion, &mut self.next);
            if part < *count {
                problem.commit();
            }
            std::mem::swap(before, last);
            std::mem::swap(last, next);
            told = Some(told.map_or(report, |told| told.and(&report)));
        }
        let told = told.unwrap_or_default();
        Ok(Report {
            substeps: *count,
            ..told
        })
    }
}
