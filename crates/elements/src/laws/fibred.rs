//! Transversely isotropic tissue: an isotropic law, the matrix, and one family of fibres that pull and never push.
//!
//! Holzapfel, Gasser and Ogden (J. Elast. 61, 2000, 1-48): `W = W_matrix + k1/(2 k2) (exp(k2 x²) - 1)` where `x = I4 - 1 = |F a|² - 1` is positive, else `W_matrix`; `a` is
//! the fibres' direction at rest, one in each element. Of `I4` itself, not of `J^(-2/3) I4`: fibres of nearly incompressible tissue that are split into shape and
//! volume pull where the tissue swells alike in all directions, and push it apart across them (Helfenstein et al., Int. J. Solids Struct. 47, 2010, 2056-2061; Nolan et al.,
//! J. Mech. Behav. Biomed. Mater. 39, 2014, 48-60).
//!
//! Stress `2 psi'(x) F a (x) a` with `psi' = k1 x exp(k2 x²)`, and tangent `2 psi' 1 a a + 4 psi'' (F a) a (F a) a`. At rest the tangent has two sides: none of the
//! fibres against compression, `4 k1` along them against tension. Tables of the linear body have the former. Where `k2 x²` is above 3, `psi'` goes on as its tangent, so
//! that stress, tangent and critical step stay bounded.
//!
//! REQ-099: Fibres pull where they are longer than at rest, and do nothing where they are shorter.

use super::mooney_rivlin::MooneyRivlin;
use super::neo_hookean::NeoHookean;
use super::ogden::{CAP, Ogden};
use super::veronda_westmann::VerondaWestmann;
use super::yeoh::Yeoh;
use crate::fault::MaterialError;
use serde::{Deserialize, Serialize};

/// `k1 / mu` at most.
const MOST_K1: f64 = 1e3;
/// `k2` at most.
const MOST_K2: f64 = 1e3;

/// Fibres in a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fibred {
    /// `k1` over the shear modulus of the matrix.
    pub k1_over_mu: f64,
    /// `k2`, no unit; 0 for fibres that do not stiffen.
    pub k2: f64,
    /// The isotropic part.
    pub matrix: Matrix,
}

/// An isotropic law: any [`crate::Law`] but one with fibres. In files as the law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum Matrix {
    NeoHookean(NeoHookean),
    MooneyRivlin(MooneyRivlin),
    Ogden(Ogden),
    Yeoh(Yeoh),
    VerondaWestmann(VerondaWestmann),
}

impl Fibred {
    /// Where `psi'` goes on as its tangent.
    pub(crate) fn end(&self) -> f64 {
        (CAP / self.k2).sqrt().min(1e6)
    }

    /// `exp(k2 x²)` up to the end.
    fn growth(&self, x: f64) -> f64 {
        libm::exp(self.k2 * x * x)
    }

    /// `psi / mu` at `x = I4 - 1`.
    pub fn stored(&self, x: f64) -> f64 {
        let x = x.max(0.0);
        let within = x.min(self.end());
        let beyond = x - within;
        let y = self.k2 * within * within;
        // (exp(y) - 1) / (2 k2), and its limit.
        let own = match y < 1e-8 {
            true => 0.5 * within * within * (1.0 + 0.5 * y),
            false => 0.5 * libm::expm1(y) / self.k2,
        };
        let slope = 1.0 + 2.0 * y;
        self.k1_over_mu * (own + self.growth(within) * beyond * (within + 0.5 * beyond * slope))
    }

    /// `psi' / mu`: zero where fibres are not longer than at rest.
    pub fn pull(&self, x: f64) -> f64 {
        let x = x.max(0.0);
        let within = x.min(self.end());
        let slope = 1.0 + 2.0 * self.k2 * within * within;
        self.k1_over_mu * self.growth(within) * (within + (x - within) * slope)
    }

    /// `psi'' / mu`, at rest that against tension.
    pub fn rise(&self, x: f64) -> f64 {
        if x < 0.0 {
            return 0.0;
        }
        let within = x.min(self.end());
        let slope = 1.0 + 2.0 * self.k2 * within * within;
        self.k1_over_mu * self.growth(within) * slope
    }

    /// The constant of the fibres themselves that is not admitted.
    pub(super) fn fault(&self) -> Option<MaterialError> {
        if !(self.k1_over_mu > 0.0 && self.k1_over_mu <= MOST_K1) {
            return MaterialError::some(
                "law.k1_over_mu",
                self.k1_over_mu,
                "above 0 and at most 1000",
            );
        }
        if !(0.0..=MOST_K2).contains(&self.k2) {
            return MaterialError::some("law.k2", self.k2, "from 0 to 1000");
        }
        None
    }

    /// `k1 / mu` and `k2` from `K1/MU,K2`.
    pub(super) fn parse(constants: &str) -> Result<[f64; 2], String> {
        let fault = || {
            format!("law fibres: `{constants}` must be K1/MU,K2: k1 over the shear modulus, and k2")
        };
        let (k1, k2) = constants.split_once(',').ok_or_else(fault)?;
        let number = |text: &str| text.trim().parse().map_err(|_| fault());
        Ok([number(k1)?, number(k2)?])
    }
}
