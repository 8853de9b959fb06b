//! Whether the workers of a pool help: what takes turns with them and without them, and goes on with what was faster.
//!
//! Beside another program's threads a worker may run on the caller's own core, or lose its core in the middle of a chunk. No number that a caller could
//! ask the system for tells how that goes, so it is measured.

use std::time::Duration;

/// Times of each kind that are remembered; their median counts.
const REMEMBERED: usize = 5;
/// One of so many goes the other way, to see whether the machine has changed.
const PROBE: u32 = 16;
/// Workers are left out unless they make it this much shorter.
const GAIN: f32 = 0.95;

/// What has been measured.
#[derive(Default)]
pub struct Turns {
    /// Questions so far: every [`PROBE`]th goes the other way.
    count: u32,
    /// Seconds with workers, and without them; how many there have been.
    times: [[f32; REMEMBERED]; 2],
    seen: [usize; 2],
}

impl Turns {
    /// Whether workers are left out of the next.
    pub fn next_is_alone(&mut self) -> bool {
        self.count = self.count.wrapping_add(1);
        if self.seen.iter().any(|seen| *seen < REMEMBERED) {
            return self.seen[1] < self.seen[0];
        }
        let [with, without] = self.times.map(median);
        let is_alone = with > GAIN * without;
        is_alone != self.count.is_multiple_of(PROBE)
    }

    /// Takes how long one took.
    pub fn take(&mut self, is_alone: bool, took: Duration) {
        let kind = usize::from(is_alone);
        self.times[kind][self.seen[kind] % REMEMBERED] = took.as_secs_f32();
        self.seen[kind] += 1;
    }
}

/// A median, so that one time during which others kept the core busy does not move it.
fn median(mut times: [f32; REMEMBERED]) -> f32 {
    times.sort_unstable_by(f32::total_cmp);
    times[REMEMBERED / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of `count` were without workers, where these take `with` and `without` milliseconds.
    fn alone(turns: &mut Turns, count: usize, with: u64, without: u64) -> usize {
        let one = |_| {
            let is_alone = turns.next_is_alone();
            let took = if is_alone { without } else { with };
            turns.take(is_alone, Duration::from_millis(took));
            usize::from(is_alone)
        };
        (0..count).map(one).sum()
    }

    #[test]
    fn what_is_faster_goes_on_and_the_other_is_tried_again() {
        let mut turns = Turns::default();
        assert_eq!(alone(&mut turns, 10, 3, 5), 5);
        // Workers help: one of sixteen is without them.
        assert_eq!(alone(&mut turns, 160, 3, 5), 10);
        // They no longer do.
        alone(&mut turns, 160, 6, 5);
        assert_eq!(alone(&mut turns, 160, 6, 5), 150);
        // And do again.
        alone(&mut turns, 160, 3, 5);
        assert_eq!(alone(&mut turns, 160, 3, 5), 10);
    }
}
