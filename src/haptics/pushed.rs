//! The samples of a hand under its forces: where forces move them between two steps.

use ::contact::Vector;

use super::snapshot::{ContactSnapshot, MOST_SAMPLES};
use crate::error::Result;
use crate::memory;

const WHAT: &str = "haptics";

/// By sample, with room for [`MOST_SAMPLES`].
pub struct Pushed {
    /// The force on it, mN.
    pub forces: Vec<Vector>,
    /// Its place after the last solve, mm.
    pub points: Vec<Vector>,
    /// How far forces have moved it since the step `[3n]`, mm, and how far they will have moved it if they stay as they are.
    pub moved: Vec<f32>,
    aim: Vec<f32>,
}

impl Pushed {
    /// Without forces.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new() -> Result<Pushed> {
        Ok(Pushed {
            forces: memory::filled(MOST_SAMPLES, Vector::ZERO, WHAT)?,
            points: memory::filled(MOST_SAMPLES, Vector::ZERO, WHAT)?,
            moved: memory::zeros(3 * MOST_SAMPLES, WHAT)?,
            aim: memory::zeros(3 * MOST_SAMPLES, WHAT)?,
        })
    }

    /// As a step has left them. What the hand's forces moved since the one before is dropped: the step has it.
    pub fn begin(&mut self, snapshot: &ContactSnapshot) {
        let count = snapshot.samples.count;
        self.forces[..count].copy_from_slice(&snapshot.samples.forces[..count]);
        self.points[..count].copy_from_slice(&snapshot.samples.points[..count]);
        self.moved.fill(0.0);
        self.aim.fill(0.0);
    }

    /// Becomes what another is.
    pub fn copy_from(&mut self, other: &Pushed) {
        self.forces.copy_from_slice(&other.forces);
        self.points.copy_from_slice(&other.points);
        self.moved.copy_from_slice(&other.moved);
        self.aim.copy_from_slice(&other.aim);
    }

    /// Adds a change of the force on a sample: it moves all samples by `part` of `W` times the change now, and by the rest later.
    pub fn change(&mut self, snapshot: &ContactSnapshot, at: usize, change: Vector, part: f32) {
        if change == Vector::ZERO {
            return;
        }
        let all = 3 * snapshot.samples.count;
        for (axis, change) in change.to_array().into_iter().enumerate() {
            // Symmetric: a row is a column.
            let row = &snapshot.delassus[(3 * at + axis) * all..][..all];
            let moves = self.moved.iter_mut().zip(&mut self.aim).zip(row);
            for ((moved, aim), w) in moves {
                *aim += change * w;
                *moved += part * change * w;
            }
        }
    }

    /// Lets samples follow the forces so far, `delay_s x' + x = W f` by backward Euler. Gives the part of a change of the forces that
    /// moves them within that time.
    pub fn follow(&mut self, delay_s: f32, seconds: f32) -> f32 {
        let whole = seconds + delay_s;
        let part = if whole > 0.0 { seconds / whole } else { 1.0 };
        for (moved, aim) in self.moved.iter_mut().zip(&self.aim) {
            *moved += part * (aim - *moved);
        }
        part
    }

    /// Samples with a force.
    pub fn pushing(&self, count: usize) -> impl Iterator<Item = usize> {
        (0..count).filter(|at| self.forces[*at] != Vector::ZERO)
    }
}
