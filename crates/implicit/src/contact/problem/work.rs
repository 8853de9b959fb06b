//! What a step may cost: the multiplications and the time that are left to its contact solves.
//!
//! Work is counted and not timed, so that a step has the same bits on every machine; only a host's budget is a time.
//!
//! REQ-046: The work of a step, and that of its contact solves, is bounded for any poses of tools (the first attempt takes the iterations that the host asks for; the whole is not, and the solves take twice that, where ties or loads act and the first guess is of no use), and what the solves left unsolved is told by a flag.

use crate::clock::Instant;
use crate::memory::HeldBytes;

/// Multiplications of a millisecond, nearly.
const WORK_A_MS: u64 = 4_000_000;
/// Work of the solves of a step at most, those of its substeps included: about five milliseconds.
const SOLVES_WORK: u64 = 20_000_000;
/// The same bound for a step in which no tool may lose its contact: a broad tool put into the tissue needs it to find its way out.
const LONGEST_SOLVES_WORK: u64 = 3 * SOLVES_WORK;
/// The same bound for a step in which a tool was put elsewhere, whether or not one may lose its contact: where that tool comes to is found over the steps
/// that follow.
const LEAP_SOLVES_WORK: u64 = SOLVES_WORK / 2;
/// Work of what a step does beyond its first attempt and those of its substeps, iterations and what they are made with included, at least and for each node: about
/// forty milliseconds at 21,708 nodes. A first attempt takes the iterations that the host asks for, in a near set of any size; those that follow it have lost the tools before.
const STEP_WORK: u64 = 2 * FAR_WORK;
const STEP_WORK_A_NODE: u64 = 7_500;
/// Work of a whole step where tools go farther than hands do: about twenty milliseconds. In such a step the tissue is far from balance, and comes to it over the
/// steps that follow.
const FAR_WORK: u64 = 80_000_000;
/// What of that a base leaves to its iterations.
const ITERATIONS_WORK: u64 = FAR_WORK / 3;
/// What is left when solves begin to take fewer samples.
const SHORT_OF_WORK: u64 = SOLVES_WORK / 2;

/// Parts of the tools' ways in a step that has taken its work, or its time, or in a leap half of it.
const LEAST_PARTS: u32 = 4;
const LATE_PARTS: u32 = 2;

/// What is left to the step being made.
#[derive(Debug, HeldBytes)]
pub struct Work {
    solves: u64,
    /// A tool was put elsewhere, and comes out of the tissue over a few steps.
    leaps: bool,
    /// What that has taken off the solves; a step that has to end well gets it back.
    spared: u64,
    /// What is left to the whole step: of [`STEP_WORK`], or of [`FAR_WORK`] where tools go farther than hands do.
    whole: u64,
    /// A first attempt at the step, or at one of its substeps, is being made.
    is_first: bool,
    is_bounded: bool,
    /// When the step's budget of time ends, and when half of it is over.
    until: Option<Instant>,
    half: Option<Instant>,
}

impl Work {
    /// Of a step that begins, without a budget of time.
    pub fn new() -> Work {
        Work {
            solves: SOLVES_WORK,
            leaps: false,
            spared: 0,
            whole: STEP_WORK,
            is_first: true,
            is_bounded: false,
            until: None,
            half: None,
        }
    }

    /// Of a step of so many nodes whose tools may lose their contact; `more` for ties.
    pub fn of(nodes: usize, may_lose: bool, more: u64) -> Work {
        let solves = match may_lose {
            true => SOLVES_WORK,
            false => LONGEST_SOLVES_WORK,
        };
        Work {
            solves: solves + more,
            whole: STEP_WORK.max(STEP_WORK_A_NODE * nodes as u64),
            ..Work::new()
        }
    }

    /// An attempt begins: the first at a step or a substep, or another.
    pub fn attempt(&mut self, is_first: bool) {
        self.is_first = is_first;
    }

    /// A step whose guess is of no use begins again.
    pub fn renew(&mut self) {
        self.solves = self.solves.max(SOLVES_WORK);
        self.whole = self.whole.max(SOLVES_WORK);
    }

    /// No bound on the work of the whole step: it has to end well.
    pub fn unbound(&mut self) {
        (self.whole, self.is_bounded, self.leaps) = (u64::MAX, false, false);
        self.solves += std::mem::take(&mut self.spared);
    }

    /// Takes off what a solve has cost.
    pub fn take(&mut self, work: u64) {
        self.solves = self.solves.saturating_sub(work);
        self.take_whole(work);
    }

    /// Takes off what something else of the step has cost.
    pub fn take_whole(&mut self, work: u64) {
        if self.counts() {
            self.whole = self.whole.saturating_sub(work);
        }
    }

    fn counts(&self) -> bool {
        self.is_bounded || !self.is_first
    }

    /// Takes off what a base of iterations has cost: some of them are still made, or it would have been of no use.
    pub fn take_base(&mut self, work: u64) {
        if self.counts() {
            let least = self.whole.min(ITERATIONS_WORK);
            self.whole = self.whole.saturating_sub(work).max(least);
        }
    }

    /// Bounds the work of a step whose tools go farther than hands do, in which one `leaps` or not.
    pub fn bound(&mut self, leaps: bool) {
        self.whole = self.whole.min(FAR_WORK);
        self.is_bounded = true;
        self.leaps |= leaps;
        if leaps {
            let left = self.solves.min(LEAP_SOLVES_WORK);
            self.spared += self.solves - left;
            self.solves = left;
        }
    }

    /// Whether tools go farther than hands do, so that the step ends early.
    pub fn is_bounded(&self) -> bool {
        self.is_bounded
    }

    /// A solve begins: whether it is short of work, or of time.
    pub fn begin_solve(&mut self) -> bool {
        if self.is_spent() {
            self.solves = 0;
        }
        self.solves < SHORT_OF_WORK || self.is_hasty()
    }

    /// What a solve may take.
    pub fn for_solve(&self) -> u64 {
        let left = |until: Instant| until.saturating_duration_since(Instant::now());
        let in_time = self.until.map_or(u64::MAX, |until| {
            WORK_A_MS * left(until).as_micros() as u64 / 1000
        });
        self.solves.min(in_time)
    }

    /// Sets when the step's budget of time ends. From then on its solves take the least work.
    pub fn end_by(&mut self, until: Option<Instant>) {
        self.until = until;
        let now = Instant::now();
        let left = until.map(|until| until.saturating_duration_since(now));
        self.half = left.map(|left| now + left / 2);
    }

    /// Whether half of the step's budget of time, or of its whole work, is over: too late for iterations that a guess could do without.
    pub fn is_half_over(&self) -> bool {
        self.half.is_some_and(|half| Instant::now() >= half) || self.whole <= FAR_WORK / 2
    }

    /// Whether a step that is bounded begins no near set any more. A tool that was put elsewhere comes out of the tissue over the steps that follow: iterations about
    /// where it is now, in a near set that would have to be made, bring nothing that those of the next step do not.
    pub fn is_short(&self) -> bool {
        self.leaps || (self.is_bounded() && self.is_half_over())
    }

    /// Whether it is a leap, half of whose budget is over: the rest of the step takes the least work.
    fn is_hasty(&self) -> bool {
        self.leaps && self.is_half_over()
    }

    /// Whether the step's budget of time, or its whole work, is over.
    pub fn is_late(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until) || self.whole == 0
    }

    /// Whether the solves of this step have taken their work or time.
    pub fn is_spent(&self) -> bool {
        self.solves == 0 || self.is_late()
    }

    /// The part of `parts` of the tools' ways to take after part `part`: the next, or one of `LEAST_PARTS` once the solves have taken their work or time, or in a leap half of it.
    pub fn next_part(&self, part: u32, parts: u32) -> u32 {
        let stride = match self.is_spent() || self.is_hasty() {
            true => parts.div_ceil(self.least_parts()),
            false => 1,
        };
        (part + stride).min(parts)
    }

    /// Parts of the tools' ways where there is little work or time left.
    pub(super) fn least_parts(&self) -> u32 {
        if self.is_late() || self.is_hasty() {
            LATE_PARTS
        } else {
            LEAST_PARTS
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Verifies REQ-046.
    #[test]
    fn every_step_ends_and_one_of_leaps_sooner() {
        let (mut hand, mut leap) = (Work::of(1000, true, 0), Work::of(1000, true, 0));
        leap.bound(true);
        let steps = |work: &mut Work| {
            let mut left = 0..;
            left.find(|_| {
                work.take_whole(1_000_000);
                work.is_spent()
            })
        };
        // The iterations that a host asks for are made, however large the near set.
        hand.take_whole(u64::MAX / 2);
        assert!(!hand.is_late());
        hand.attempt(false);
        let (hand, leap) = (steps(&mut hand), steps(&mut leap));
        assert!(leap < hand && hand < Some(1000), "{leap:?} {hand:?}");
        // Where no state may be left inside out none ends early.
        let mut sound = Work::of(1000, true, 0);
        sound.unbound();
        sound.take_whole(u64::MAX / 2);
        assert!(!sound.is_late());
    }
}
