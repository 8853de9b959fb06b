//! A case of the comparison, and what a release shows.

use super::observer::Moment;

/// Steps of a scheme.
pub(super) const CASE: usize = 160;

/// Steps in contact before the release.
pub(super) const HELD: usize = 20;

/// What a release came to.
pub(super) struct Release {
    pub(super) moments: Vec<Moment>,
    /// First step after which the scene sleeps.
    pub(super) asleep: Option<usize>,
}
