//! What a blade does to the tissue, and where.

use crate::Point;
use crate::polytope::Weights;

/// What a blade does to the tissue at a part of its new area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Where: weights on nodes.
    pub nodes: [u32; 4],
    pub weights: Weights,
    /// mN.
    pub force: Point,
}

/// A part of the new area of a sweep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opened {
    pub element: u32,
    pub at: Weights,
    pub area_mm2: f64,
}
