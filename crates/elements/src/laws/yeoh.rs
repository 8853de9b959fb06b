//! Compressible Yeoh: `W = C1 x + C2 x² + C3 x³ + kappa/2 (J - 1)²`, `x = J^(-2/3) I1 - 3`.
//!
//! Yeoh (Rubber Chem. Technol. 66, 1993, 754-771), split into shape and volume as in Abaqus. `mu = 2 C1` comes from Young's modulus; what remains are the
//! ratios `C2 / C1` and `C3 / C1`. Silicones and liver are fitted with it: it stiffens alike in tension and compression.

use super::growth::Growing;
use crate::fault::MaterialError;
use lanes::FunctionLanes;
use serde::{Deserialize, Serialize};

/// `x` over which the law must be elliptic: a stretch of 2.5, of two axes 0.4.
const LARGEST: f64 = 9.6;

/// The law's own constants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Yeoh {
    /// `C2 / C1`.
    pub c2_over_c1: f64,
    /// `C3 / C1`.
    pub c3_over_c1: f64,
}

impl Yeoh {
    /// The stress must rise with the strain: `1 + 2 (C2/C1) x + 3 (C3/C1) x² > 0` up to a stretch of 2.5.
    pub(super) fn fault(&self) -> Option<MaterialError> {
        for (field, value) in [
            ("law.c2_over_c1", self.c2_over_c1),
            ("law.c3_over_c1", self.c3_over_c1),
        ] {
            if value.is_nan() || value.abs() > 1e3 {
                return MaterialError::some(field, value, "a number of at most 1000");
            }
        }
        let steps = (0..=100).map(|k| LARGEST * f64::from(k) / 100.0);
        let bad = steps.into_iter().find(|x| self.growth(*x)[0] <= 0.0)?;
        let (field, value) = if self.c2_over_c1 < self.c3_over_c1 {
            ("law.c2_over_c1", self.c2_over_c1)
        } else {
            ("law.c3_over_c1", self.c3_over_c1)
        };
        let wanted = format!(
            "larger: the law is not elliptic, stress falls with stretch where I1 - 3 is {bad:.2}"
        );
        MaterialError::some(field, value, wanted)
    }
}

impl Growing for Yeoh {
    const GROWTH_FLOPS: usize = 4;

    fn parts(self) -> [f64; 2] {
        [1.0, 0.0]
    }

    fn stored(self, x: f64) -> f64 {
        0.5 * x * (1.0 + x * (self.c2_over_c1 + x * self.c3_over_c1))
    }

    fn growth(self, x: f64) -> [f64; 2] {
        [
            1.0 + x * (2.0 * self.c2_over_c1 + 3.0 * x * self.c3_over_c1),
            2.0 * self.c2_over_c1 + 6.0 * x * self.c3_over_c1,
        ]
    }

    #[inline(always)]
    unsafe fn lane_growth<L: FunctionLanes>(self, x: L) -> L {
        // SAFETY: the caller's.
        unsafe {
            let (second, third) = (2.0 * self.c2_over_c1, 3.0 * self.c3_over_c1);
            let slope = x.mul_add(L::splat(third as f32), L::splat(second as f32));
            slope.mul_add(x, L::splat(1.0))
        }
    }
}
