//! The constants of laws that stiffen with the first invariant: Yeoh's and Veronda and Westmann's, by [`super::least_squares`].
//!
//! Yeoh's unknowns are `C1`, `C2` and `C3`, at least 0 each, so that the law is elliptic; Veronda and Westmann's are the shear modulus and `beta`.

use anyhow::{Result, bail};
use elements::{Law, VerondaWestmann, Yeoh};

use super::curve::Scaled;
use super::least_squares::{self, Test, Unknown};

/// Exponents that are sought, and from where.
const BETAS: [f64; 2] = [0.4, 1000.0];
const STARTS: [f64; 4] = [0.6, 3.0, 15.0, 75.0];

/// What of a law is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Growing {
    /// So many constants, 2 or 3.
    Yeoh(usize),
    VerondaWestmann,
}

impl Growing {
    /// That of some constants, the first of them a stiffness in units of `unit`, Pa.
    fn law(self, constants: &[f64], unit: f64) -> Scaled {
        let law = match self {
            Growing::VerondaWestmann => {
                Law::VerondaWestmann(VerondaWestmann { beta: constants[1] })
            }
            Growing::Yeoh(_) => {
                let over = |at: usize| {
                    let of = |c: &f64| c / constants[0].max(1e-9);
                    constants.get(at).map_or(0.0, of)
                };
                Law::Yeoh(Yeoh {
                    c2_over_c1: over(1),
                    c3_over_c1: over(2),
                })
            }
        };
        Scaled {
            law,
            shear_pa: unit * constants[0],
        }
    }
}

/// The best law of all starts.
pub fn best(test: &(impl Test<Scaled> + ?Sized), which: Growing) -> Result<Scaled> {
    let unit = test.unit();
    let stiffness = Unknown::stiffness;
    let starts: Vec<Vec<Unknown>> = match which {
        Growing::Yeoh(count) => vec![(0..count).map(|_| stiffness()).collect()],
        Growing::VerondaWestmann => STARTS
            .map(|beta| vec![stiffness(), Unknown::between(beta, BETAS)])
            .into(),
    };
    let constants =
        least_squares::best(test, starts, |constants| Some(which.law(constants, unit)))?;
    match which.law(&constants, unit) {
        law if law.shear_pa > 1e-6 * unit => Ok(law),
        _ => bail!("no law fits: the shear modulus comes out as zero"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Growing, best};
    use crate::fit::curve::{Curve, Mode, Scaled, nominal_stress};
    use elements::{Law, VerondaWestmann, Yeoh};

    /// Every mode, from rest to one end.
    fn curves(law: &Scaled) -> Vec<Curve> {
        let ends = [
            (Mode::Tension, 1.0, 1.4),
            (Mode::Compression, 1.0, 0.7),
            (Mode::Shear, 0.0, 0.5),
            (Mode::Torsion, 0.0, 0.5),
        ];
        let curve = |(mode, from, to): (Mode, f64, f64)| Curve {
            mode,
            points: (0..=20)
                .map(|k| from + (to - from) * f64::from(k) / 20.0)
                .map(|x| [x, nominal_stress(law, mode, x)])
                .collect(),
        };
        ends.map(curve).into()
    }

    #[test]
    fn a_law_that_grows_is_found_again_from_its_own_curves() {
        let [c2_over_c1, c3_over_c1] = [1.5, 0.4];
        let own = Yeoh {
            c2_over_c1,
            c3_over_c1,
        };
        let beta = 4.2;
        for (law, which) in [
            (Law::Yeoh(own), Growing::Yeoh(3)),
            (
                Law::VerondaWestmann(VerondaWestmann { beta }),
                Growing::VerondaWestmann,
            ),
        ] {
            let shear_pa = 640.0;
            let law = Scaled { law, shear_pa };
            let found = best(&curves(&law)[..], which).unwrap();
            assert!((found.shear_pa / shear_pa - 1.0).abs() < 1e-3, "{found:?}");
            match found.law {
                Law::Yeoh(found) => {
                    assert!((found.c2_over_c1 - c2_over_c1).abs() < 1e-2, "{found:?}");
                    assert!((found.c3_over_c1 - c3_over_c1).abs() < 1e-2, "{found:?}");
                }
                Law::VerondaWestmann(found) => {
                    assert!((found.beta - beta).abs() < 1e-2, "{found:?}");
                }
                _ => panic!("{found:?}"),
            }
        }
    }
}
