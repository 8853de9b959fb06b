//! Which near set is in force, and which one is coming: what of them outlives a step, and snapshots.
//!
//! A set is dear to make. Where the tools leave the middle of the one in force, or it reaches too far or not far enough, the next one is made a part a step, and takes
//! over once it is whole; where they have gone too far for the one in force, the next is made at once. All of it follows from what a [`Course`] says and the state of
//! the tissue in the step: a scene that goes back, or on from a snapshot, makes the same parts again, with the same bits.

use serde::{Deserialize, Serialize};

use super::centres::is_by;
use super::linear::WHAT;
use super::linearisation::Linearisation;
use crate::corrections::extent::LEVELS;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Another set is made ready where something touched lies farther than this from the centres, mm:
/// early enough that it is whole before the tool has gone [`MOST_MM`].
const SLACK_MM: f32 = 5.0;
/// And at once where it lies farther than this: no step is made in a set that lies beside its
/// tools.
const MOST_MM: f32 = 9.0;
/// A centre is left out that lies this far from all that is touched, mm: a set that drags its past
/// along would grow without end.
const LEFT_MM: f32 = 12.0;

/// Parts of a set, about as long as each other: the elements and what they leave of the far clusters; the factor's pattern, and the factor.
pub(super) const WHOLE: u32 = 2;

/// A near set.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize, HeldBytes)]
pub struct Choice {
    /// How much of it has been made, up to [`WHOLE`]; nothing: there is no such set.
    pub(super) parts: u32,
    /// The level that it was asked for with, and that which it has: the widest below with few enough nodes.
    asked: u32,
    pub(super) level: u32,
    /// Ascending.
    #[serde(with = "crate::stored")]
    pub(super) centres: Vec<u32>,
    /// Where the tangent of its factor was taken.
    pub(super) tangent: Linearisation,
}

/// The set in force, and the one that will follow it.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize, HeldBytes)]
pub struct Course {
    /// Which the step iterates in.
    pub(super) now: Choice,
    /// Which is being made, if its `parts` are not zero.
    pub(super) next: Choice,
}

/// What a step asks of a near set.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// `[K,3]`, mm.
    pub rest: &'a [f32],
    /// Nodes that it has to lie about, thinned out and ascending.
    pub about: &'a [u32],
    /// How far it has to reach, as the last step has found ([`crate::corrections::extent`]).
    pub level: usize,
    /// It is the first of the step: the next set may go on.
    pub is_due: bool,
}

impl Choice {
    /// There is no such set.
    fn clear(&mut self) {
        self.parts = 0;
        self.centres.clear();
        self.tangent.clear();
    }

    /// Without allocating, after [`Choice::fit`].
    fn take(&mut self, other: &Choice) {
        (self.parts, self.asked, self.level) = (other.parts, other.asked, other.level);
        self.centres.clone_from(&other.centres);
        self.tangent.take(&other.tangent);
    }

    /// Room for another's lists.
    fn fit(&mut self, other: &Choice) -> Result<()> {
        memory::fit(&mut self.centres, other.centres.len(), WHAT)?;
        self.tangent.fit(&other.tangent)
    }

    /// Takes what is wanted, with no part made yet.
    fn set(&mut self, wanted: Wanted<'_>, level: usize) -> Result<()> {
        (self.parts, self.asked, self.level) = (0, wanted.level as u32, level as u32);
        self.tangent.clear();
        memory::replace(&mut self.centres, wanted.about, WHAT)
    }

    /// Whether all that is wanted lies within a distance of the centres.
    fn serves(&self, wanted: Wanted<'_>, distance: f32) -> bool {
        let is_near = |node: &u32| is_by(wanted.rest, &self.centres, *node, distance);
        self.parts > 0 && wanted.about.iter().all(is_near)
    }

    /// Whether no centre lies far from all that is wanted.
    fn is_tight(&self, wanted: Wanted<'_>) -> bool {
        let is_near = |node: &u32| is_by(wanted.rest, wanted.about, *node, LEFT_MM);
        self.centres.iter().all(is_near)
    }

    fn check(&self, nodes: usize) -> Result<()> {
        let sound = self.parts <= WHOLE
            && (self.asked.max(self.level) as usize) < LEVELS
            && self.centres.windows(2).all(|pair| pair[0] < pair[1])
            && (self.centres.last()).is_none_or(|&last| (last as usize) < nodes);
        match sound {
            true => self.tangent.check(nodes),
            false => Err(crate::Error::Snapshot(
                "holds corrections of another body".into(),
            )),
        }
    }
}

impl Course {
    /// There is no set.
    pub(super) fn clear(&mut self) {
        self.now.clear();
        self.next.clear();
    }

    /// Takes another's values, for which [`Course::fit`] has made room.
    pub(super) fn take(&mut self, other: &Course) {
        self.now.take(&other.now);
        self.next.take(&other.next);
    }

    /// Makes room for another's values, so that taking them does not fail.
    pub(super) fn fit(&mut self, other: &Course) -> Result<()> {
        self.now.fit(&other.now)?;
        self.next.fit(&other.next)
    }

    /// A copy.
    pub(super) fn copy(&self) -> Result<Course> {
        let mut copy = Course::default();
        copy.fit(self)?;
        copy.take(self);
        Ok(copy)
    }

    /// Whether there is a set.
    pub(in crate::corrections) fn is_any(&self) -> bool {
        self.now.parts > 0
    }

    /// Whether another set is on its way, or should be.
    pub(super) fn changes(&self, level: usize) -> bool {
        self.next.parts > 0 || self.now.asked as usize != level
    }

    /// Puts in force what a step wants at once, or the next set where it is whole; tells whether the set in force is another one now. `level_of` says how wide a set about
    /// some centres may be, of what is asked for.
    pub(super) fn go_on(
        &mut self,
        wanted: Wanted<'_>,
        level_of: impl Fn(&[u32], usize) -> usize,
    ) -> Result<bool> {
        let is_asked = self.next.asked as usize == wanted.level;
        let serves = self.now.serves(wanted, MOST_MM);
        // What is late needs another one that does not have to go soon.
        let reach = if serves { MOST_MM } else { SLACK_MM };
        let follows = is_asked && self.next.serves(wanted, reach);
        let is_whole = wanted.is_due && self.next.parts == WHOLE;
        if follows && (!serves || is_whole) {
            // Copied: with their places exchanged the lists would not have the room that going back takes.
            self.now.fit(&self.next)?;
            self.now.take(&self.next);
        } else if serves {
            return Ok(false);
        } else {
            let level = level_of(wanted.about, wanted.level);
            self.now.set(wanted, level)?;
        }
        self.now.parts = WHOLE;
        self.next.clear();
        Ok(true)
    }

    /// Asks for one part more of the next set, where the one in force no longer serves well; for none where it does again.
    pub(super) fn prepare(
        &mut self,
        wanted: Wanted<'_>,
        level_of: impl Fn(&[u32], usize) -> usize,
    ) -> Result<()> {
        let is_asked = |choice: &Choice| choice.asked as usize == wanted.level;
        if !is_asked(&self.now) {
            let level = level_of(&self.now.centres, wanted.level);
            if level == self.now.level as usize {
                // What is asked for is no wider than what there is.
                self.now.asked = wanted.level as u32;
            }
        }
        let serves =
            is_asked(&self.now) && self.now.serves(wanted, SLACK_MM) && self.now.is_tight(wanted);
        if !self.next.serves(wanted, MOST_MM) || !is_asked(&self.next) {
            self.next.clear();
        }
        match self.next.parts {
            0 if serves => {}
            0 => {
                let level = level_of(wanted.about, wanted.level);
                self.next.set(wanted, level)?;
                self.next.parts = 1;
            }
            parts => self.next.parts = (parts + 1).min(WHOLE),
        }
        Ok(())
    }

    /// Checks what was read, of a body of some nodes.
    pub(in crate::corrections) fn check(&self, nodes: usize) -> Result<()> {
        self.now.check(nodes)?;
        self.next.check(nodes)?;
        match self.now.parts {
            0 | WHOLE => Ok(()),
            _ => Err(crate::Error::Snapshot(
                "holds corrections that are made in part".into(),
            )),
        }
    }
}
