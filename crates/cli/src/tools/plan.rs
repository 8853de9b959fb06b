//! What is measured, and what came of it.

use std::path::PathBuf;

use super::cases::Split;
use super::drive::Drive;
use super::measure::Outcome;
use super::row::{CaseFigures, Label, Row};
use crate::effort::Effort;
use crate::report::method::BundleFolder;

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

/// A bundle in one configuration.
pub(super) struct Method {
    pub(super) bundle: BundleFolder,
    pub(super) drive: Drive,
    pub(super) corrections: Effort,
}

impl Method {
    pub(super) fn label(&self) -> Label {
        Label {
            bundle: self.bundle.name.clone(),
            drive: self.drive.name(),
            corrections: self.corrections,
        }
    }

    pub(super) fn name(&self) -> String {
        if self.drive == Drive::Linear {
            return format!("{}, {}", self.bundle.name, self.drive.name());
        }
        format!(
            "{}, {}, k = {}",
            self.bundle.name,
            self.drive.name(),
            self.corrections
        )
    }
}

/// A method's cases.
pub(super) struct Measured {
    pub(super) name: String,
    pub(super) outcomes: Vec<Outcome>,
    pub(super) rows: Vec<Row>,
    pub(super) figures: Vec<CaseFigures>,
}
