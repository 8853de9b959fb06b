//! A free step at a pace of the scene's own, where no learned map knows the motion: the natural modes swing as their oscillators do in
//! closed form, and the iterations bring the rest of the field and the law's nonlinearity to BDF2.
//!
//! The oscillators and the forces that make BDF2 follow them are in [`super::oscillators`].

use super::gravity_columns::add_gravity;
use super::input::Report;
use super::lift::lift;
use super::passes;
use super::precondition::mask_held;
use super::relax::FieldStep;
use super::solver::{ImplicitSolver, SMALLEST_DET};
use crate::error::Result;

/// What of the last field stays in a step where no free motion was found: it dies away over some
/// tens of steps in place of a jump to rest.
const KEPT: f32 = 0.8;

impl FieldStep<'_> {
    /// Makes the free step from `input.last` in one.
    pub(super) fn swing_once(&mut self, next: &mut [f32]) -> Result<Report> {
        let (context, input) = (self.context, self.input);
        let rests = |field: &[f32]| field.iter().all(|value| *value == 0.0);
        // Tissue that relaxes goes on to creep where it has been strained, without any load.
        let pushes = self
            .solver
            .relaxing
            .as_ref()
            .is_some_and(|own| !own.rests());
        // A body at rest that nothing pushes stays there, and costs nothing.
        let is_free = input.load.is_none() && !pushes;
        if is_free && rests(input.last) && rests(input.before) && (input.still || self.rests()) {
            next.fill(0.0);
            self.solver.balance.load.clear();
            self.solver.finish(context, input, next)?;
            self.report.min_det = 1.0;
            return Ok(self.report);
        }
        let _awake = context.pool.keep_awake();
        self.solver.balance.nodes.clear();
        self.solver.preconditioner.prescribe(context.env(), &[])?;
        self.solver.expect(context, input)?;
        // Nothing is prescribed: the pairs of the whole body hold.
        self.solver.memory.mask(&[]);
        self.solver.prepare(context, input)?;
        let mut u = std::mem::take(&mut self.solver.fields.u);
        let mut g = std::mem::take(&mut self.solver.fields.g);
        // A body of which a part has been let go has other natural modes.
        let swings = context.held.let_go == 0;
        let result = match swings {
            true => self.swing_from(&mut u, &mut g),
            false => self.balance_from(&mut u, &mut g),
        };
        let result = result.and_then(|()| self.solver.finish(context, input, &u));
        if result.is_ok() {
            next.copy_from_slice(&u);
        }
        // Back before anything else can fail: a solver without them could make no further step.
        (self.solver.fields.u, self.solver.fields.g) = (u, g);
        result?;
        if swings {
            self.finish_free(next);
        }
        self.solver.end(&mut self.report, None)?;
        Ok(self.report)
    }

    /// Whether nothing moved in the last two steps: to the bit, for what moves by the least goes on moving.
    fn rests(&self) -> bool {
        let fields = [
            &self.solver.motion.velocity,
            &self.solver.motion.velocity_before,
        ];
        fields.iter().all(|field| field.iter().all(|v| *v == 0.0))
    }

    /// BDF2 about the free swing of the natural modes: the modes' error under BDF2 is taken off before the iterations, which then have the rest of the field and the
    /// law's nonlinearity to balance.
    /// `g` is the residual of `u` on return.
    fn swing_from(&mut self, u: &mut [f32], g: &mut [f32]) -> Result<()> {
        let (context, input) = (self.context, self.input);
        let (h, kappa) = (
            context.time_step.integrator.step_s,
            context.time_step.integrator.kappa(),
        );
        // Each natural mode is an oscillator `y'' + alpha y' + w² y = f`, solved over the step in closed form: BDF2 would damp it, the more the longer the step.
        self.solver.free.ready(context)?;
        // The same field for `u`, `u_n` and the direction: nothing moves, so that the residual is `f_int(u_n)` and the drift alone.
        let still = input.last;
        // Internal forces of the last state: what the modes swing about is not linear elasticity but the law.
        let (det, _) =
            self.solver
                .balance
                .residual(context, [still, still, still], g, &mut self.report)?;
        // Amplitudes and rates of the modes at the start of the step, and what the law's forces have of each.
        self.measure(g)?;
        let env = context.env();
        // What the modes lack under BDF2 goes into the inertia of the step, ...
        self.solver.free.give(|mode| mode.forced(h, kappa));
        self.solver.preconditioner.of_natural(
            env,
            &self.solver.free.values,
            &mut self.solver.fields.d,
        )?;
        let masses = &env.body.mass;
        for (i, (drift, forced)) in self
            .solver
            .balance
            .drift
            .iter_mut()
            .zip(&self.solver.fields.d)
            .enumerate()
        {
            *drift -= masses[i / 3] * forced;
        }
        // ... and into the velocities at its end.
        self.solver.free.give(|mode| mode.faster(h));
        self.solver.preconditioner.of_natural(
            env,
            &self.solver.free.values,
            &mut self.solver.free.faster,
        )?;
        // Where the oscillators are at the end of the step, less where they were.
        self.solver.free.give(|mode| mode.after(h).0 - mode.place);
        self.solver.preconditioner.of_natural(
            env,
            &self.solver.free.values,
            &mut self.solver.fields.d,
        )?;
        // The guess: the last state moved along the modes as their oscillators do.
        passes::shorten(env, input.last, &self.solver.fields.d, 1.0, u)?;
        add_gravity(context, input, u)?;
        lift(context, input, Some(input.last), u)?;
        // A guess that inverts elements where the last state did not is given up for the last state.
        let lost = det.is_nan() || det < SMALLEST_DET;
        let mut det = self
            .solver
            .balance
            .residual(context, [input.last, u, u], g, &mut self.report)?
            .0;
        if !lost && (det.is_nan() || det < SMALLEST_DET) {
            u.copy_from_slice(input.last);
            det = self
                .solver
                .balance
                .residual(context, [input.last, u, u], g, &mut self.report)?
                .0;
        }
        self.report.parts = 1;
        self.relax(det, u, g)?;
        self.die_away(u, g)
    }

    /// BDF2 alone, from the free motion of the natural modes.
    /// For a body of which a group is let go, whose natural modes nobody knows.
    fn balance_from(&mut self, u: &mut [f32], g: &mut [f32]) -> Result<()> {
        let (context, input) = (self.context, self.input);
        let env = context.env();
        u.copy_from_slice(input.last);
        add_gravity(context, input, u)?;
        lift(context, input, Some(input.last), u)?;
        self.solver.move_freely(env)?;
        self.solver.settle(env, u)?;
        let mut det = self
            .solver
            .balance
            .residual(context, [input.last, u, u], g, &mut self.report)?
            .0;
        if det.is_nan() || det < SMALLEST_DET {
            u.copy_from_slice(input.last);
            det = self
                .solver
                .balance
                .residual(context, [input.last, u, u], g, &mut self.report)?
                .0;
        }
        self.report.parts = 1;
        self.relax(det, u, g)?;
        self.die_away(u, g)
    }

    /// What takes the place of a free step whose iterations ended inverted. Without contact that was rest: the field dies away instead of a jump there,
    /// and stays where a support has taken it.
    fn die_away(&mut self, u: &mut [f32], g: &mut [f32]) -> Result<()> {
        let (context, input) = (self.context, self.input);
        if self.report.fell_back {
            let stays = context.held.let_go != 0 || !context.held.places.is_empty();
            let kept = if stays { 1.0 } else { KEPT };
            for (u, last) in u.iter_mut().zip(input.last) {
                *u = kept * last;
            }
            self.report.min_det = self
                .solver
                .balance
                .residual(context, [input.last, u, u], g, &mut self.report)?
                .0;
            self.solver.balance.stand();
        }
        Ok(())
    }

    /// Places, velocities, drifts and forces of the modes, from the residual `g` of the last state.
    /// Everything is a product with `N^T`, so that a mode's share of a field costs a row of a
    /// table.
    fn measure(&mut self, g: &[f32]) -> Result<()> {
        let (context, input) = (self.context, self.input);
        let env = context.env();
        // A step from a displacement that the host gave has no past: its velocity counts as none.
        // `place`, `before` and `velocity` are amplitudes, mm and mm/s; `drift`, `inner` and `load` are forces on the modes.
        let known = if input.still { 0.0 } else { 1.0 };
        // `N^T M x`: the modes are orthonormal by mass, so that this is what a field has of each.
        let weighted = |solver: &mut ImplicitSolver, field: &[f32], scale: f32| {
            for (i, (q, value)) in solver.fields.q.iter_mut().zip(field).enumerate() {
                *q = scale * env.body.mass[i / 3] * value;
            }
            mask_held(&env.held.is, &mut solver.fields.q);
            let (preconditioner, values) = (&mut solver.preconditioner, &mut solver.free.values);
            preconditioner.on_natural(env, &solver.fields.q, values)
        };
        weighted(self.solver, input.last, 1.0)?;
        self.solver.free.take(|mode| &mut mode.place);
        weighted(self.solver, input.before, 1.0)?;
        self.solver.free.take(|mode| &mut mode.before);
        // Out of the solver for the call alone; put back before anything can fail.
        let velocity = std::mem::take(&mut self.solver.motion.velocity);
        let measured = weighted(self.solver, &velocity, known);
        self.solver.motion.velocity = velocity;
        measured?;
        self.solver.free.take(|mode| &mut mode.velocity);
        // The drift has the masses in it.
        self.solver
            .fields
            .q
            .copy_from_slice(&self.solver.balance.drift);
        mask_held(&env.held.is, &mut self.solver.fields.q);
        let values = &mut self.solver.free.values;
        self.solver
            .preconditioner
            .on_natural(env, &self.solver.fields.q, values)?;
        self.solver.free.take(|mode| &mut mode.drift);
        let values = &mut self.solver.free.values;
        self.solver.preconditioner.on_natural(env, g, values)?;
        self.solver.free.take(|mode| &mut mode.inner);
        for mode in &mut self.solver.free.modes {
            // `g` was `f_int + drift`: what is left is the internal force.
            mode.inner -= mode.drift;
            mode.load = 0.0;
        }
        if self.mean_load() {
            mask_held(&env.held.is, &mut self.solver.fields.q);
            let values = &mut self.solver.free.values;
            self.solver
                .preconditioner
                .on_natural(env, &self.solver.fields.q, values)?;
            self.solver.free.take(|mode| &mut mode.load);
        }
        Ok(())
    }

    /// The modes' own velocities and forces in the state being made.
    /// Inertia is what BDF2 had, with the modes' forced part in the drift; velocities are the
    /// oscillators' own.
    fn finish_free(&mut self, next: &[f32]) {
        let context = self.context;
        let last = self.input.last;
        let kappa = context.time_step.integrator.kappa() as f32;
        let masses = &context.corrections.body.mass;
        for i in 0..next.len() {
            self.solver.next.velocity[i] += self.solver.free.faster[i];
            self.solver.next.inertia[i] =
                masses[i / 3] * kappa * (next[i] - last[i]) + self.solver.balance.drift[i];
        }
    }
}
