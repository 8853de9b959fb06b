//! What a stage came to: how many tests passed, read out of what the test programs of each language print, and why not all.

use std::ops::AddAssign;
use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::process::{Finished, run_logged};
use crate::workspace::Workspace;

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
        let (passed, failed, skipped) = (self.passed, self.failed, self.skipped);
        write!(f, "{passed} passed, {failed} failed, {skipped} skipped")
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
        let mut outcome = Self::default();
        (outcome.counts.failed, outcome.note) = (1, note);
        outcome
    }

    pub fn skipped(note: &str) -> Self {
        let mut outcome = Self::default();
        (outcome.counts.skipped, outcome.note) = (1, note.into());
        outcome.left_out = true;
        outcome
    }

    /// The counts of a program that ran; one that failed without a failed test counts as one failure.
    pub fn of(finished: &Finished, counts: Counts) -> Self {
        if finished.success && counts == Counts::default() {
            return Self::failed("ran no tests".into());
        }
        let lines = |tells: fn(&&str) -> bool| finished.text.lines().filter(tells).collect();
        let mut outcome = Self {
            counts,
            ..Self::default()
        };
        if !finished.success && counts.failed == 0 {
            outcome.counts.failed = 1;
        }
        if outcome.counts.failed > 0 {
            let failed: Vec<&str> = lines(|line| {
                line.contains("FAILED") || line.starts_with("error") || line.contains("panicked at")
            });
            outcome.note = format!("see {}", finished.log.display());
            outcome.log_tail = format!("{}\n{}", failed.join("\n"), finished.tail(40));
        } else if counts.skipped > 0 {
            let why: Vec<&str> = lines(|line| line.to_lowercase().contains("skipped:"));
            outcome.note = why.join("; ");
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
            *all = format!("{all}\n{one}").trim().to_owned();
        }
        self
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

/// The last summary: pytest's `12 passed, 1 skipped in 3.21s`, or the line `N passed, N failed, N skipped` that the
/// repository's own test scripts end with; nothing without one.
pub fn summary(text: &str) -> Counts {
    let is_script = |line: &&str| {
        ["passed", "failed", "skipped"]
            .iter()
            .all(|word| line.contains(word))
    };
    let is_pytest = |line: &&str| line.contains(" in ") && counts_of(line) != Counts::default();
    let mut lines = text.lines().rev();
    let line = lines.find(|line| is_script(line) || is_pytest(line));
    line.map(counts_of).unwrap_or_default()
}

/// Runs a test script with what it finds its parts by.
pub fn script(
    workspace: &Workspace,
    name: &str,
    words: &str,
    environment: &[(&str, &Path)],
) -> Result<Outcome> {
    let mut command = workspace.bash(words);
    workspace.with_parts(&mut command)?;
    command.envs(environment.iter().copied());
    counted(workspace, name, &mut command, summary)
}

/// Runs tests and reads their counts out of what they print.
pub fn counted(
    workspace: &Workspace,
    label: &str,
    command: &mut Command,
    read: fn(&str) -> Counts,
) -> Result<Outcome> {
    let finished = run_logged(workspace, label, command)?;
    Ok(Outcome::of(&finished, read(&finished.text)))
}

/// A check that passes or fails as a whole.
pub fn check(workspace: &Workspace, label: &str, command: &mut Command) -> Result<Outcome> {
    let finished = run_logged(workspace, label, command)?;
    let mut counts = Counts::default();
    counts.passed += u64::from(finished.success);
    Ok(Outcome::of(&finished, counts))
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
        assert_eq!(cargo(text).to_string(), "7 passed, 2 failed, 1 skipped");
    }

    #[test]
    fn the_last_summary_counts() {
        let pytest = "....F\n== 1 failed, 12 passed, 3 skipped, 2 errors in 4.20s ==\n";
        let read = |text| summary(text).to_string();
        assert_eq!(read(pytest), "12 passed, 3 failed, 3 skipped");
        let script = "1 passed, 0 failed, 0 skipped\nmore\n5 passed, 1 failed, 2 skipped\n";
        assert_eq!(read(script), "5 passed, 1 failed, 2 skipped");
        for text in ["no tests ran in 0.01s", "all good\n"] {
            assert_eq!(summary(text), Counts::default());
        }
    }
}
