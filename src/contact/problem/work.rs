//! What a step may cost: the multiplications and the time that are left to its contact solves, and those that are left to the whole of it.
//!
//! Work is counted and not timed, so that a step has the same bits on every machine; only a host's budget is a time.
//!
//! REQ-046: The work of a step is bounded for any poses of tools, and what it left undone is told by a flag.

use crate::clock::Instant;
use crate::memory::HeldBytes;

/// Multiplications of a millisecond, nearly.
const WORK_A_MS: u64 = 4_000_000;
/// Work of the solves of a step at most, those of its substeps included: about five milliseconds.
const SOLVES_WORK: u64 = 20_000_000;
/// The same bound for a step in which no tool may lose its contact: a broad tool put into the tissue needs it to find its way out.
const LONGEST_SOLVES_WORK: u64 = 3 * SOLVES_WORK;
/// What is left when solves begin to take fewer samples.
const SHORT_OF_WORK: u64 = SOLVES_WORK / 2;
/// Work of a whole step at most, its iterations included, in which a tool leaps: about fifteen milliseconds.
const LEAP_WORK: u64 = 60_000_000;

/// What is left to the step being made.
#[derive(Debug, HeldBytes)]
pub struct Work {
    solves: u64,
    step: u64,
    /// The whole step's work is bounded.
    is_bounded: bool,
    /// When the step's budget of time ends.
    until: Option<Instant>,
}

impl Work {
    /// Of a step that begins, without a budget of time.
    pub fn new() -> Work {
        Work {
            solves: SOLVES_WORK,
            step: u64::MAX,
            is_bounded: false,
            until: None,
        }
    }

    /// Of a step whose tools may lose their contact, or leap; `more` for ties.
    pub fn of(may_lose: bool, is_bounded: bool, more: u64) -> Work {
        let solves = match may_lose {
            true => SOLVES_WORK,
            false => LONGEST_SOLVES_WORK,
        };
        Work {
            solves: solves + more,
            step: match is_bounded {
                true => LEAP_WORK + more,
                false => u64::MAX,
            },
            is_bounded,
            until: None,
        }
    }

    /// Takes off what a solve has cost.
    pub fn take(&mut self, work: u64) {
        self.solves = self.solves.saturating_sub(work);
        self.step = self.step.saturating_sub(work);
    }

    /// A solve begins: whether it is short of work.
    pub fn begin_solve(&mut self) -> bool {
        if self.is_spent() {
            self.solves = 0;
        }
        self.solves < SHORT_OF_WORK
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
    }

    /// Whether the solves of this step have taken their work or time, or the whole of it has.
    pub fn is_spent(&self) -> bool {
        let is_late = || self.until.is_some_and(|until| Instant::now() >= until);
        self.solves == 0 || self.step == 0 || is_late()
    }

    /// Whether a step whose whole work is bounded has taken its work or time, so that nothing more is to be tried.
    pub fn is_over(&self) -> bool {
        self.is_bounded && self.is_spent()
    }

    /// Takes what iterations have cost off the work of the whole step, in multiplications.
    pub fn charge(&mut self, work: u64) {
        self.step = self.step.saturating_sub(work);
    }

    /// Whether the whole step has so much work left; where it has not, it is cut short.
    pub fn affords(&mut self, work: u64) -> bool {
        let has = self.step >= work;
        if !has {
            self.step = 0;
        }
        has
    }

    /// Whether the whole step's work is done, and what it left out is to be told.
    pub fn is_cut_short(&self) -> bool {
        self.step == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_leap_cannot_afford_is_told() {
        let mut work = Work::of(true, true, 0);
        assert!(work.affords(LEAP_WORK) && !work.is_cut_short());
        assert!(!work.affords(LEAP_WORK + 1));
        assert!(work.is_cut_short() && work.is_spent() && work.is_over());
    }

    #[test]
    fn a_step_without_a_leap_is_not_bounded_as_a_whole() {
        let mut work = Work::of(true, false, 0);
        work.charge(u64::MAX / 2);
        assert!(work.affords(LEAP_WORK) && !work.is_spent());
        // Its solves are, and then nothing is cut short that a reading does not tell.
        work.take(SOLVES_WORK);
        assert!(work.is_spent() && !work.is_over() && !work.is_cut_short());
    }
}
