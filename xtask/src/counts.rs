//! What a stage came to: how many tests passed, read out of what the test programs of each language print, and why not all.

use std::ops::AddAssign;

use crate::process::Finished;

/// Passed, failed and skipped tests of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub passed: u64,
    pub failed: u64,
    pub skipped: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} passed, {} failed, {} skipped",
            self.passed, self.failed, self.skipped
        )
    }
}

/// What a stage reports.
#[derive(Default)]
pub struct Outcome {
    pub counts: Counts,
    /// Why something failed or was skipped; empty where all passed.
    pub note: String,
    /// The end of the log where something failed.
    pub log_tail: String,
    /// The stage did not run at all.
    pub left_out: bool,
}

impl Outcome {
    pub fn failed(note: String) -> Self {
        Self {
            note,
            counts: whole(false),
            ..Self::default()
        }
    }

    pub fn skipped(note: &str) -> Self {
        let mut outcome = Self::failed(note.into());
        (outcome.counts.failed, outcome.counts.skipped) = (0, 1);
        outcome.left_out = true;
        outcome
    }

    /// The counts of a program that ran; one that failed without a failed test counts as one failure.
    pub fn of(finished: &Finished, counts: Counts) -> Self {
        let mut outcome = Self {
            counts,
            ..Self::default()
        };
        if !finished.success && counts.failed == 0 {
            outcome.counts.failed = 1;
        }
        if finished.success && counts == Counts::default() {
            outcome = Self::failed("ran no tests".into());
        }
        if outcome.counts.failed > 0 {
            if outcome.note.is_empty() {
                outcome.note = format!("see {}", finished.log.display());
            }
            outcome.log_tail = finished.tail(40);
        }
        outcome
    }

    /// Both.
    pub fn and(mut self, other: Self) -> Self {
        self.counts += other.counts;
        for (all, one) in [
            (&mut self.note, other.note),
            (&mut self.log_tail, other.log_tail),
        ] {
            let between = if all.is_empty() || one.is_empty() {
                ""
            } else {
                "\n"
            };
            *all = format!("{all}{between}{one}");
        }
        self
    }
}

/// A check that passed or failed as a whole.
pub fn whole(success: bool) -> Counts {
    Counts {
        passed: u64::from(success),
        failed: u64::from(!success),
        skipped: 0,
    }
}

/// Counts of a line, by the words that stand directly behind the numbers, as in `12 passed`.
fn counts_of(line: &str) -> Counts {
    let mut counts = Counts::default();
    let tokens = line.split(|c: char| !c.is_alphanumeric());
    let tokens: Vec<&str> = tokens.filter(|token| !token.is_empty()).collect();
    for pair in tokens.windows(2) {
        let Ok(number) = pair[0].parse::<u64>() else {
            continue;
        };
        match pair[1] {
            "passed" | "xfailed" => counts.passed += number,
            "failed" | "error" | "errors" | "xpassed" => counts.failed += number,
            "skipped" | "ignored" | "deselected" => counts.skipped += number,
            _ => {}
        }
    }
    counts
}

/// Sum over the `test result:` lines of `cargo test`.
pub fn cargo(text: &str) -> Counts {
    let mut counts = Counts::default();
    let lines = text.lines().filter(|line| line.starts_with("test result:"));
    lines.for_each(|line| counts += counts_of(line));
    counts
}

/// The last line of pytest's output, `12 passed, 1 skipped in 3.21s`.
pub fn pytest(text: &str) -> Counts {
    let sums = |line: &&str| line.contains(" in ") && counts_of(line) != Counts::default();
    let line = text.lines().rev().find(sums);
    line.map(counts_of).unwrap_or_default()
}

/// The line `N passed, N failed, N skipped` that the repository's own test scripts end with; nothing without one.
pub fn script(text: &str) -> Counts {
    let sums = |line: &&str| {
        ["passed", "failed", "skipped"]
            .iter()
            .all(|word| line.contains(word))
    };
    let line = text.lines().rev().find(sums);
    line.map(counts_of).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cargo_results_are_summed_over_test_programs() {
        let text = "running 3 tests\n\
            test result: ok. 3 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.1s\n\
            noise: 7 passed\n\
            test result: FAILED. 4 passed; 2 failed; 1 ignored; 0 measured; 0 filtered out; finished in 1.2s\n";
        assert_eq!(
            cargo(text),
            Counts {
                passed: 7,
                failed: 2,
                skipped: 1
            }
        );
    }

    #[test]
    fn pytest_summaries_count_errors_as_failures() {
        let text = "....F\n== 1 failed, 12 passed, 3 skipped, 2 errors in 4.20s ==\n";
        assert_eq!(
            pytest(text),
            Counts {
                passed: 12,
                failed: 3,
                skipped: 3
            }
        );
        assert_eq!(pytest("no tests ran in 0.01s"), Counts::default());
    }

    #[test]
    fn a_script_without_a_summary_has_no_counts() {
        assert_eq!(script("all good\n"), Counts::default());
        let text = "1 passed, 0 failed, 0 skipped\nmore\n5 passed, 1 failed, 2 skipped\n";
        assert_eq!(
            script(text),
            Counts {
                passed: 5,
                failed: 1,
                skipped: 2
            }
        );
    }
}
