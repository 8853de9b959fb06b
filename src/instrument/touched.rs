//! The memory of what instruments touch.

use parry3d::math::Pose;

/// What the last call left, by row of the surface's nodes.
#[derive(Debug)]
pub struct Touched {
    /// Instrument plus one that touched the node; 0: none.
    pub by: Vec<u8>,
    /// Instrument plus one that let the node go, while it is near; 0: none.
    pub left: Vec<u8>,
    /// Place on a sticking instrument, in its frame.
    pub anchor: Vec<[f32; 3]>,
    /// The instruments' poses.
    pub poses: Vec<Pose>,
}

impl Touched {
    /// Nothing is touched.
    pub fn forget(&mut self) {
        self.by.fill(0);
        self.left.fill(0);
        self.poses.clear();
    }
}
