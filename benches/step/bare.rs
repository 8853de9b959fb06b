//! A loop in registers, about as long as a step: its own tail is the machine's, not the library's.

use std::hint::black_box;
use std::time::Instant;

/// Longest loop, ms: beyond it the tail of a step is long against any neighbour's slice.
const LONGEST_MS: f64 = 5.0;

pub struct BareLoop {
    turns: u64,
}

impl BareLoop {
    /// A loop of `ms` on this core.
    pub fn of(ms: f64) -> Self {
        const TRIAL: u64 = 200_000;
        let trial = Self { turns: TRIAL };
        let fastest = (0..5).map(|_| trial.run()).fold(f64::INFINITY, f64::min);
        let turns = (TRIAL as f64 * ms.min(LONGEST_MS) / fastest).max(1.0);
        Self {
            turns: turns as u64,
        }
    }

    /// Runs it once; wall time, ms.
    pub fn run(&self) -> f64 {
        let start = Instant::now();
        let mut x = black_box(0.5f32);
        for _ in 0..self.turns {
            x = x * 0.999 + 0.001;
        }
        black_box(x);
        start.elapsed().as_secs_f64() * 1e3
    }
}
