//! The tail of the steps on an idle machine, as far as the machine was one.
//!
//! Cores, cache and memory may be shared with neighbours that the system does not show. The bare loop that takes turns with the steps
//! tells when they were at work: the steps are cut into windows of [`WINDOW`], and those count in which the loop's own
//! longest run stayed within [`STEADY`] of its median. Each step is compared with the median step of its window.

use gauge::{Sorted, median};

/// Steps in a window, and as many runs of the bare loop.
const WINDOW: usize = 20;
/// Longest over median of the bare loop in a window that counts.
const STEADY: f64 = 1.2;
/// Steps below which a p99 says nothing.
const LEAST: usize = 200;

/// What the windows say.
pub struct Steady {
    /// p99 of a step over the median of its window; `None` where too few windows count.
    pub p99: Option<f64>,
    pub counted: usize,
    pub windows: usize,
}

impl Steady {
    /// Of `steps` and the runs of the bare loop after each, in the order of time.
    pub fn of(steps: &[f64], bare: &[f64]) -> Self {
        let mut ratios = Vec::new();
        for (steps, bare) in steps.chunks_exact(WINDOW).zip(bare.chunks_exact(WINDOW)) {
            let longest = bare.iter().copied().fold(0.0, f64::max);
            if longest <= STEADY * median(bare) {
                let middle = median(steps);
                ratios.extend(steps.iter().map(|step| step / middle));
            }
        }
        Self {
            p99: (ratios.len() >= LEAST).then(|| Sorted::of(&ratios).quantile(0.99)),
            counted: ratios.len() / WINDOW,
            windows: steps.len() / WINDOW,
        }
    }
}
