//! What came of a method.

use yardstick::measure::Outcome;

/// A method's cases.
pub struct Measured {
    pub name: String,
    pub outcomes: Vec<Outcome>,
}
