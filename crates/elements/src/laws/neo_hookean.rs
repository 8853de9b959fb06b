//! Neo-Hookean: `w = (J^(-2/3) I1 - 3) / 2`. The fast path of the kernel: springs along the edges do not change but by a factor.

use super::{Invariants, Isochoric, LaneSlopes, Slopes};
use lanes::FunctionLanes;
use serde::{Deserialize, Serialize};

/// It has no constant of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NeoHookean {}

impl Isochoric for NeoHookean {
    const SECOND: bool = false;
    const FLOPS: usize = 5;

    fn energy(self, at: Invariants) -> f64 {
        0.5 * (at.root * at.root * at.first - 3.0)
    }

    fn slopes(self, at: Invariants) -> Slopes {
        let root2 = at.root * at.root;
        Slopes {
            first: root2,
            second: 0.0,
            volume: -root2 * at.first * (at.root * at.root * at.root * (1.0 / 3.0)),
        }
    }

    #[inline(always)]
    unsafe fn lane_slopes<L: FunctionLanes>(self, first: L, second: L, root: L) -> LaneSlopes<L> {
        // SAFETY: the caller's.
        unsafe {
            let root2 = root.mul(root);
            let root5 = root2.mul(root2).mul(root.mul(L::splat(1.0 / 3.0)));
            LaneSlopes {
                first: root2,
                second,
                volume: [root5, first],
            }
        }
    }
}
