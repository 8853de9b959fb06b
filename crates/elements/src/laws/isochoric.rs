//! What a law without change of volume is made of.

use lanes::FunctionLanes;

/// `I1`, `I2` and `J^(-1/3)`.
#[derive(Clone, Copy, Debug)]
pub struct Invariants {
    pub first: f64,
    pub second: f64,
    pub root: f64,
}

/// `2 dw/dI1`, `2 dw/dI2`, `dw/dJ`.
#[derive(Clone, Copy, Debug)]
pub struct Slopes {
    pub first: f64,
    pub second: f64,
    pub volume: f64,
}

/// The same in f32 lanes.
#[derive(Clone, Copy)]
pub struct LaneSlopes<L> {
    pub first: L,
    pub second: L,
    /// `dw/dJ` is minus the product of the two: apart, so that the kernel fuses it with its sum.
    pub volume: [L; 2],
}

/// What a law is made of: energy and slopes over the shear modulus, in f64, and the slopes in f32 lanes.
pub trait Isochoric: Copy {
    /// Whether `w` depends on `I2`. Without, it must be linear in `I1`: the kernel then hands over `I1` times a factor, and takes
    /// the volume's slope times the same factor.
    const SECOND: bool;
    /// Operations of [`Isochoric::lane_slopes`] on one element.
    const FLOPS: usize;

    /// `w`.
    fn energy(self, at: Invariants) -> f64;

    /// Slopes of `w`.
    fn slopes(self, at: Invariants) -> Slopes;

    /// Slopes of `w` in lanes; `root` is `J^(-1/3)`, and `second` is anything where [`Isochoric::SECOND`] is false.
    ///
    /// # Safety
    /// As for `Lanes`. No closures, see `kernel`.
    unsafe fn lane_slopes<L: FunctionLanes>(self, first: L, second: L, root: L) -> LaneSlopes<L>;
}
