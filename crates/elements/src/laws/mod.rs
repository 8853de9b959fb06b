//! Laws of hyperelastic tissue. A law is one file here, a variant of [`Law`] and a row in its two tables.
//!
//! All isotropic laws have the energy `W = mu w(I1, I2, J) + kappa/2 (J - 1)²` a rest volume, with the invariants `I1 = |F|²`, `I2 = |cof F|²`,
//! `J = det F`, and `w` without change of volume: so that its second derivatives at rest are those of `(mu, 0)`, stiffness
//! at rest, natural modes and the linear response are the same for every law. With the slopes
//! `f1 = 2 dw/dI1`, `f2 = 2 dw/dI2`, `g = dw/dJ` the stress is
//! `P = mu [f1 F + f2 (I1 F - F F^T F)] + [kappa (J - 1) + mu g] cof F`.
//!
//! [`Ogden`]'s law has no such `w`: it is written in the principal stretches, has its own shear modulus, and files of its own for
//! stress (`principal.rs`, `tangent.rs`) and kernel.
//!
//! [`Fibred`] adds fibres to any of them.
//!
//! REQ-081: The stress of every law is the derivative of its energy, on every instruction set.

mod fibred;
mod grows;
mod growth;
mod isochoric;
mod matrix;
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

pub use fibred::{Fibred, Matrix};
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
    /// An isotropic law, and `w + k1/(2 k2 mu) (exp(k2 x²) - 1)` where `x = |F a|² - 1` of the element's fibres is positive.
    #[serde(rename = "fibres")]
    Fibred(Fibred),
}

/// The names that [`Law::from_str`] takes.
const NAMES: &str = "neo-hookean, mooney-rivlin, mooney-rivlin:SHARE with a share of C01 from 0 to 1, yeoh:C2/C1[,C3/C1] as numbers, veronda-westmann:BETA, or ogden:MU,ALPHA[,MU,ALPHA...] with MU in Pa or with kPa behind it; +fibres:K1/MU,K2 behind any of them adds fibres, fibres:K1/MU,K2 alone has them in neo-hookean";

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
            Self::Fibred(law) => Self::from(law.matrix).stretches(x),
        }
    }

    /// How its part by `I1` grows.
    pub(crate) fn grows(&self) -> Option<Grows> {
        match self {
            Self::NeoHookean(_) | Self::MooneyRivlin(_) | Self::Ogden(_) => None,
            Self::Yeoh(law) => Some(Grows::Yeoh(*law)),
            Self::VerondaWestmann(law) => Some(Grows::VerondaWestmann(*law)),
            Self::Fibred(law) => Self::from(law.matrix).grows(),
        }
    }

    /// The law without its fibres; itself where it has none.
    #[inline]
    pub fn matrix(&self) -> Self {
        match self {
            Self::Fibred(law) => law.matrix.into(),
            _ => *self,
        }
    }

    /// Its fibres.
    #[inline]
    pub fn fibres(&self) -> Option<&Fibred> {
        match self {
            Self::Fibred(law) => Some(law),
            _ => None,
        }
    }

    /// Whether the kernel takes displacements and gradients, and not positions and springs.
    pub(crate) fn takes_displacements(&self) -> bool {
        matches!(self.matrix(), Self::Ogden(_))
    }

    /// Young's modulus where the law has a shear modulus of its own, Pa.
    pub fn young_pa(&self, poisson: f64) -> Option<f64> {
        match self {
            Self::Ogden(law) => Some(2.0 * (1.0 + poisson) * law.shear_pa()),
            Self::Fibred(law) => Self::from(law.matrix).young_pa(poisson),
            _ => None,
        }
    }

    /// With a shear modulus of its own: `part` of it. `k1` of fibres follows, since it is a multiple of that modulus.
    pub(crate) fn times(self, part: f64) -> Self {
        match self {
            Self::Ogden(law) => Self::Ogden(law.times(part)),
            Self::Fibred(law) => match Self::from(law.matrix).times(part).try_into() {
                Ok(matrix) => Self::Fibred(Fibred { matrix, ..law }),
                Err(_) => self,
            },
            _ => self,
        }
    }

    /// Itself where its constants are admitted.
    fn checked(self) -> Result<Self, String> {
        match self.fault() {
            None => Ok(self),
            Some(fault) => Err(format!(
                "{} is {}; it must be {}",
                fault.field, fault.value, fault.wanted
            )),
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
            Self::Fibred(law) => law.fault().or_else(|| Self::from(law.matrix).fault()),
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
            Self::Fibred(law) => {
                Self::from(law.matrix).fmt(f)?;
                write!(f, "+fibres:{},{}", law.k1_over_mu, law.k2)
            }
        }
    }
}

impl FromStr for Law {
    type Err = String;

    /// A name, and after a colon the law's constant.
    fn from_str(text: &str) -> Result<Self, String> {
        let (matrix, fibres) = match text.split_once("+fibres:") {
            Some((matrix, fibres)) => (matrix.parse()?, Some(fibres)),
            None => (Self::default(), text.strip_prefix("fibres:")),
        };
        if let Some(fibres) = fibres {
            let [k1_over_mu, k2] = Fibred::parse(fibres)?;
            let matrix = matrix.try_into()?;
            return Self::Fibred(Fibred {
                k1_over_mu,
                k2,
                matrix,
            })
            .checked();
        }
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
        law.checked()
    }
}
