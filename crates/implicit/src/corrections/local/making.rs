//! How long a near set takes to be made, on the machine that the scene runs on: what a step with a budget of time asks before it makes one.

use std::time::Duration;

use crate::contact::Work;

/// The last near set that was made at once, with its factor. It says nothing before there was one.
#[derive(Default)]
pub(in crate::corrections) struct Making {
    took: Duration,
}

impl Making {
    /// One has been made.
    pub(super) fn took(&mut self, took: Duration) {
        self.took = took;
    }

    /// Whether another one ends before twice the step's budget is over. Each time that it does not the next is taken to be shorter: the machine may have been
    /// busy with something else.
    pub fn fits(&mut self, work: &Work) -> bool {
        let fits = work.ends_in_twice(self.took);
        if !fits {
            self.took = self.took * 7 / 8;
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Instant;

    const HOUR: Duration = Duration::from_secs(3600);

    /// What takes an hour and a half fits into twice an hour, what takes three does not; told so often enough it is tried again. Without a budget, or before a set was
    /// made, all fits.
    #[test]
    fn a_set_fits_into_twice_the_budget() {
        let mut work = Work::new();
        let mut making = Making::default();
        making.took(100 * HOUR);
        assert!(making.fits(&work));
        work.end_by(Some(Instant::now() + HOUR));
        assert!(Making::default().fits(&work));
        making.took(HOUR * 3 / 2);
        assert!(making.fits(&work));
        making.took(3 * HOUR);
        assert!(!making.fits(&work));
        assert!((0..4).any(|_| making.fits(&work)));
    }
}
