//! The natural modes of a scene in a free step of its own, as oscillators in closed form, and the forces under which BDF2 follows them: see
//! [`super::free`].
//!
//! BDF2 alone turns and damps a mode that it resolves badly. So each mode `N` gets the force that makes BDF2 end where the oscillator ends under
//! what the law adds to its linear force now, `g = m w² z - N^T f_int(u_n)`: `c = m w² z' + m kappa (z' - z) + N^T M p - g`; and its
//! velocity becomes the oscillator's. Without `g` a law that is not linear is given two thirds of its impulse.

use super::input::SolverContext;
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use crate::prior::propagator;

/// Modes that turn by more than this in a step are left to BDF2, which damps them: in closed form they would ring undamped, and what the
/// iterations leave of them would grow from step to step, rad.
const RESOLVED: f64 = 2.0;
/// The oscillators of a scene whose free steps are made here; empty before the first.
#[derive(Debug, Default, HeldBytes)]
pub(super) struct Oscillators {
    pub(super) modes: Vec<Oscillator>,
    /// A number a mode.
    pub(super) values: Vec<f32>,
    /// What BDF2's velocities lack `[K,3]`, mm/s.
    pub(super) faster: Vec<f32>,
}

/// A natural mode in a step, per unit mass where it is a force.
#[derive(Clone, Copy, Debug, Default, HeldBytes)]
pub(super) struct Oscillator {
    /// `w²`, 1/s², and mass, g.
    square: f64,
    mass: f64,
    /// `A, B, C, D` of `z' = A z + B h v`, `h v' = C z + D h v`.
    over: [f64; 4],
    /// Place in the last state and the one before, velocity in the last.
    pub(super) place: f64,
    pub(super) before: f64,
    pub(super) velocity: f64,
    /// `p`: BDF2's inertia at the last place, less the load at the end of the step.
    pub(super) drift: f64,
    /// `N^T f_int` there.
    pub(super) inner: f64,
    /// The mean load beside contact over the step.
    pub(super) load: f64,
}

impl Oscillators {
    /// Makes the oscillators at the first free step, of the natural modes that a step of this length resolves.
    pub(super) fn ready(&mut self, context: SolverContext<'_>) -> Result<()> {
        if !self.faster.is_empty() {
            return Ok(());
        }
        const WHAT: &str = "the free motion of a scene";
        let natural = context.corrections.space.natural()?;
        let integrator = context.time_step.integrator;
        let turned = |omega: f32| f64::from(omega) * integrator.step_s;
        // The modes ascend by frequency.
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
        *self = Oscillators {
            values: memory::zeros(count, WHAT)?,
            faster: memory::zeros(3 * context.corrections.body.mass.len(), WHAT)?,
            modes: memory::collected(count, oscillators, WHAT)?,
        };
        Ok(())
    }

    /// Takes what `values` holds, divided by the masses.
    pub(super) fn take(&mut self, to: impl Fn(&mut Oscillator) -> &mut f64) {
        for (mode, value) in self.modes.iter_mut().zip(&self.values) {
            *to(mode) = f64::from(*value) / mode.mass;
        }
    }

    /// A number of each mode into `values`.
    pub(super) fn give(&mut self, of: impl Fn(&Oscillator) -> f64) {
        for (value, mode) in self.values.iter_mut().zip(&self.modes) {
            *value = of(mode) as f32;
        }
    }
}

impl Oscillator {
    /// Where it is after a step of `h`, and how fast.
    pub(super) fn after(&self, h: f64) -> (f64, f64) {
        let ([a, b, c, d], w) = (self.over, h * self.velocity);
        // It swings about where it would rest under what pushes it.
        let rest = (self.beside() + self.load) / self.square;
        let place = self.place - rest;
        (rest + a * place + b * w, (c * place + d * w) / h)
    }

    /// What the law adds to the linear force.
    fn beside(&self) -> f64 {
        self.square * self.place - self.inner
    }

    /// The acceleration that takes BDF2 there.
    pub(super) fn forced(&self, h: f64, kappa: f64) -> f64 {
        let place = self.after(h).0;
        self.square * place + kappa * (place - self.place) + self.drift - self.beside()
    }

    /// What BDF2's velocity lacks there.
    pub(super) fn faster(&self, h: f64) -> f64 {
        let (place, velocity) = self.after(h);
        let bdf = (3.0 * (place - self.place) - (self.place - self.before)) / (2.0 * h);
        velocity - bdf
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
                load: 0.0,
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
