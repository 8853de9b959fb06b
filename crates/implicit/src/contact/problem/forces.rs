//! Forces that a step starts from, keeps and takes back.

use super::{ContactProblem, WHAT};
use crate::contact::past::Force;
use crate::contact::ties::tie_of;
use crate::error::Result;
use crate::memory;

impl ContactProblem {
    /// Back to the forces at the start of the step, those of the last published one. Readings and grasps stay.
    pub fn restart(&mut self) {
        self.next.forces.clear();
        self.next.forces.extend_from_slice(&self.past.forces);
    }

    /// As [`ContactProblem::restart`], without the forces of tools that are no longer in the list: the step keeps the last state.
    pub fn stay(&mut self) {
        self.restart();
        let count = self.tools.len();
        let ties = self.tied.list.len();
        let there = |force: &Force| match tie_of(force.sample) {
            Some(index) => index < ties,
            None => (force.tool as usize) < count,
        };
        self.next.forces.retain(there);
    }

    /// Keeps the forces as those of the first guess.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn keep_guess(&mut self) -> Result<()> {
        memory::replace(&mut self.guessed, &self.next.forces, WHAT)
    }

    /// Takes the forces of the first guess back.
    pub fn take_guess(&mut self) {
        self.next.forces.clear();
        self.next.forces.extend_from_slice(&self.guessed);
    }

    /// Keeps the forces as those of a state without inverted elements.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn keep_sound(&mut self) -> Result<()> {
        memory::replace(&mut self.sound, &self.next.forces, WHAT)
    }

    /// Takes them back.
    pub fn take_sound(&mut self) {
        self.next.forces.clear();
        self.next.forces.extend_from_slice(&self.sound);
    }

    /// Multiplies all forces of this step.
    pub fn scale_forces(&mut self, factor: f32) {
        for force in &mut self.next.forces {
            force.force *= factor;
        }
    }

    /// Drops the forces of this step. What the last published step left stays.
    pub fn clear_forces(&mut self) {
        self.next.forces.clear();
    }

    /// Shortens the last solve: `f <- (1 - part) f_before + part f`, over the samples that either has forces at.
    pub fn blend(&mut self, part: f32) {
        for force in &mut self.next.forces {
            force.force *= part;
        }
        for at in 0..self.kept.len() {
            let kept = self.kept[at];
            let found = self
                .next
                .forces
                .binary_search_by_key(&kept.key(), Force::key);
            // Also of samples that the solve has let go: part of the way there they still push.
            let share = kept.force * (1.0 - part);
            match found {
                Ok(place) => self.next.forces[place].force += share,
                Err(place) => self.next.forces.insert(
                    place,
                    Force {
                        force: share,
                        ..kept
                    },
                ),
            }
        }
    }

    /// Takes the forces before the last solve back.
    pub fn undo(&mut self) {
        std::mem::swap(&mut self.next.forces, &mut self.kept);
    }
}
