//! The deviator of laws whose part by `I1` grows with it, in f32 lanes: `T = a h(x) dev Cbar + b dev Cbar^-1`.
//!
//! With `D` of the strain (`stretches.rs`), `Cbar = r (1 + D)` and `r = (1 + det (1 + D) - 1)^(-1/3)`: `x = 3 (r - 1)`, `dev Cbar = r D` and
//! `dev Cbar^-1 = (D² - D - 2/3 J2) / (r (1 + x'))`, `x'` the third invariant there.

use super::moduli::inverse_cube_root;
use crate::laws::{Growing, Grows};
use lanes::NodeLanes;

/// `T` of the moduli `a` and `b`, Pa, from `D`, `D²`, its second invariant and `x'`.
#[inline(always)]
pub(super) unsafe fn grown<L: NodeLanes>(
    grows: Grows,
    [a, b]: [f32; 2],
    [d, square]: [&[L; 6]; 2],
    [j2, x]: [L; 2],
) -> [L; 6] {
    unsafe {
        let root = inverse_cube_root(x.add(L::splat(1.0)));
        // `I1` without change of volume, less 3: the argument that the law's growth takes.
        let x = root.mul_add(L::splat(3.0), L::splat(-3.0));
        let first = grows.lane_growth(x).mul(root).mul(L::splat(a));
        // 1 / (r (1 + x')) is r².
        let second = root.mul(root).mul(L::splat(b));
        let mean = j2.mul(L::splat(2.0 / 3.0));
        let mut out = *d;
        for k in 0..6 {
            let square = match k {
                0 | 3 | 5 => square[k].sub(mean),
                _ => square[k],
            };
            let inverse = square.sub(d[k]);
            out[k] = second.mul_add(inverse, first.mul(d[k]));
        }
        out
    }
}
