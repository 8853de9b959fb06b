//! Compressible Veronda and Westmann: `W = C1 (exp(beta x) - 1) - C1 beta/2 (J^(-4/3) I2 - 3) + kappa/2 (J - 1)²`, `x = J^(-2/3) I1 - 3`.
//!
//! Veronda and Westmann (J. Biomech. 3, 1970, 111-124), skin; of Fung's exponential laws the one that liver, breast and gallbladder have been
//! fitted with most. `mu = C1 beta` comes from Young's modulus; what remains is `beta`. As Ogden's (`ogden.rs`) the exponential in the stress goes on as its tangent
//! beyond `beta x = 3`, so that stress, tangent and critical step stay bounded.

use super::growth::Growing;
use super::ogden::CAP;
use crate::fault::MaterialError;
use lanes::FunctionLanes;
use lanes::functions::exp_m1;
use serde::{Deserialize, Serialize};

/// Exponents that the law may have. The least keeps it elliptic at stretches of 0.4 to 2.5: there `exp(beta x)` outgrows the part by `I2`.
const BETAS: [f64; 2] = [0.4, 1e3];

/// The law's own constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VerondaWestmann {
    /// `beta`, no unit.
    pub beta: f64,
}

impl VerondaWestmann {
    pub(super) fn fault(&self) -> Option<MaterialError> {
        if (BETAS[0]..=BETAS[1]).contains(&self.beta) {
            return None;
        }
        MaterialError::some("law.beta", self.beta, "from 0.4 to 1000")
    }
}

impl Growing for VerondaWestmann {
    const GROWTH_FLOPS: usize = 26;

    fn parts(self) -> [f64; 2] {
        [2.0, -1.0]
    }

    fn stored(self, x: f64) -> f64 {
        let y = self.beta * x;
        let beyond = (y - CAP).max(0.0);
        let whole = libm::exp(CAP) * beyond * (1.0 + 0.5 * beyond);
        (libm::expm1(y.min(CAP)) + whole) / self.beta
    }

    fn growth(self, x: f64) -> [f64; 2] {
        let y = self.beta * x;
        let slope = libm::exp(y.min(CAP));
        [slope * (1.0 + (y - CAP).max(0.0)), self.beta * slope]
    }

    #[inline(always)]
    unsafe fn lane_growth<L: FunctionLanes>(self, x: L) -> L {
        // SAFETY: the caller's.
        unsafe {
            let one = L::splat(1.0);
            let y = x.mul(L::splat(self.beta as f32));
            let cap = L::splat(CAP as f32);
            let beyond = L::splat(0.0).max(y.sub(cap)).add(one);
            exp_m1(y.min(cap)).add(one).mul(beyond)
        }
    }
}
