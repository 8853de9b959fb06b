//! Random cases for the fuzz tests, by the clock: rounds of a fixed size, each from a seed of its own, until the time is
//! over. What a round does follows from its seed alone.
//!
//! `UPT_FUZZ_SECONDS` (20) is the time of the longest test, others take a share of it; a least number of rounds always
//! runs. `UPT_FUZZ_SEED` (0) is the first round's seed, the next ones follow it.

use std::io::Write;
use std::time::{Duration, Instant};

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

fn number(variable: &str, default: u64) -> u64 {
    match std::env::var(variable) {
        Ok(text) => text
            .parse()
            .unwrap_or_else(|_| panic!("{variable} is {text:?}; it must be a whole number")),
        Err(_) => default,
    }
}

/// How long a test goes on.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// Part of the time.
    pub share: f64,
    /// Cases of a round.
    pub round: u32,
    /// Rounds that run even when the time is over.
    pub least_rounds: u64,
}

/// Runs `test` on values of `strategy` for its share of the time. At the end it says how many `what` ran from which
/// seeds; a failure names its seed and the smallest value that fails.
pub fn explore<S: Strategy>(what: &str, budget: Budget, strategy: &S, test: impl Fn(S::Value)) {
    let start = Instant::now();
    let time = Duration::from_secs_f64(number("UPT_FUZZ_SECONDS", 20) as f64 * budget.share);
    let first = number("UPT_FUZZ_SEED", 0);
    for seed in first.. {
        let mut bytes = [0; 32];
        bytes[..8].copy_from_slice(&seed.to_le_bytes());
        let config = Config {
            cases: budget.round,
            failure_persistence: None,
            max_shrink_iters: 500,
            ..Config::default()
        };
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
        let outcome = TestRunner::new_with_rng(config, rng).run(strategy, |value| {
            test(value);
            Ok(())
        });
        if let Err(failure) = outcome {
            panic!("{what}: UPT_FUZZ_SEED={seed} UPT_FUZZ_SECONDS=0 repeats this: {failure}");
        }
        let rounds = seed - first + 1;
        if start.elapsed() >= time && rounds >= budget.least_rounds {
            let cases = u64::from(budget.round) * rounds;
            let seconds = start.elapsed().as_secs_f64();
            // Past the test's captured output, so that a log has it also where all is well.
            let _ = writeln!(
                std::io::stderr(),
                "fuzz: {cases} {what} in {seconds:.0} s, {} a round, UPT_FUZZ_SEED {first} to {seed}",
                budget.round
            );
            return;
        }
    }
}
