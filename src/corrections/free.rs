//! A free step at a pace of the scene's own, where no learned map knows the motion: the natural modes swing as their oscillators do in
//! closed form, and the iterations bring the rest of the field and the law's nonlinearity to BDF2.
//!
//! BDF2 alone turns and damps a mode that it resolves badly. So each mode `N` gets the force that makes BDF2 end where the oscillator ends under
//! what the law adds to its linear force now, `g = m w² z - N^T f_int(u_n)`: `c = m w² z' + m kappa (z' - z) + N^T M p - g`; and its
//! velocity becomes the oscillator's. Without `g` a law that is not linear is given two thirds of its impulse.

use super::input::{Input, Lent, Report};
use super::passes;
use super::precondition::mask_held;
use super::stage::{SMALLEST_DET, Stage};
use crate::error::Result;
use crate::memory;
use crate::prior::propagator;

/// Modes that turn by more than this in a step are left to BDF2, which damps them: in closed form they would ring undamped, and what the
/// iterations leave of them would grow from step to step, rad.
const RESOLVED: f64 = 2.0;
/// What of the last field stays in a step where no free motion was found.
const KEPT: f32 = 0.8;

/// The oscillators of a scene whose free steps are made here; empty before the first.
#[derive(Debug, Default)]
pub(super) struct Free {
    modes: Vec<Oscillator>,
    /// A number a mode.
    values: Vec<f32>,
    /// What BDF2's velocities lack `[K,3]`, mm/s.
    faster: Vec<f32>,
}

/// A natural mode in a step, per unit mass where it is a force.
#[derive(Clone, Copy, Debug, Default)]
struct Oscillator {
    /// `w²`, 1/s², and mass, g.
    square: f64,
    mass: f64,
    /// `A, B, C, D` of `z' = A z + B h v`, `h v' = C z + D h v`.
    over: [f64; 4],
    /// Place in the last state and the one before, velocity in the last.
    place: f64,
    before: f64,
    velocity: f64,
    /// `p`: BDF2's inertia at the last place.
    drift: f64,
    /// `N^T f_int` there.
    inner: f64,
}

impl Free {
    fn ready(&mut self, lent: Lent<'_>) -> Result<()> {
        if !self.faster.is_empty() {
            return Ok(());
        }
        const WHAT: &str = "the free motion of a scene";
        let natural = lent.corrections.space.natural();
        let integrator = lent.pace.integrator;
        let turned = |omega: f32| f64::from(omega) * integrator.step_s;
        let resolved = natural.iter().take_while(|mode| turned(mode.0) <= RESOLVED);
        let count = resolved.clone().count();
        let oscillators = resolved.map(|&(omega, mass)| {
            let omega = f64::from(omega);
            Oscillator {
                square: omega * omega,
                mass: f64::from(mass),
                over: propagator(omega, integrator.damping_per_s, integrator.step_s).map(f64::from),
                ..Oscillator::default()
            }
        });
        self.values = memory::zeros(count, WHAT)?;
        self.faster = memory::zeros(3 * lent.corrections.body.mass.len(), WHAT)?;
        self.modes = memory::collected(count, oscillators, WHAT)?;
        Ok(())
    }

    /// Takes what `values` holds, divided by the masses.
    fn take(&mut self, to: impl Fn(&mut Oscillator) -> &mut f64) {
        for (mode, value) in self.modes.iter_mut().zip(&self.values) {
            *to(mode) = f64::from(*value) / mode.mass;
        }
    }

    /// A number of each mode into `values`.
    fn give(&mut self, of: impl Fn(&Oscillator) -> f64) {
        for (value, mode) in self.values.iter_mut().zip(&self.modes) {
            *value = of(mode) as f32;
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of::<Oscillator>() * self.modes.len() + 4 * (self.values.len() + self.faster.len())
    }
}

impl Oscillator {
    /// Where it is after a step of `h`, and how fast.
    fn after(&self, h: f64) -> (f64, f64) {
        let ([a, b, c, d], w) = (self.over, h * self.velocity);
        let rest = self.beside() / self.square;
        let place = self.place - rest;
        (rest + a * place + b * w, (c * place + d * w) / h)
    }

    /// What the law adds to the linear force.
    fn beside(&self) -> f64 {
        self.square * self.place - self.inner
    }

    /// The acceleration that takes BDF2 there.
    fn forced(&self, h: f64, kappa: f64) -> f64 {
        let place = self.after(h).0;
        self.square * place + kappa * (place - self.place) + self.drift - self.beside()
    }

    /// What BDF2's velocity lacks there.
    fn faster(&self, h: f64) -> f64 {
        let (place, velocity) = self.after(h);
        let bdf = (3.0 * (place - self.place) - (self.place - self.before)) / (2.0 * h);
        velocity - bdf
    }
}

impl Stage {
    /// Makes the free step from `input.last` in one.
    pub(super) fn swing_once(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        next: &mut [f32],
    ) -> Result<Report> {
        let mut report = Report::default();
        let rests = |field: &[f32]| field.iter().all(|value| *value == 0.0);
        if rests(input.last) && rests(input.before) && (input.still || self.rests()) {
            next.fill(0.0);
            self.finish(lent, input, next)?;
            report.min_det = 1.0;
            return Ok(report);
        }
        let _awake = lent.pool.keep_awake();
        self.nodes.clear();
        self.preconditioner.prescribe(lent.env(), &[])?;
        self.memory.mask(&[]);
        self.prepare(lent, input)?;
        let mut u = std::mem::take(&mut self.u);
        let mut g = std::mem::take(&mut self.g);
        let result = self
            .swing_from(lent, input, &mut u, &mut g, &mut report)
            .and_then(|()| self.finish(lent, input, &u));
        if result.is_ok() {
            next.copy_from_slice(&u);
            self.finish_free(lent, input.last, next);
            if report.fell_back {
                self.stop_next();
            }
            self.next.min_det = report.min_det;
            self.estimate(&mut report);
        }
        (self.u, self.g) = (u, g);
        result.map(|()| report)
    }

    fn rests(&self) -> bool {
        let fields = [&self.motion.velocity, &self.motion.velocity_before];
        fields.iter().all(|field| field.iter().all(|v| *v == 0.0))
    }

    fn swing_from(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        u: &mut [f32],
        g: &mut [f32],
        report: &mut Report,
    ) -> Result<()> {
        let (h, kappa) = (lent.pace.integrator.step_s, lent.pace.integrator.kappa());
        self.free.ready(lent)?;
        let still = input.last;
        let (det, _) = self.residual(lent, [still, still, still], g, report)?;
        self.measure(lent, input, g)?;
        let env = lent.env();
        // What the modes lack under BDF2 goes into the inertia of the step, ...
        self.free.give(|mode| mode.forced(h, kappa));
        self.preconditioner
            .of_natural(env, &self.free.values, &mut self.d)?;
        let masses = &env.body.mass;
        for (i, (drift, forced)) in self.drift.iter_mut().zip(&self.d).enumerate() {
            *drift -= masses[i / 3] * forced;
        }
        // ... and into the velocities at its end.
        self.free.give(|mode| mode.faster(h));
        self.preconditioner
            .of_natural(env, &self.free.values, &mut self.free.faster)?;
        self.free.give(|mode| mode.after(h).0 - mode.place);
        self.preconditioner
            .of_natural(env, &self.free.values, &mut self.d)?;
        passes::shorten(env, input.last, &self.d, 1.0, u)?;
        mask_held(&env.body.held, u);
        let lost = det.is_nan() || det < SMALLEST_DET;
        let mut det = self.residual(lent, [input.last, u, u], g, report)?.0;
        if !lost && (det.is_nan() || det < SMALLEST_DET) {
            u.copy_from_slice(input.last);
            det = self.residual(lent, [input.last, u, u], g, report)?.0;
        }
        report.parts = 1;
        self.relax(lent, input, det, u, g, report)?;
        if report.fell_back {
            // Without contact that was rest. The field dies away instead of a jump there.
            for (u, last) in u.iter_mut().zip(input.last) {
                *u = KEPT * last;
            }
            report.min_det = self.residual(lent, [input.last, u, u], g, report)?.0;
            self.stand();
        }
        Ok(())
    }

    /// Places, velocities, drifts and forces of the modes, from the residual `g` of the last state.
    fn measure(&mut self, lent: Lent<'_>, input: &Input<'_>, g: &[f32]) -> Result<()> {
        let env = lent.env();
        let known = if input.still { 0.0 } else { 1.0 };
        let weighted = |stage: &mut Stage, field: &[f32], scale: f32| {
            for (i, (q, value)) in stage.q.iter_mut().zip(field).enumerate() {
                *q = scale * env.body.mass[i / 3] * value;
            }
            mask_held(&env.body.held, &mut stage.q);
            let (preconditioner, values) = (&mut stage.preconditioner, &mut stage.free.values);
            preconditioner.on_natural(env, &stage.q, values)
        };
        weighted(self, input.last, 1.0)?;
        self.free.take(|mode| &mut mode.place);
        weighted(self, input.before, 1.0)?;
        self.free.take(|mode| &mut mode.before);
        let velocity = std::mem::take(&mut self.motion.velocity);
        let measured = weighted(self, &velocity, known);
        self.motion.velocity = velocity;
        measured?;
        self.free.take(|mode| &mut mode.velocity);
        // The drift has the masses in it.
        self.q.copy_from_slice(&self.drift);
        mask_held(&env.body.held, &mut self.q);
        let values = &mut self.free.values;
        self.preconditioner.on_natural(env, &self.q, values)?;
        self.free.take(|mode| &mut mode.drift);
        let values = &mut self.free.values;
        self.preconditioner.on_natural(env, g, values)?;
        self.free.take(|mode| &mut mode.inner);
        for mode in &mut self.free.modes {
            mode.inner -= mode.drift;
        }
        Ok(())
    }

    /// The modes' own velocities and forces in the state being made.
    fn finish_free(&mut self, lent: Lent<'_>, last: &[f32], next: &[f32]) {
        let kappa = lent.pace.integrator.kappa() as f32;
        let masses = &lent.corrections.body.mass;
        for i in 0..next.len() {
            self.next.velocity[i] += self.free.faster[i];
            self.next.inertia[i] = masses[i / 3] * kappa * (next[i] - last[i]) + self.drift[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// BDF2 under a constant push and the force of [`Oscillator::forced`], with the velocity of [`Oscillator::faster`], is the oscillator.
    #[test]
    fn a_mode_swings_in_closed_form() {
        let (h, alpha, omega, push) = (0.025, 3.0, 40.0f64, 800.0);
        let rest = push / (omega * omega);
        let kappa = 2.25 / (h * h) + 1.5 * alpha / h;
        let over = propagator(omega, alpha, h).map(f64::from);
        let (mut u, mut v) = ([1.0f64, 1.0], [0.0f64, 0.0]);
        let mut exact = (1.0f64, 0.0f64);
        for _ in 0..40 {
            let half = (u[1] - u[0]) / (2.0 * h);
            let a = (3.0 * (half - v[0]) - (v[0] - v[1])) / (2.0 * h);
            let mode = Oscillator {
                square: omega * omega,
                mass: 1.0,
                over,
                place: u[0],
                before: u[1],
                velocity: v[0],
                drift: a + alpha * half,
                inner: omega * omega * u[0] - push,
            };
            let next =
                (mode.forced(h, kappa) + push + kappa * u[0] - mode.drift) / (mode.square + kappa);
            let bdf = (3.0 * (next - u[0]) - (u[0] - u[1])) / (2.0 * h);
            let velocity = bdf + mode.faster(h);
            (u, v) = ([next, u[0]], [velocity, v[0]]);
            let turn = (omega * omega - 0.25 * alpha * alpha).sqrt();
            let decay = (-0.5 * alpha * h).exp();
            let (sine, cosine) = (turn * h).sin_cos();
            let (z, w) = (exact.0 - rest, exact.1);
            exact = (
                rest + decay * (z * cosine + (w + 0.5 * alpha * z) / turn * sine),
                decay * (w * cosine - (omega * omega * z + 0.5 * alpha * w) / turn * sine),
            );
            assert!((u[0] - exact.0).abs() < 1e-4, "{} is not {}", u[0], exact.0);
            assert!((v[0] - exact.1).abs() < 4e-3, "{} is not {}", v[0], exact.1);
        }
        assert!(
            (exact.0 - rest).abs() > 0.05 || exact.1.abs() > 1.0,
            "still swinging"
        );
    }
}
