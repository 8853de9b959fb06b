//! The near set in force and the other one, made as far as a [`Course`] says.

use super::clusters::LeftOut;
use super::course::{Choice, Course, WHOLE};
use super::factor::NearFactor;
use super::linear::WHAT;
use super::near::NearSet;
use super::pairs::Room;
use crate::corrections::far::FarField;
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// A near set with what follows from its centres alone, and the factor of its tangent.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Set {
    /// Nodes, elements and blocks about the centres.
    pub near: NearSet,
    /// What it leaves of the far clusters that it has a part of.
    pub(super) left: LeftOut,
    /// Of the tangent in its core; its pattern is the second part of a set.
    pub factor: NearFactor,
}

/// Where the sets are on their way.
#[derive(Default, HeldBytes)]
pub(in crate::corrections) struct Coming {
    /// In the step being made, and in the last published one.
    pub course: Course,
    pub(super) published: Course,
    /// No set has taken a part in this step.
    pub is_due: bool,
    /// The next set, or the one before. Which it is it says itself.
    pub(super) other: Option<Box<Set>>,
    /// Nodes that a set has to lie about.
    pub about: Vec<u32>,
    /// The number of the last factor that was made.
    pub last_factor: u64,
}

impl Set {
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(env: Env<'_>) -> Result<Set> {
        Ok(Set {
            near: NearSet::new(env)?,
            left: LeftOut::default(),
            factor: NearFactor::default(),
        })
    }

    /// Whether it is that of a choice, however much of it has been made.
    pub(super) fn is_of(&self, choice: &Choice) -> bool {
        self.near.is_of(&choice.centres, choice.level as usize)
    }

    /// Takes over what was left of the clusters before a cut, where none of a cluster's nodes is a copy that the cut has made.
    pub fn follow(&mut self, before: &Set) -> Result<()> {
        let count = before.near.places.node_count();
        let keeps = |node: u32| (node as usize) < count;
        self.left.follow(&before.left, keeps)
    }

    /// Makes those of the first parts of a choice that there are not yet.
    pub(super) fn make(
        &mut self,
        (env, far, rest): (Env<'_>, &FarField, &[f32]),
        choice: &Choice,
        room: &mut Room,
    ) -> Result<()> {
        if !self.is_of(choice) {
            self.near.made = 0;
        }
        while self.near.made < choice.parts {
            let made = self.near.made;
            match made {
                0 => {
                    let (centres, level) = (&choice.centres, choice.level as usize);
                    self.near.fill((env, far, rest), centres, level)?;
                    self.left.fill(env, far, &self.near, room)?;
                }
                _ => self.factor.plan(&self.near, rest)?,
            }
            // Last: an error leaves a part to be made again.
            self.near.made = made + 1;
        }
        Ok(())
    }
}

impl Coming {
    /// Back to the last published state.
    pub fn begin(&mut self) {
        self.course.take(&self.published);
        self.is_due = true;
    }

    /// The state being made is published.
    pub fn commit(&mut self) {
        self.published.take(&self.course);
        self.is_due = true;
    }

    /// Forgets where the tangent in force was taken, in the step being made.
    pub fn clear_tangent(&mut self) {
        self.course.now.tangent.clear();
    }

    /// Forgets the sets, in the step being made.
    pub fn clear(&mut self) {
        self.course.clear();
    }

    /// A copy of what is kept of the last published state.
    pub fn copy(&self) -> Result<Course> {
        self.published.copy()
    }

    /// Takes what was kept.
    pub fn restore(&mut self, kept: &Course) -> Result<()> {
        self.course.fit(kept)?;
        self.published.fit(kept)?;
        self.published.take(kept);
        self.begin();
        Ok(())
    }

    /// Makes what the course says of the next set, its tangent taken at `u`.
    pub fn make_next(
        &mut self,
        (env, far, rest): (Env<'_>, &FarField, &[f32]),
        u: &[f32],
        room: &mut Room,
    ) -> Result<()> {
        let next = &mut self.course.next;
        if next.parts == 0 {
            return Ok(());
        }
        let other = match self.other.take() {
            Some(other) => other,
            None => memory::boxed(Set::new(env)?, WHAT)?,
        };
        let other = self.other.insert(other);
        other.make((env, far, rest), next, room)?;
        if next.parts < WHOLE {
            return Ok(());
        }
        let Set { near, factor, .. } = &mut **other;
        if next.tangent.u.len() != 3 * near.places.nodes.len() {
            let kappa = env.time_step.integrator.kappa() as f32;
            next.tangent.set(&near.places.nodes, kappa, u)?;
        }
        factor.make((env, near, far), &next.tangent, &mut self.last_factor)
    }

    /// Nothing that has been made of a set holds any more.
    pub fn forget(&mut self) {
        if let Some(other) = &mut self.other {
            other.near.made = 0;
        }
    }
}
