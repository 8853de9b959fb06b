//! The constants of laws that stiffen with the first invariant: Yeoh's and Veronda and Westmann's, by the method and the residuals of [`super::least_squares`].
//!
//! Yeoh's unknowns are `C1`, `C2` and `C3`, at least 0 each, so that the law is elliptic; Veronda and Westmann's are the shear modulus and `beta`.

use anyhow::{Result, bail};
use elements::{Law, VerondaWestmann, Yeoh};
use rmpfit::{MPFitter, MPPar, MPResult, MPSide};

use super::curve::{Curve, Scaled, nominal_stress};

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

struct Problem<'a> {
    which: Growing,
    curves: &'a [Curve],
    /// Largest stress over all curves, Pa: the unit of the shear modulus.
    unit: f64,
    bounds: Vec<MPPar>,
}

impl Problem<'_> {
    fn law(&self, unknown: &[f64]) -> Scaled {
        let shear_pa = self.unit * unknown[0];
        let law = match self.which {
            Growing::VerondaWestmann => Law::VerondaWestmann(VerondaWestmann { beta: unknown[1] }),
            Growing::Yeoh(_) => {
                let over = |at: usize| unknown.get(at).map_or(0.0, |c| c / unknown[0].max(1e-9));
                Law::Yeoh(Yeoh {
                    c2_over_c1: over(1),
                    c3_over_c1: over(2),
                })
            }
        };
        Scaled { law, shear_pa }
    }
}

impl MPFitter for Problem<'_> {
    fn eval(&mut self, unknown: &[f64], errors: &mut [f64]) -> MPResult<()> {
        let law = self.law(unknown);
        let points = self.curves.iter().flat_map(|curve| {
            let scale = 1.0 / curve.largest();
            (curve.points.iter()).map(move |point| (curve.mode, scale, point))
        });
        for (error, (mode, scale, [x, y])) in errors.iter_mut().zip(points) {
            *error = scale * (nominal_stress(&law, mode, *x) - y);
        }
        Ok(())
    }

    fn number_of_points(&self) -> usize {
        self.curves.iter().map(|curve| curve.points.len()).sum()
    }

    fn parameters(&self) -> &[MPPar] {
        &self.bounds
    }
}

/// Bounds of a constant.
fn bound(low: f64, up: f64) -> MPPar {
    MPPar {
        limited_low: true,
        limit_low: low,
        limited_up: up.is_finite(),
        limit_up: if up.is_finite() { up } else { 0.0 },
        side: MPSide::Both,
        ..MPPar::new()
    }
}

/// The best law of all starts.
pub fn best(curves: &[Curve], which: Growing) -> Result<Scaled> {
    let unit = curves.iter().map(Curve::largest).fold(0.0, f64::max);
    let starts = match which {
        Growing::Yeoh(count) => vec![vec![1.0; count]],
        Growing::VerondaWestmann => STARTS.map(|beta| vec![1.0, beta]).into(),
    };
    let bound_of = |at: usize| match which {
        Growing::VerondaWestmann if at == 1 => bound(BETAS[0], BETAS[1]),
        _ => bound(0.0, f64::INFINITY),
    };
    let mut best: Option<(f64, Scaled)> = None;
    for mut unknown in starts {
        let mut problem = Problem {
            which,
            curves,
            unit,
            bounds: (0..unknown.len()).map(bound_of).collect(),
        };
        // A start that leads nowhere is left to the others.
        let Ok(status) = problem.mpfit(&mut unknown) else {
            continue;
        };
        let cost = status.best_norm;
        if cost.is_finite() && best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, problem.law(&unknown)));
        }
    }
    match best {
        Some((_, law)) if law.shear_pa > 1e-6 * unit => Ok(law),
        Some(_) => bail!("no law fits: the shear modulus comes out as zero"),
        None => bail!("no law fits: fewer points than constants, or residuals that are not finite"),
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
            let found = best(&curves(&law), which).unwrap();
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
