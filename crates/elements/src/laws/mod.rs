//! Laws of isotropic hyperelastic tissue. A law is one file here, a variant of [`Law`] and a row in its two tables.
//!
//! All laws have the energy `W = mu w(I1, I2, J) + kappa/2 (J - 1)²` a rest volume, with the invariants `I1 = |F|²`, `I2 = |cof F|²`,
//! `J = det F`, and `w` without change of volume: so that its second derivatives at rest are those of `(mu, 0)`, stiffness
//! at rest, natural modes and the linear response are the same for every law. With the slopes
//! `f1 = 2 dw/dI1`, `f2 = 2 dw/dI2`, `g = dw/dJ` the stress is
//! `P = mu [f1 F + f2 (I1 F - F F^T F)] + [kappa (J - 1) + mu g] cof F`.

mod isochoric;
mod mooney_rivlin;
mod neo_hookean;

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

pub use isochoric::{Invariants, Isochoric, LaneSlopes, Slopes};
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hookean::NeoHookean;

/// The law of a material, as files name it: `{"name": "mooney-rivlin", "c01_share": 0.5}`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum Law {
    /// `w = (J^(-2/3) I1 - 3) / 2`.
    NeoHookean(NeoHookean),
    /// `w = (1 - s) (J^(-2/3) I1 - 3) / 2 + s (J^(-4/3) I2 - 3) / 2`.
    MooneyRivlin(MooneyRivlin),
}

/// The names that [`Law::from_str`] takes.
const NAMES: &str =
    "neo-hookean, mooney-rivlin or mooney-rivlin:SHARE with a share of C01 from 0 to 1";

impl Default for Law {
    fn default() -> Self {
        Self::NeoHookean(NeoHookean {})
    }
}

impl Law {
    /// Whether it is the law of every file that names none.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// `w`: the strain energy without change of volume, over the shear modulus.
    pub fn energy(&self, at: Invariants) -> f64 {
        match self {
            Self::NeoHookean(law) => law.energy(at),
            Self::MooneyRivlin(law) => law.energy(at),
        }
    }

    /// Slopes of `w`.
    pub fn slopes(&self, at: Invariants) -> Slopes {
        match self {
            Self::NeoHookean(law) => law.slopes(at),
            Self::MooneyRivlin(law) => law.slopes(at),
        }
    }

    /// The constant that is not admitted: field, value, and what it must be.
    pub(crate) fn fault(&self) -> Option<(&'static str, f64, &'static str)> {
        match self {
            Self::NeoHookean(_) => None,
            Self::MooneyRivlin(law) => law.fault(),
        }
    }
}

impl fmt::Display for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NeoHookean(_) => f.write_str("neo-hookean"),
            Self::MooneyRivlin(law) => match f.precision() {
                Some(digits) => write!(f, "mooney-rivlin:{:.digits$}", law.c01_share),
                None => write!(f, "mooney-rivlin:{}", law.c01_share),
            },
        }
    }
}

impl FromStr for Law {
    type Err = String;

    /// A name, and after a colon the law's constant.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, constant) = match text.split_once(':') {
            None => (text, None),
            Some((name, constant)) => (name, Some(constant)),
        };
        let law = match (name, constant) {
            ("neo-hookean", None) => Self::default(),
            ("mooney-rivlin", None) => Self::MooneyRivlin(MooneyRivlin::default()),
            ("mooney-rivlin", Some(constant)) => Self::MooneyRivlin(MooneyRivlin {
                c01_share: (constant.parse())
                    .map_err(|_| format!("law `{text}`: `{constant}` is not a number"))?,
            }),
            _ => return Err(format!("law `{text}` is unknown: use {NAMES}")),
        };
        match law.fault() {
            None => Ok(law),
            Some((field, value, wanted)) => Err(format!("{field} is {value}; it must be {wanted}")),
        }
    }
}
