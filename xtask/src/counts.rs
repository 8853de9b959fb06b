//! Reading how many tests passed out of what the test programs of each language print.

use std::ops::AddAssign;

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

/// Numbers that stand directly before (`"12 passed"`) one of `words`.
fn number_before(line: &str, words: &[&str]) -> u64 {
    let tokens: Vec<&str> = line
        .split(|c: char| !c.is_alphanumeric())
        .filter(|t| !t.is_empty())
        .collect();
    tokens
        .windows(2)
        .filter(|pair| words.contains(&pair[1]))
        .filter_map(|pair| pair[0].parse::<u64>().ok())
        .sum()
}

/// Sum over the `test result:` lines of `cargo test`.
pub fn cargo(text: &str) -> Counts {
    let mut counts = Counts::default();
    for line in text.lines().filter(|line| line.starts_with("test result:")) {
        counts += Counts {
            passed: number_before(line, &["passed"]),
            failed: number_before(line, &["failed"]),
            skipped: number_before(line, &["ignored"]),
        };
    }
    counts
}

/// The last line of pytest's output, `12 passed, 1 skipped in 3.21s`.
pub fn pytest(text: &str) -> Counts {
    let line = text
        .lines()
        .rev()
        .find(|line| {
            line.contains(" in ")
                && (line.contains("passed") || line.contains("failed") || line.contains("error"))
        })
        .unwrap_or("");
    Counts {
        passed: number_before(line, &["passed", "xfailed"]),
        failed: number_before(line, &["failed", "error", "errors", "xpassed"]),
        skipped: number_before(line, &["skipped", "deselected"]),
    }
}

/// The line `N passed, N failed, N skipped` that the repository's own test scripts end with.
pub fn script(text: &str) -> Option<Counts> {
    text.lines()
        .rev()
        .map(str::trim)
        .find(|line| line.contains("passed") && line.contains("failed") && line.contains("skipped"))
        .map(|line| Counts {
            passed: number_before(line, &["passed"]),
            failed: number_before(line, &["failed"]),
            skipped: number_before(line, &["skipped"]),
        })
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
        assert_eq!(script("all good\n"), None);
        let text = "1 passed, 0 failed, 0 skipped\nmore\n5 passed, 1 failed, 2 skipped\n";
        assert_eq!(
            script(text),
            Some(Counts {
                passed: 5,
                failed: 1,
                skipped: 2
            })
        );
    }
}
