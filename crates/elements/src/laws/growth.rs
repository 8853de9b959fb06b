//! Laws whose part by `I1` grows with it: energy `w = u(x) + c (J^(-4/3) I2 - 3)`, `x = J^(-2/3) I1 - 3`.
//!
//! Stress, energy and tangent are those of a law with the terms `2 u'(x)` of exponent 2 and `-2 c` of exponent -2 ([`super::Stretches`]), but that the first
//! changes with the shape: a law gives `u`, `h = u' / u'(0)` and its slope.

use super::{Invariants, Isochoric, LaneSlopes, Slopes};
use lanes::FunctionLanes;

/// What such a law is made of.
pub trait Growing: Copy {
    /// Operations of [`Growing::lane_growth`] on one element.
    const GROWTH_FLOPS: usize;

    /// `2 u'(0)` and `2 c`; their sum is one, so that the shear modulus is the material's.
    fn parts(self) -> [f64; 2];

    /// `u(x)`.
    fn stored(self, x: f64) -> f64;

    /// `h(x) = u'(x) / u'(0)` and its slope.
    fn growth(self, x: f64) -> [f64; 2];

    /// `h(x)` in lanes.
    ///
    /// # Safety
    /// As for `Lanes`. No closures, see `kernel`.
    unsafe fn lane_growth<L: FunctionLanes>(self, x: L) -> L;
}

impl<G: Growing> Isochoric for G {
    const SECOND: bool = true;
    const FLOPS: usize = 16 + G::GROWTH_FLOPS;

    fn energy(self, at: Invariants) -> f64 {
        let root2 = at.root * at.root;
        self.stored(root2 * at.first - 3.0)
            + 0.5 * self.parts()[1] * (root2 * root2 * at.second - 3.0)
    }

    fn slopes(self, at: Invariants) -> Slopes {
        let root2 = at.root * at.root;
        let [first, second] = self.parts();
        let first = first * self.growth(root2 * at.first - 3.0)[0] * root2;
        let second = second * root2 * root2;
        Slopes {
            first,
            second,
            volume: -root2 * at.root * (first * at.first + 2.0 * second * at.second) / 3.0,
        }
    }

    #[inline(always)]
    unsafe fn lane_slopes<L: FunctionLanes>(self, first: L, second: L, root: L) -> LaneSlopes<L> {
        // SAFETY: the caller's.
        unsafe {
            let parts = self.parts();
            let root2 = root.mul(root);
            let x = root2.mul_add(first, L::splat(-3.0));
            let grown = self.lane_growth(x).mul(L::splat(parts[0] as f32));
            let slope1 = root2.mul(grown);
            let slope2 = root2.mul(root2).mul(L::splat(parts[1] as f32));
            let twice = slope2.add(slope2).mul(second);
            LaneSlopes {
                first: slope1,
                second: slope2,
                volume: [
                    root2.mul(root.mul(L::splat(1.0 / 3.0))),
                    slope1.mul_add(first, twice),
                ],
            }
        }
    }
}
