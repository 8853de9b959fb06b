//! A loop without any of the library's work, timed between two steps: its own tail is the machine's, not the library's.
//!
//! For a step that is bound by the processor it is a matrix product in cache, about as long as the step and on as many threads:
//! a neighbour on one of the cores takes from its throughput as from the step's. (A chain of dependent operations in registers would not notice.)
//! For a reduced bundle, whose step mostly reads tables, it reads as many bytes of the same tables on one thread: what others do to
//! the shared cache and memory meets both.

use std::hint::black_box;
use std::time::Instant;

use upt::kernels::Isa;
use upt::kernels::decoder::probe::GemmProbe;
use upt::kernels::rows::Stored;
use upt::prior::PriorTable;

use super::crew::Crew;

/// Longest product, ms: beyond it the tail of a step is long against any neighbour's slice.
const LONGEST_MS: f64 = 5.0;

pub enum BareLoop<'a> {
    Product(Crew),
    Reading {
        tables: [Stored<'a>; 2],
        bytes: usize,
    },
}

impl BareLoop<'_> {
    /// Products of `ms` on each of `threads` cores at once.
    pub fn product(ms: f64, threads: usize) -> Self {
        const TRIAL: usize = 100;
        let mut trial = products(TRIAL);
        let fastest = (0..5)
            .map(|_| timed(&mut trial))
            .fold(f64::INFINITY, f64::min);
        let turns = (TRIAL as f64 * ms.min(LONGEST_MS) / fastest).max(1.0) as usize;
        Self::Product(Crew::new(threads, || products(turns)))
    }
}

impl<'a> BareLoop<'a> {
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
            Self::Product(_) => "a matrix product taking turns with it",
            Self::Reading { .. } => "a loop that reads its tables, taking turns with it",
        }
    }

    /// Runs it once; wall time, ms.
    pub fn run(&mut self) -> f64 {
        match self {
            Self::Product(crew) => timed(&mut || crew.run()),
            Self::Reading { tables, bytes } => timed(&mut || {
                let mut left = *bytes;
                for table in tables.iter() {
                    left -= read(table, left);
                }
            }),
        }
    }
}

fn products(turns: usize) -> impl FnMut() + Send + 'static {
    let (mut probe, isa) = (GemmProbe::default(), Isa::detect());
    move || {
        for _ in 0..turns {
            black_box(probe.run(isa));
        }
    }
}

fn timed(work: &mut impl FnMut()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64() * 1e3
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
