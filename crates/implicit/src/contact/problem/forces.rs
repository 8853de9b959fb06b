//! Forces that a step keeps and takes back.

use crate::contact::past::{Force, Past};
use crate::contact::rows::{MOST_ROWS, WHAT};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Forces of other states of the tissue than the present one.
#[derive(HeldBytes)]
pub struct KeptForces {
    /// Before the last solve, to go part of the way.
    pub(super) before: Vec<Force>,
    /// Of a step's first guess.
    guessed: Vec<Force>,
    /// Of a state without inverted elements, while a step that has lost its contact looks for a better one.
    sound: Vec<Force>,
}

impl KeptForces {
    /// Room for what two solves leave.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn new() -> Result<KeptForces> {
        Ok(KeptForces {
            before: memory::room(2 * MOST_ROWS, WHAT)?,
            guessed: memory::room(2 * MOST_ROWS, WHAT)?,
            sound: memory::room(2 * MOST_ROWS, WHAT)?,
        })
    }

    /// Most forces that may be taken back.
    pub(super) fn most(&self) -> usize {
        self.guessed.len().max(self.sound.len())
    }

    /// Keeps the forces as those of the first guess.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn keep_guess(&mut self, next: &Past) -> Result<()> {
        memory::replace(&mut self.guessed, &next.forces, WHAT)
    }

    /// Takes the forces of the first guess back.
    pub fn take_guess(&self, next: &mut Past) {
        next.forces.clear();
        next.forces.extend_from_slice(&self.guessed);
    }

    /// Keeps the forces as those of a state without inverted elements.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn keep_sound(&mut self, next: &Past) -> Result<()> {
        memory::replace(&mut self.sound, &next.forces, WHAT)
    }

    /// Takes them back.
    pub fn take_sound(&self, next: &mut Past) {
        next.forces.clear();
        next.forces.extend_from_slice(&self.sound);
    }

    /// Shortens the last solve: `f <- (1 - part) f_before + part f`, over the samples that either has forces at.
    pub fn blend(&self, next: &mut Past, part: f32) {
        for force in &mut next.forces {
            force.force *= part;
        }
        for kept in &self.before {
            let found = next.forces.binary_search_by_key(&kept.key(), Force::key);
            // Also of samples that the solve has let go: part of the way there they still push.
            let share = kept.force * (1.0 - part);
            match found {
                Ok(place) => next.forces[place].force += share,
                Err(place) => next.forces.insert(
                    place,
                    Force {
                        force: share,
                        ..*kept
                    },
                ),
            }
        }
    }

    /// Takes the forces before the last solve back.
    pub fn undo(&mut self, next: &mut Past) {
        std::mem::swap(&mut next.forces, &mut self.before);
    }
}
