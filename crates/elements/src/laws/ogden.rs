//! Ogden's law of any number of terms up to [`MOST_TERMS`], compressible:
//! `W = sum_t mu_t / alpha_t (l1^alpha_t + l2^alpha_t + l3^alpha_t - 3) + kappa/2 (J - 1)²`, with the principal stretches without
//! change of volume, `l = J^(-1/3) lambda`.
//!
//! Ogden (Proc. R. Soc. Lond. A 326, 1972, 565-584), split into shape and volume as the other laws. The shear modulus at rest is
//! `G = sum_t mu_t alpha_t / 2`. Exponents are any real numbers: human brain has -18 to -25, which stiffens it under compression
//! and hardly under tension. One term of exponent 2 is neo-Hookean with `mu = mu_1`, one of exponent -2 the second
//! part of Mooney-Rivlin with `C01 = -mu_1 / 2`.
//!
//! Beyond `x = alpha ln l = 3` ([`CAP`]) the exponential in the stress goes on as its tangent: `phi(x) = e^3 (x - 2)`. With exponent -24 that
//! is a compression of 12 %, beyond what tests of brain tissue reach. Stress, tangent and critical step then stay bounded.

use super::stretches::Stretches;
use super::terms::{MOST_TERMS, Term, Terms};
use crate::fault::MaterialError;
use serde::{Deserialize, Serialize};
use std::fmt;

/// `x = alpha ln l` from which the exponential goes on as its tangent.
pub const CAP: f64 = 3.0;

/// The smallest and the largest size of an exponent.
const EXPONENTS: [f64; 2] = [0.01, 100.0];

/// Shear moduli that a tissue may have, Pa: vitreous humour has some 5, compact bone 5e9.
const SHEAR_PA: [f64; 2] = [5.0, 1e11];

/// Principal logarithmic stretches over which the law must be elliptic: stretches of 0.4 to 2.5.
const LONGEST: f64 = 0.92;

/// The law's own constants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ogden {
    /// `mu` and `alpha` of each term.
    pub terms: Terms,
}

impl Ogden {
    /// From `[mu, alpha]` (Pa, no unit); `None` for more than [`MOST_TERMS`].
    pub fn new(terms: &[[f64; 2]]) -> Option<Self> {
        Some(Self {
            terms: Terms::new(terms.iter().map(|[mu_pa, alpha]| Term {
                mu_pa: *mu_pa,
                alpha: *alpha,
            }))?,
        })
    }

    /// `G = sum mu alpha / 2`, Pa.
    pub fn shear_pa(&self) -> f64 {
        let products = self.terms.iter().map(|term| term.mu_pa * term.alpha);
        0.5 * products.sum::<f64>()
    }

    /// The same with `part` of its shear modulus.
    pub(super) fn times(&self, part: f64) -> Self {
        let scaled = |term: &Term| Term {
            mu_pa: part * term.mu_pa,
            ..*term
        };
        Self {
            terms: Terms::new(self.terms.iter().map(scaled)).unwrap_or_default(),
        }
    }

    /// `sum mu (phi(alpha s) - 1)`, Pa: a principal Cauchy stress but for a pressure, at the logarithm `s` of a stretch without change of
    /// volume. `phi` is the exponential up to `CAP`, then its tangent.
    pub fn pull(&self, s: f64) -> f64 {
        Stretches {
            terms: self.terms,
            cap: CAP,
            slope: 0.0,
        }
        .pull(s)
    }

    /// The terms over the shear modulus.
    pub(super) fn normalised(&self) -> Terms {
        let shear = self.shear_pa();
        let over = |term: &Term| Term {
            mu_pa: term.mu_pa / shear,
            ..*term
        };
        Terms::new(self.terms.iter().map(over)).unwrap_or_default()
    }

    /// `sum mu alpha phi'(alpha s) / G`: how a principal stress rises with the logarithm of its stretch.
    fn rise(&self, s: f64) -> f64 {
        let terms = self.terms.iter();
        terms
            .map(|term| term.mu_pa * term.alpha * libm::exp((term.alpha * s).min(CAP)))
            .sum::<f64>()
            / self.shear_pa()
    }

    /// The first constant that is not admitted.
    ///
    /// Beside the ranges of single constants the whole law must have a positive shear modulus, and for every stretch from 0.4 to 2.5 the
    /// larger principal stress must be along the larger stretch (the inequality of Baker and Ericksen, necessary for ellipticity).
    /// It holds where each `mu` has the sign of its `alpha`.
    pub(crate) fn fault(&self) -> Option<MaterialError> {
        if self.terms.is_empty() {
            return MaterialError::some("law.terms", 0.0, "a list of 1 to 6 terms");
        }
        let mut worst = (0, f64::INFINITY);
        for (at, term) in self.terms.iter().enumerate() {
            if !(EXPONENTS[0]..=EXPONENTS[1]).contains(&term.alpha.abs()) {
                let wanted = "from 0.01 to 100, or from -100 to -0.01";
                return MaterialError::some(format!("law.terms[{at}].alpha"), term.alpha, wanted);
            }
            if term.mu_pa.is_nan() || term.mu_pa.abs() > SHEAR_PA[1] {
                let field = format!("law.terms[{at}].mu_pa");
                return MaterialError::some(
                    field,
                    term.mu_pa,
                    "a finite number of at most 1e11 Pa",
                );
            }
            if term.mu_pa * term.alpha < worst.1 {
                worst = (at, term.mu_pa * term.alpha);
            }
        }
        let worst = worst.0;
        let (field, value) = (
            format!("law.terms[{worst}].mu_pa"),
            self.terms.iter().nth(worst).map_or(0.0, |term| term.mu_pa),
        );
        let shear = self.shear_pa();
        if shear <= 0.0 {
            let wanted = format!(
                "of the sign of its alpha: the shear modulus of all terms, the sum of mu alpha / 2, is {shear:.4} Pa"
            );
            return MaterialError::some(field, value, wanted);
        }
        if !(SHEAR_PA[0]..=SHEAR_PA[1]).contains(&shear) {
            let wanted = format!(
                "in Pa, not kPa: the shear modulus, the sum of mu alpha / 2, is {shear:.4} Pa, where tissues have 5 to 1e11"
            );
            return MaterialError::some(field, value, wanted);
        }
        let steps = (-100..=100).map(|k| LONGEST * f64::from(k) / 100.0);
        let bad = steps.into_iter().find(|s| self.rise(*s) <= 0.0)?;
        let wanted = format!(
            "of the sign of its alpha, or smaller: the law is not elliptic, stress falls with stretch at a stretch of {:.2}",
            libm::exp(bad)
        );
        MaterialError::some(field, value, wanted)
    }

    /// From `mu,alpha[,mu,alpha...]`; a `mu` is in Pa, or ends with `kPa`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let numbers: Vec<&str> = text.split(',').map(str::trim).collect();
        if numbers.len() % 2 == 1 || numbers.len() > 2 * MOST_TERMS {
            return Err(format!(
                "law `ogden:{text}`: {} numbers; an Ogden law has pairs mu,alpha, 1 to {MOST_TERMS} of them",
                numbers.len()
            ));
        }
        let number = |text: &str| {
            (text.trim().parse::<f64>()).map_err(|_| format!("law ogden: `{text}` is not a number"))
        };
        let mut terms = Vec::new();
        for pair in numbers.chunks_exact(2) {
            let mu_pa = match pair[0].strip_suffix("kPa") {
                Some(kilopascal) => number(kilopascal)? * 1e3,
                None => number(pair[0].strip_suffix("Pa").unwrap_or(pair[0]))?,
            };
            terms.push([mu_pa, number(pair[1])?]);
        }
        Self::new(&terms).ok_or_else(|| format!("law ogden: at most {MOST_TERMS} terms"))
    }
}

impl fmt::Display for Ogden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ogden:")?;
        for (at, term) in self.terms.iter().enumerate() {
            let comma = if at > 0 { "," } else { "" };
            match f.precision() {
                Some(digits) => {
                    write!(f, "{comma}{:.digits$},{:.digits$}", term.mu_pa, term.alpha)?;
                }
                None => write!(f, "{comma}{},{}", term.mu_pa, term.alpha)?,
            }
        }
        Ok(())
    }
}
