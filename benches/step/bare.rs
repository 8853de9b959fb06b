//! A loop without any of the library's work, timed between two steps: its own tail is the machine's, not the library's.
//!
//! For a step that is bound by the processor it is a matrix product in cache, about as long as the step: a neighbour on the
//! same core takes from its throughput as from the step's. (A chain of dependent operations in registers would not notice.)
//! For a reduced bundle, whose step mostly reads tables, it reads as many bytes of the same tables: what others do to
//! the shared cache and memory meets both. Both run on one thread.

use std::hint::black_box;
use std::time::Instant;

use upt::kernels::Isa;
use upt::kernels::decoder::probe::GemmProbe;
use upt::kernels::rows::Stored;
use upt::prior::PriorTable;

/// Longest product, ms: beyond it the tail of a step is long against any neighbour's slice.
const LONGEST_MS: f64 = 5.0;

pub enum BareLoop<'a> {
    Product {
        probe: GemmProbe,
        turns: usize,
    },
    Reading {
        tables: [Stored<'a>; 2],
        bytes: usize,
    },
}

impl<'a> BareLoop<'a> {
    /// Products of `ms` on this core.
    pub fn product(ms: f64) -> Self {
        const TRIAL: usize = 100;
        let mut trial = Self::Product {
            probe: GemmProbe::default(),
            turns: TRIAL,
        };
        let fastest = (0..5).map(|_| trial.run()).fold(f64::INFINITY, f64::min);
        let turns = (TRIAL as f64 * ms.min(LONGEST_MS) / fastest).max(1.0);
        Self::Product {
            probe: GemmProbe::default(),
            turns: turns as usize,
        }
    }

    /// A loop over the first `bytes` of a bundle's basis and response.
    pub fn over_tables(table: &'a PriorTable, bytes: f64) -> Self {
        Self::Reading {
            tables: [table.basis().basis, table.response.stored()],
            bytes: bytes as usize,
        }
    }

    /// Name for a row.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Product { .. } => "a matrix product taking turns with it",
            Self::Reading { .. } => "a loop that reads its tables, taking turns with it",
        }
    }

    /// Runs it once; wall time, ms.
    pub fn run(&mut self) -> f64 {
        let start = Instant::now();
        match self {
            Self::Product { probe, turns } => {
                let isa = Isa::detect();
                for _ in 0..*turns {
                    black_box(probe.run(isa));
                }
            }
            Self::Reading { tables, bytes } => {
                let mut left = *bytes;
                for table in tables {
                    left -= read(table, left);
                }
            }
        }
        start.elapsed().as_secs_f64() * 1e3
    }
}

/// Reads at most `bytes` of a table; how many it were.
fn read(table: &Stored<'_>, bytes: usize) -> usize {
    match table {
        Stored::F32(values) => {
            let part = &values[..values.len().min(bytes / 4)];
            black_box(
                part.iter()
                    .fold(0u32, |sum, x| sum.wrapping_add(x.to_bits())),
            );
            4 * part.len()
        }
        Stored::F16(values) => {
            let part = &values[..values.len().min(bytes / 2)];
            black_box(
                part.iter()
                    .fold(0u16, |sum, x| sum.wrapping_add(x.to_bits())),
            );
            2 * part.len()
        }
    }
}
