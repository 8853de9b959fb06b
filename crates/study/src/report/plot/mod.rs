//! The four figures of the report, as inline SVG.

mod band;
mod frontier;
mod histogram;
mod stages;

pub use band::{Band, error_over_time};
pub use frontier::{Point, frontier, pareto_front};
pub use histogram::{Latencies, latency_histogram};
pub use stages::{Stages, stage_breakdown};
