//! What is measured, and what came of it.

use std::path::PathBuf;

use upt_cli::effort::Effort;
use upt_cli::yardstick::cases::Split;
use upt_cli::yardstick::measure::Outcome;

/// What is measured.
pub struct Plan<'a> {
    /// Dataset folders and trajectories.
    pub paths: &'a [PathBuf],
    pub split: Split,
    /// Cases of a programme at most.
    pub per_programme: usize,
    pub bundles: &'a [PathBuf],
    /// Corrections a step; none: 0 and as many as a bundle recommends.
    pub corrections: &'a [Effort],
    pub threads: u32,
    pub out: PathBuf,
    pub title: &'a str,
    /// Documents whose tables are written.
    pub markdown: &'a [PathBuf],
    pub json: bool,
}

/// A method's cases.
pub(super) struct Measured {
    pub(super) name: String,
    pub(super) outcomes: Vec<Outcome>,
}
