//! Which law is asked for, and what the option `--law` says of it.

use std::str::FromStr;

use anyhow::{Result, bail};
use elements::{Law, MOST_TERMS, MooneyRivlin, Ogden};

use super::curve::Scaled;
use super::growing::{self, Growing};
use super::least_squares::Test;
use super::stretches::{self, Exponents};

/// A law whose constants are not known yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    Stretches(Wanted),
    Grows(Growing),
}

/// One that is written in stretches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    NeoHookean,
    MooneyRivlin,
    Ogden(usize),
}

/// A law that was found.
pub struct Found {
    pub scaled: Scaled,
    /// Of one in stretches its terms.
    pub terms: Option<Ogden>,
}

impl FromStr for Asked {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.contains("fibres:") || text.ends_with("fibres") {
            return Err(format!(
                "law `{text}`: fibres are not fitted, since a row does not say how they lay; fit the matrix to a test across them, find K1 and K2 from one \
                 along them, and give both to the other commands as --law MATRIX+fibres:K1/MU,K2"
            ));
        }
        match text.split_once(':') {
            None if text == "neo-hookean" => Ok(Self::Stretches(Wanted::NeoHookean)),
            None if text == "mooney-rivlin" => Ok(Self::Stretches(Wanted::MooneyRivlin)),
            None if text == "ogden" => Ok(Self::Stretches(Wanted::Ogden(1))),
            None if text == "yeoh" => Ok(Self::Grows(Growing::Yeoh(3))),
            None if text == "veronda-westmann" => Ok(Self::Grows(Growing::VerondaWestmann)),
            Some(("yeoh", constants)) => match constants.parse() {
                Ok(count) if (2..=3).contains(&count) => Ok(Self::Grows(Growing::Yeoh(count))),
                _ => Err(format!(
                    "`{constants}` is not a number of constants, 2 or 3"
                )),
            },
            Some(("ogden", terms)) => match terms.parse() {
                Ok(count) if (1..=MOST_TERMS).contains(&count) => {
                    Ok(Self::Stretches(Wanted::Ogden(count)))
                }
                _ => Err(format!(
                    "`{terms}` is not a number of terms from 1 to {MOST_TERMS}"
                )),
            },
            _ => Err(format!(
                "law `{text}` is unknown: use ogden:TERMS, neo-hookean, mooney-rivlin, yeoh:2, yeoh:3 or veronda-westmann"
            )),
        }
    }
}

impl Asked {
    /// The law that fits a test, with the exponents that are given.
    ///
    /// # Errors
    /// `exponents` does not go with the law; or no law fits.
    pub fn fit<T>(self, test: &T, exponents: &[f64]) -> Result<Found>
    where
        T: Test<Ogden> + Test<Scaled> + ?Sized,
    {
        let wanted = match self {
            Self::Stretches(wanted) => wanted,
            Self::Grows(_) if !exponents.is_empty() => {
                bail!("--exponents goes with --law ogden:TERMS")
            }
            Self::Grows(which) => {
                let scaled = growing::best(test, which)?;
                return Ok(Found {
                    scaled,
                    terms: None,
                });
            }
        };
        let exponents = match (exponents, wanted) {
            ([], wanted) => wanted.exponents(),
            (list, Wanted::Ogden(count)) if list.len() == count => Exponents::Fixed(list.to_vec()),
            (list, Wanted::Ogden(count)) => bail!(
                "--exponents has {} numbers, and ogden:{count} has {count} terms",
                list.len()
            ),
            _ => bail!("--exponents goes with --law ogden:TERMS"),
        };
        let terms = stretches::best(test, &exponents)?;
        Ok(Found {
            scaled: Scaled {
                law: wanted.law(&terms),
                shear_pa: terms.shear_pa(),
            },
            terms: Some(terms),
        })
    }
}

impl Wanted {
    /// Its exponents.
    pub fn exponents(self) -> Exponents {
        match self {
            Self::NeoHookean => Exponents::Fixed(vec![2.0]),
            Self::MooneyRivlin => Exponents::Fixed(vec![2.0, -2.0]),
            Self::Ogden(count) => Exponents::Free(count),
        }
    }

    /// The law that fitted terms are, as `--law` takes it.
    fn law(self, terms: &Ogden) -> Law {
        let part = |alpha: f64| -> f64 {
            let terms = terms.terms.iter().filter(|term| term.alpha == alpha);
            // The sum of none is minus zero.
            0.0 + terms.map(|term| 0.5 * term.mu_pa * term.alpha).sum::<f64>()
        };
        match self {
            Self::MooneyRivlin => Law::MooneyRivlin(MooneyRivlin {
                c01_share: part(-2.0) / terms.shear_pa(),
            }),
            Self::Ogden(_) => Law::Ogden(*terms),
            Self::NeoHookean => Law::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Asked;

    /// What is no law that is fitted says what to do.
    #[test]
    fn fibres_and_unknown_laws_are_refused_with_what_helps() {
        for (text, words) in [
            ("fibres:1,2", "fibres are not fitted"),
            ("ogden:1+fibres:1,2", "--law MATRIX+fibres:K1/MU,K2"),
            ("ogden+fibres", "fit the matrix to a test across them"),
            ("gent", "use ogden:TERMS"),
            ("ogden:x", "`x` is not a number of terms"),
            ("yeoh:7", "`7` is not a number of constants"),
        ] {
            let error = text.parse::<Asked>().unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}
