//! Laws of isotropic hyperelastic tissue. A law is one file here, a variant of [`Law`] and a row in its two tables.
//!
//! All laws have the energy `W = mu w(I1, I2, J) + kappa/2 (J - 1)²` a rest volume, with the invariants `I1 = |F|²`, `I2 = |cof F|²`,
//! `J = det F`, and `w` without change of volume: so that its second derivatives at rest are those of `(mu, 0)`, stiffness
//! at rest, natural modes and the linear response are the same for every law. With the slopes
//! `f1 = 2 dw/dI1`, `f2 = 2 dw/dI2`, `g = dw/dJ` the stress is
//! `P = mu [f1 F + f2 (I1 F - F F^T F)] + [kappa (J - 1) + mu g] cof F`.
//!
//! [`Ogden`]'s law has no such `w`: it is written in the principal stretches, has its own shear modulus, and files of its own for
//! stress (`principal.rs`, `tangent.rs`) and kernel.
//!
//! REQ-081: The stress of every law is the derivative of its energy, on every instruction set.

mod grows;
mod growth;
mod isochoric;
mod mooney_rivlin;
mod neo_hookean;
mod ogden;
mod stretches;
mod terms;
mod veronda_westmann;
mod yeoh;

use crate::fault::MaterialError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

pub(crate) use grows::Grows;
pub use growth::Growing;
pub use isochoric::{Invariants, Isochoric, LaneSlopes, Slopes};
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hookean::NeoHookean;
pub use ogden::{CAP, Ogden};
pub use stretches::Stretches;
pub use terms::{MOST_TERMS, Term, Terms};
pub use veronda_westmann::VerondaWestmann;
pub use yeoh::Yeoh;

/// The law of a material, as files name it: `{"name": "mooney-rivlin", "c01_share": 0.5}`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum Law {
    /// `w = (J^(-2/3) I1 - 3) / 2`.
    NeoHookean(NeoHookean),
    /// `w = (1 - s) (J^(-2/3) I1 - 3) / 2 + s (J^(-4/3) I2 - 3) / 2`.
    MooneyRivlin(MooneyRivlin),
    /// `w = sum mu_t / alpha_t (l1^alpha_t + l2^alpha_t + l3^alpha_t - 3) / G` with `l = J^(-1/3) lambda`.
    Ogden(Ogden),
    /// `w = (x + C2/C1 x² + C3/C1 x³) / 2` with `x = J^(-2/3) I1 - 3`.
    Yeoh(Yeoh),
    /// `w = (exp(beta x) - 1) / beta - (J^(-4/3) I2 - 3) / 2`.
    VerondaWestmann(VerondaWestmann),
}

/// The names that [`Law::from_str`] takes.
const NAMES: &str = "neo-hookean, mooney-rivlin, mooney-rivlin:SHARE with a share of C01 from 0 to 1, yeoh:C2/C1[,C3/C1] as numbers, veronda-westmann:BETA, or ogden:MU,ALPHA[,MU,ALPHA...] with MU in Pa or with kPa behind it";

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

    /// The law in principal stretches: its terms over the shear modulus, and where their exponential ends; of a law that grows with `I1` those at
    /// `x = J^(-2/3) I1 - 3`.
    pub(crate) fn stretches(&self, x: f64) -> Stretches {
        let terms = |terms: &[[f64; 2]]| Stretches {
            terms: Ogden::new(terms).unwrap_or_default().terms,
            cap: f64::INFINITY,
            slope: 0.0,
        };
        fn grown(law: impl Growing, x: f64) -> Stretches {
            let ([first, second], [now, slope]) = (law.parts(), law.growth(x));
            let terms = Ogden::new(&[[first * now, 2.0], [-second, -2.0]]);
            Stretches {
                terms: terms.unwrap_or_default().terms,
                cap: f64::INFINITY,
                slope: first * slope,
            }
        }
        match self {
            Self::NeoHookean(_) => terms(&[[1.0, 2.0]]),
            Self::MooneyRivlin(law) => terms(&[[1.0 - law.c01_share, 2.0], [-law.c01_share, -2.0]]),
            Self::Ogden(law) => Stretches {
                terms: law.normalised(),
                cap: CAP,
                slope: 0.0,
            },
            Self::Yeoh(law) => grown(*law, x),
            Self::VerondaWestmann(law) => grown(*law, x),
        }
    }

    /// How its part by `I1` grows.
    pub(crate) fn grows(&self) -> Option<Grows> {
        match self {
            Self::NeoHookean(_) | Self::MooneyRivlin(_) | Self::Ogden(_) => None,
            Self::Yeoh(law) => Some(Grows::Yeoh(*law)),
            Self::VerondaWestmann(law) => Some(Grows::VerondaWestmann(*law)),
        }
    }

    /// Whether the kernel takes displacements and gradients, and not positions and springs.
    pub(crate) fn takes_displacements(&self) -> bool {
        matches!(self, Self::Ogden(_))
    }

    /// Young's modulus where the law has a shear modulus of its own, Pa.
    pub fn young_pa(&self, poisson: f64) -> Option<f64> {
        match self {
            Self::Ogden(law) => Some(2.0 * (1.0 + poisson) * law.shear_pa()),
            _ => None,
        }
    }

    /// With a shear modulus of its own: `part` of it.
    pub(crate) fn times(self, part: f64) -> Self {
        match self {
            Self::Ogden(law) => Self::Ogden(law.times(part)),
            _ => self,
        }
    }

    /// The constant that is not admitted.
    pub(crate) fn fault(&self) -> Option<MaterialError> {
        match self {
            Self::NeoHookean(_) => None,
            Self::MooneyRivlin(law) => law.fault(),
            Self::Ogden(law) => law.fault(),
            Self::Yeoh(law) => law.fault(),
            Self::VerondaWestmann(law) => law.fault(),
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
            Self::Ogden(law) => law.fmt(f),
            Self::Yeoh(law) => write!(f, "yeoh:{},{}", law.c2_over_c1, law.c3_over_c1),
            Self::VerondaWestmann(law) => write!(f, "veronda-westmann:{}", law.beta),
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
        let number = |constant: &str| {
            let constant = constant.trim();
            (constant.parse()).map_err(|_| format!("law `{text}`: `{constant}` is not a number"))
        };
        let law = match (name, constant) {
            ("neo-hookean", None) => Self::default(),
            ("mooney-rivlin", None) => Self::MooneyRivlin(MooneyRivlin::default()),
            ("mooney-rivlin", Some(constant)) => Self::MooneyRivlin(MooneyRivlin {
                c01_share: number(constant)?,
            }),
            ("yeoh", Some(constants)) => {
                let (second, third) = constants.split_once(',').unwrap_or((constants, "0"));
                Self::Yeoh(Yeoh {
                    c2_over_c1: number(second)?,
                    c3_over_c1: number(third)?,
                })
            }
            ("veronda-westmann", Some(constant)) => Self::VerondaWestmann(VerondaWestmann {
                beta: number(constant)?,
            }),
            ("ogden", Some(constants)) => Self::Ogden(Ogden::parse(constants)?),
            _ => return Err(format!("law `{text}` is unknown: use {NAMES}")),
        };
        match law.fault() {
            None => Ok(law),
            Some(fault) => Err(format!(
                "{} is {}; it must be {}",
                fault.field, fault.value, fault.wanted
            )),
        }
    }
}
