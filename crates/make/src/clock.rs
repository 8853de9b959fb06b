//! The time of a run (`--minutes`, by the clock), and the part of it that is over when a stage must have ended.
//!
//! What every bundle needs (columns, modes, tables) cannot be made smaller, so it ends the run where it would take longer. What comes after
//! stops where its time is up.

use std::time::{Duration, Instant};

use anyhow::{Error, Result, anyhow};

use crate::prior::Made;

/// Parts of the time: by then the columns are there, the natural modes, the tables.
pub const COLUMNS: f64 = 0.5;
pub const MODES: f64 = 0.6;
pub const TABLES: f64 = 0.7;
/// From then on the coarse space is made from the patches that are there.
pub const PATCHED: f64 = 0.3;
/// From then on no equilibrium is computed.
pub const REFINED: f64 = 0.4;
/// From then on no tool is simulated but by the check.
pub const LEARNED: f64 = 0.75;
/// Part of the time that the check has whatever came before.
pub const LEAST_CHECKED: f64 = 0.1;
/// A rate says nothing before it was measured for so long, s.
const MEASURED_S: f64 = 2.0;
/// Columns that would end at so many times their time are not waited for.
const HOPELESS: f64 = 1.5;
/// What ended unmeasured may need so many times what was spent.
const MORE: f64 = 1.5;

/// When the run began, and what it has.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    started: Instant,
    minutes: f64,
}

impl Clock {
    pub fn start(minutes: f64) -> Self {
        Self {
            started: Instant::now(),
            minutes,
        }
    }

    /// All of the time, s.
    pub fn budget(&self) -> f64 {
        60.0 * self.minutes
    }

    /// What this run has taken so far, s.
    pub fn spent(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// What is left until a part of the time is over, s; below 0 after that.
    pub fn left(&self, part: f64) -> f64 {
        part * self.budget() - self.spent()
    }

    /// When a part of the time is over.
    pub fn until(&self, part: f64) -> Instant {
        self.started + Duration::from_secs_f64(part * self.budget())
    }

    /// Whether a stage that every bundle needs may go on.
    pub fn go_on(&self, part: f64, what: &str) -> Result<()> {
        match self.left(part) > 0.0 {
            true => Ok(()),
            // Nobody knows how much is missing.
            false => Err(self.too_short(what, MORE * self.spent(), part)),
        }
    }

    /// Whether the columns will be there in time, by their rate so far.
    pub fn columns(&self, made: Made) -> Result<()> {
        let left = self.left(COLUMNS);
        let each = made.seconds / made.here.max(1) as f64;
        let ahead = each * (made.rows - made.done) as f64;
        let hopeless = made.seconds > MEASURED_S && ahead > HOPELESS * left;
        if left > 0.0 && !hopeless {
            return Ok(());
        }
        let what = format!(
            "{} of {} columns of the linear response are there after {:.0} s",
            made.done,
            made.rows,
            self.spent()
        );
        Err(self.too_short(&what, self.spent() + ahead, COLUMNS))
    }

    /// `seconds` are known to be needed for what may take a part of the time.
    fn too_short(&self, what: &str, seconds: f64, part: f64) -> Error {
        anyhow!(
            "--minutes {} is too short for this body on this machine: {what}; give --minutes {} or more (the same command goes on from there), \
             or a smaller --domain, or fewer --nodes",
            self.minutes,
            rounded_up(1.1 * seconds / part / 60.0)
        )
    }
}

/// Two digits, rounded up.
fn rounded_up(x: f64) -> f64 {
    let unit = 10f64.powf(x.max(1e-3).log10().floor() - 1.0);
    let up = (x / unit).ceil() * unit;
    format!("{up:.4}").parse().unwrap_or(up)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advised(error: &Error) -> f64 {
        let text = error.to_string();
        let words = text.split("give --minutes ").nth(1).unwrap();
        words.split(' ').next().unwrap().parse().unwrap()
    }

    #[test]
    fn columns_that_cannot_be_there_in_time_are_refused_at_once_with_the_minutes_that_they_need() {
        let clock = Clock::start(10.0);
        let made = |done, seconds| Made {
            done,
            here: done,
            rows: 1000,
            seconds,
        };
        // 5 of the 10 minutes are for columns: 100 in 20 s are in time, in 60 s are not.
        clock.columns(made(100, 20.0)).unwrap();
        let error = clock.columns(made(100, 60.0)).unwrap_err();
        assert!(error.to_string().contains("100 of 1000 columns"), "{error}");
        // 900 more at 0.6 s each: 9 minutes, in half of the time.
        let needed = advised(&error);
        assert!((18.0..22.0).contains(&needed), "{error}");
        // Two quick columns say nothing of the others.
        clock.columns(made(2, 1.9)).unwrap();
        // What was made in an earlier run says nothing of this one's rate.
        let kept = Made {
            here: 10,
            ..made(910, 6.0)
        };
        clock.columns(kept).unwrap();
    }

    #[test]
    fn without_time_every_part_is_refused_and_the_check_has_its_least() {
        let clock = Clock::start(1e-9);
        std::thread::sleep(Duration::from_millis(1));
        for part in [COLUMNS, MODES, TABLES] {
            let error = clock.go_on(part, "the columns took 3 s").unwrap_err();
            assert!(
                error.to_string().contains("the columns took 3 s"),
                "{error}"
            );
            assert!(advised(&error) > 0.0);
        }
        assert!(clock.left(1.0) < 0.0);
        Clock::start(10.0).go_on(COLUMNS, "").unwrap();
    }

    #[test]
    fn minutes_are_rounded_up_to_two_digits() {
        for (x, up) in [(17.21, 18.0), (0.314, 0.32), (120.0, 120.0), (101.0, 110.0)] {
            assert_eq!(rounded_up(x), up);
        }
    }
}
