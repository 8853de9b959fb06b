//! Substeps: several make one step of the scene, between two states that the host sees.
//!
//! The first starts from the last two states and their velocities, by the cubic through them, and without L-BFGS pairs. So what lasts from
//! step to step is the same with them and without, in snapshots too.

use std::mem::swap;
use std::sync::Arc;

use super::input::{Enough, Input, Report, SolverContext};
use super::load::part_of;
use super::motion::Motion;
use super::oscillators::Oscillators;
use super::precondition::Preconditioner;
use super::relax::FieldStep;
use super::solver::ImplicitSolver;
use super::time_step::TimeStep;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Iterations that a free step gets at least: after one alone, what it leaves grows from step to step.
const LEAST_SWING: u32 = 2;

/// What a scene has for them.
#[derive(HeldBytes)]
pub struct Substepper {
    /// Shorter steps in one of the scene.
    count: u32,
    #[held(own)]
    /// Of their length; scenes of a model with the same count share it.
    pub(super) time_step: Arc<TimeStep>,
    /// From here to `motion`: those of shorter steps while whole ones are made, and the other way round; see [`Substepper::exchange`].
    preconditioner: Preconditioner,
    free: Oscillators,
    pub(super) motion: Motion,
    /// The states that one starts from, the last and the one before, and where it ends.
    pub(super) last: Vec<f32>,
    pub(super) before: Vec<f32>,
    pub(super) next: Vec<f32>,
}

impl Substepper {
    /// `count` of them to a step of `context`, of the length of `time_step`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(
        context: SolverContext<'_>,
        time_step: Arc<TimeStep>,
        count: u32,
    ) -> Result<Substepper> {
        let len = 3 * context.corrections.body.mass.len();
        let field = || memory::zeros(len, "the substeps of a scene");
        let short = SolverContext {
            time_step: &time_step,
            ..context
        };
        Ok(Substepper {
            count,
            preconditioner: Preconditioner::new(short.env())?,
            time_step,
            free: Oscillators::default(),
            motion: Motion::at_rest(len)?,
            last: field()?,
            before: field()?,
            next: field()?,
        })
    }

    /// How many make a step.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The state a shorter step before `input.last`, and the velocity there: the cubic through two states `step_s` apart.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn start(&mut self, whole: &Motion, input: &Input<'_>, step_s: f32) -> Result<()> {
        self.motion.take(whole)?;
        self.last.copy_from_slice(input.last);
        if input.still {
            self.motion.velocity.fill(0.0);
            self.motion.velocity_before.fill(0.0);
            self.before.copy_from_slice(input.last);
            return Ok(());
        }
        // Hermite's cubic on the last step, at the part `s` of it: weights of the two places and the two velocities.
        // One shorter step before the end: where BDF2 of that length wants its state before the last.
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
        Ok(())
    }

    /// The end of a step becomes the start of the next.
    pub(super) fn advance(&mut self) {
        swap(&mut self.before, &mut self.last);
        swap(&mut self.last, &mut self.next);
    }

    /// The solver makes shorter steps from here on; or whole ones again.
    pub(super) fn exchange(&mut self, solver: &mut ImplicitSolver) {
        swap(&mut solver.motion, &mut self.motion);
        swap(&mut solver.preconditioner, &mut self.preconditioner);
        swap(&mut solver.free, &mut self.free);
    }

    /// Takes the end of the last shorter step as that of the step from `input.last`.
    pub(super) fn arrive(
        &self,
        solver: &mut ImplicitSolver,
        context: SolverContext<'_>,
        input: &Input<'_>,
        next: &mut [f32],
    ) -> Result<()> {
        next.copy_from_slice(&self.last);
        // What a whole step would have left out, for the choice of the next; the rest is that of the last shorter one.
        // `input` is that of the whole step: its second differences are over the whole length.
        solver.finish(context, input, next)?;
        let (own, last) = (&mut solver.next, &self.motion);
        own.velocity.copy_from_slice(&last.velocity);
        own.inertia.copy_from_slice(&last.inertia);
        own.min_det = last.min_det;
        own.extent = last.extent;
        own.error_mm = last.error_mm;
        Ok(())
    }

    /// The parts of a free step one after the other, each from the end of the one before.
    fn swing_each(
        &mut self,
        solver: &mut ImplicitSolver,
        context: SolverContext<'_>,
        input: &Input<'_>,
    ) -> Result<Report> {
        let mut told = Report::default();
        for part in 1..=self.count {
            let short = SolverContext {
                time_step: &self.time_step,
                ..context
            };
            // `still` is of the first alone, and `start` has seen to it.
            // `last` and `before` are one shorter step apart.
            let own = Input {
                last: &self.last,
                before: &self.before,
                still: false,
                load: input.load.map(|load| load.of_part(part, self.count)),
                way: part_of(part, self.count),
                ..*input
            };
            let report = FieldStep {
                solver,
                context: short,
                input: &own,
                report: Report::default(),
            }
            .swing_once(&mut self.next)?;
            told = told.and(&report);
            swap(&mut solver.motion, &mut solver.next);
            self.advance();
        }
        Ok(Report {
            substeps: self.count,
            ..told
        })
    }
}

impl Substepper {
    /// Makes the free step from `input.last` with `solver`, of shorter ones where a whole one leaves out more than `limit_mm`, or the last one did.
    ///
    /// # Errors
    /// A panic on another thread of the pool; the past of the solver stays.
    pub fn swing_where_it_helps(
        &mut self,
        solver: &mut ImplicitSolver,
        context: SolverContext<'_>,
        input: &Input<'_>,
        limit_mm: f32,
        next: &mut [f32],
    ) -> Result<Report> {
        if solver.motion.truncated_mm > limit_mm {
            return solver.swing(context, input, Some(self), next);
        }
        let whole = solver.swing(context, input, None, next)?;
        if whole.fell_back || solver.next.truncated_mm <= limit_mm {
            return Ok(whole);
        }
        let parts = solver.swing(context, input, Some(self), next)?;
        Ok(whole.and(&parts))
    }
}

impl ImplicitSolver {
    /// Makes the free step from `input.last`, of shorter ones where the scene has them for that; each with at least `LEAST_SWING` iterations
    /// that its time lets in.
    ///
    /// # Errors
    /// A panic on another thread of the pool; the past of the solver stays.
    pub fn swing(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        substepper: Option<&mut Substepper>,
        next: &mut [f32],
    ) -> Result<Report> {
        self.begin_pairs();
        let _awake = self.relaxes().then(|| context.pool.keep_awake());
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.remember(context, input, true, &mut self.balance.scratch)?;
        }
        let enough = Enough {
            iterations: input.enough.iterations.max(LEAST_SWING),
            ..input.enough
        };
        let input = &Input { enough, ..*input };
        let Some(substepper) = substepper else {
            return FieldStep {
                solver: self,
                context,
                input,
                report: Report::default(),
            }
            .swing_once(next);
        };
        substepper.start(
            &self.motion,
            input,
            context.time_step.integrator.step_s as f32,
        )?;
        substepper.exchange(self);
        // The pairs of whole steps come back below; among those of shorter ones they would be wrong by their inertia.
        self.clear_pairs();
        let result = substepper.swing_each(self, context, input);
        substepper.exchange(self);
        // The pairs are those of shorter steps.
        self.begin_pairs();
        let report = result?;
        substepper.arrive(self, context, input, next)?;
        Ok(report)
    }
}
