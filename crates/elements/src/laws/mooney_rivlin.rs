//! Compressible Mooney-Rivlin: `W = C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + kappa/2 (J - 1)²`.
//!
//! Mooney (1940) and Rivlin (1948), split into shape and volume as in CalculiX and Abaqus (`D1 = 2 / kappa`). `mu = 2 (C10 + C01)` comes
//! from Young's modulus; what remains is the share `s = C01 / (C10 + C01)`. `s = 0` is neo-Hookean, `s = 1` the one-term Ogden law of
//! exponent -2, which like brain tissue resists pressing more than pulling. For brain Mendis, Stalnaker and Advani
//! (J Biomech Eng 117, 1995, 279-285) found `C10 = 0.9 C01`: the default.

use super::{Invariants, Isochoric, LaneSlopes, Slopes};
use crate::fault::MaterialError;
use lanes::FunctionLanes;
use serde::{Deserialize, Serialize};

/// The law's own constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MooneyRivlin {
    /// `C01 / (C10 + C01)`, 0 to 1: beyond, one of the two parts would have a negative energy.
    pub c01_share: f64,
}

impl Default for MooneyRivlin {
    /// Brain tissue after Mendis and others, `C10 = 0.9 C01`.
    fn default() -> Self {
        Self {
            c01_share: 1.0 / 1.9,
        }
    }
}

impl MooneyRivlin {
    pub(super) fn fault(&self) -> Option<MaterialError> {
        if (0.0..=1.0).contains(&self.c01_share) {
            return None;
        }
        MaterialError::some("law.c01_share", self.c01_share, "in [0, 1]")
    }
}

impl Isochoric for MooneyRivlin {
    const SECOND: bool = true;
    const FLOPS: usize = 12;

    fn energy(self, at: Invariants) -> f64 {
        let root2 = at.root * at.root;
        0.5 * (1.0 - self.c01_share) * (root2 * at.first - 3.0)
            + 0.5 * self.c01_share * (root2 * root2 * at.second - 3.0)
    }

    fn slopes(self, at: Invariants) -> Slopes {
        let root2 = at.root * at.root;
        let first = (1.0 - self.c01_share) * root2;
        let second = self.c01_share * root2 * root2;
        let inverse = root2 * at.root;
        Slopes {
            first,
            second,
            volume: -inverse * (first * at.first + 2.0 * second * at.second) / 3.0,
        }
    }

    #[inline(always)]
    unsafe fn lane_slopes<L: FunctionLanes>(self, first: L, second: L, root: L) -> LaneSlopes<L> {
        // SAFETY: the caller's.
        unsafe {
            let root2 = root.mul(root);
            let slope1 = root2.mul(L::splat((1.0 - self.c01_share) as f32));
            let slope2 = root2.mul(root2).mul(L::splat(self.c01_share as f32));
            let twice = slope2.add(slope2).mul(second);
            let sum = slope1.mul_add(first, twice);
            LaneSlopes {
                first: slope1,
                second: slope2,
                volume: [root2.mul(root.mul(L::splat(1.0 / 3.0))), sum],
            }
        }
    }
}
