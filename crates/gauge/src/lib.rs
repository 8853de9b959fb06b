//! What is measured of a program, and what measured values come to: one definition each, for benches, tests, commands and reports.

mod memory;
mod processor_time;
mod sorted;

pub use memory::{Resident, resident_bytes};
pub use processor_time::ProcessorTime;
pub use sorted::{Sorted, median};
