//! The natural modes between two steps. Each is an oscillator about the step's state that the change of the contact forces drives,
//! `y'' + alpha y' + w² y = d + Q`, integrated by backward Euler: it takes energy out, never in.

use crate::error::Result;
use crate::memory;

const WHAT: &str = "the modes of haptics";
/// Longest step, s.
const MOST_STEP_S: f64 = 0.001;
/// More than this many are not made in one call: what is older has died out.
const MOST_STEPS: u32 = 50;

/// One place a mode.
pub struct Modes {
    /// `w²`, 1/s².
    square: Vec<f32>,
    /// What 1 mN on the mode accelerates it by, mm/s².
    per_mn: Vec<f32>,
    damping: f32,
    /// Since the step, and its velocity.
    pub place: Vec<f32>,
    velocity: Vec<f32>,
    /// `Q`.
    pub push: Vec<f32>,
}

impl Modes {
    /// Modes of frequencies (rad/s) and masses (g).
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(of: &[(f32, f32)], damping_per_s: f64) -> Result<Modes> {
        let count = of.len();
        Ok(Modes {
            square: memory::collected(count, of.iter().map(|(omega, _)| omega * omega), WHAT)?,
            per_mn: memory::collected(count, of.iter().map(|(_, mass)| 1e3 / mass), WHAT)?,
            damping: damping_per_s as f32,
            place: memory::zeros(count, WHAT)?,
            velocity: memory::zeros(count, WHAT)?,
            push: memory::zeros(count, WHAT)?,
        })
    }

    /// From the state of a step.
    pub fn begin(&mut self, velocity: &[f32]) {
        self.velocity.copy_from_slice(velocity);
        self.place.fill(0.0);
        self.push.fill(0.0);
    }

    /// Adds a force (mN) on a row of the modes `[m]`.
    pub fn add_push(&mut self, row: &[f32], force: f32) {
        for ((push, own), scale) in self.push.iter_mut().zip(row).zip(&self.per_mn) {
            *push += scale * own * force;
        }
    }

    /// Lets time pass under a drive `[m]` and the pushes so far.
    pub fn advance(&mut self, seconds: f64, drive: &[f32]) {
        let steps = ((seconds / MOST_STEP_S).ceil() as u32).clamp(1, MOST_STEPS);
        let h = (seconds / f64::from(steps)).min(MOST_STEP_S) as f32;
        for _ in 0..steps {
            for (i, drive) in drive.iter().enumerate() {
                let square = self.square[i];
                let pull = drive + self.push[i] - square * self.place[i];
                let v = (self.velocity[i] + h * pull) / (1.0 + h * self.damping + h * h * square);
                self.velocity[i] = v;
                self.place[i] += h * v;
            }
        }
    }

    /// What the modes move on a row `[m]`, mm.
    pub fn moved(&self, row: &[f32]) -> f32 {
        row.iter().zip(&self.place).map(|(a, b)| a * b).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_that_stays_moves_a_mode_to_its_static_place() {
        // 10 rad/s and 2 g; 3 mN: 3000 µN / (2 g 100/s²).
        let mut modes = Modes::new(&[(10.0, 2.0)], 20.0).unwrap();
        modes.begin(&[0.0]);
        modes.add_push(&[1.0], 3.0);
        for _ in 0..5000 {
            modes.advance(0.001, &[0.0]);
        }
        assert!((modes.moved(&[1.0]) - 15.0).abs() < 1e-3);
    }

    #[test]
    fn a_mode_swings_as_the_closed_form_says() {
        let (omega, damping, v) = (12.0f64, 3.0f64, 7.0f64);
        let mut modes = Modes::new(&[(omega as f32, 1.0)], damping).unwrap();
        modes.begin(&[v as f32]);
        let mut t = 0.0;
        for _ in 0..60 {
            modes.advance(0.001, &[0.0]);
            t += 0.001;
        }
        let turn = (omega * omega - 0.25 * damping * damping).sqrt();
        let exact = v / turn * (-0.5 * damping * t).exp() * (turn * t).sin();
        assert!((f64::from(modes.moved(&[1.0])) / exact - 1.0).abs() < 0.02);
    }
}
