//! Random cases for the fuzz tests: a fixed number from a fixed seed, or new ones for `UPT_FUZZ_SECONDS`.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

fn number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    let parsed = text.parse();
    Some(parsed.unwrap_or_else(|_| panic!("{variable} is {text:?}; it must be a whole number")))
}

/// Runs `test` on `cases` values from seed 0. With `UPT_FUZZ_SECONDS` further rounds of as many cases follow until the
/// time is over, from `UPT_FUZZ_SEED` or from the clock; a failure names its seed and the smallest value that fails.
pub fn explore<S: Strategy>(cases: u32, strategy: &S, test: impl Fn(S::Value)) {
    let start = Instant::now();
    let seconds = number("UPT_FUZZ_SECONDS");
    let clock = || {
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |t| t.as_secs())
    };
    let first =
        number("UPT_FUZZ_SEED").unwrap_or_else(|| if seconds.is_some() { clock() } else { 0 });
    for seed in first.. {
        let mut bytes = [0; 32];
        bytes[..8].copy_from_slice(&seed.to_le_bytes());
        let config = Config {
            cases,
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
            panic!("UPT_FUZZ_SEED={seed}: {failure}");
        }
        if start.elapsed() >= Duration::from_secs(seconds.unwrap_or(0)) {
            return;
        }
    }
}
