//! A measured curve, and what a law gives for it: homogeneous, incompressible deformation in closed form.
//!
//! With the pull `p(s) = sum mu (phi(alpha s) - 1)` of a logarithmic stretch ([`elements::Ogden::pull`]) the nominal stress is
//! `(p(ln l) - p(-ln l / 2)) / l` of a bar at stretch `l`, and `(p(ln l) - p(-ln l)) / (l + 1/l)`, `l = g/2 + (1 + g²/4)^(1/2)`, of simple shear `g`
//! (Ogden, *Non-linear Elastic Deformations*, 1984, sections 7.2 and 7.3). Laws that are not written in stretches have the stress of the elements, less the
//! pressure that the free sides take. A twisted cylinder is sheared by `g r / a` at the radius `r` (Rivlin 1949), so that its torque `M` is an integral of the
//! stress of simple shear: `2 M / (pi a³) = 4 int_0^1 s² sigma(g s) ds`.

use std::str::FromStr;

use anyhow::{Result, bail};
use elements::{Deformation, Law, Moduli, Ogden, stress};

/// Intervals of Simpson's rule over the radius of a cylinder.
const RINGS: usize = 32;

/// How a specimen was loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    Tension,
    Compression,
    Shear,
    Torsion,
}

impl Mode {
    const ALL: [Self; 4] = [Self::Tension, Self::Compression, Self::Shear, Self::Torsion];

    pub fn as_str(self) -> &'static str {
        match self {
            Self::Tension => "tension",
            Self::Compression => "compression",
            Self::Shear => "shear",
            Self::Torsion => "torsion",
        }
    }

    /// Whether its points have an amount of shear, 0 at rest, and not a stretch, 1 at rest.
    pub fn is_shear(self) -> bool {
        matches!(self, Self::Shear | Self::Torsion)
    }
}

impl FromStr for Mode {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|mode| mode.as_str() == text);
        found.ok_or_else(|| {
            format!("mode `{text}` is unknown: use tension, compression, shear or torsion")
        })
    }
}

/// Points `[stretch or shear, nominal stress in Pa]`.
#[derive(Clone, Debug)]
pub struct Curve {
    pub mode: Mode,
    pub points: Vec<[f64; 2]>,
}

impl Curve {
    /// Refuses curves that no law can be fitted to.
    pub fn check(&self, whose: &str) -> Result<()> {
        if self.points.len() < 3 {
            bail!(
                "{whose}, {}: {} points; at least 3",
                self.mode.as_str(),
                self.points.len()
            );
        }
        if self.largest() == 0.0 {
            bail!("{whose}, {}: all stresses are 0", self.mode.as_str());
        }
        let rising = |[x, y]: &[f64; 2]| {
            let strain = if self.mode.is_shear() { *x } else { x - 1.0 };
            strain * y >= 0.0
        };
        let wrong = self.points.iter().filter(|p| !rising(p)).count();
        if 2 * wrong > self.points.len() {
            bail!(
                "{whose}, {}: stress and strain have opposite signs; stresses are negative below a stretch of 1",
                self.mode.as_str()
            );
        }
        Ok(())
    }

    /// The largest size of a stress, Pa.
    pub fn largest(&self) -> f64 {
        self.points.iter().fold(0.0, |m, [_, y]| y.abs().max(m))
    }

    /// `1 - sum (y - f)² / sum (y - mean)²`.
    pub fn r2(&self, law: &impl Response) -> f64 {
        let count = self.points.len() as f64;
        let mean = self.points.iter().map(|[_, y]| y).sum::<f64>() / count;
        let left: f64 = (self.points.iter())
            .map(|[x, y]| (y - nominal_stress(law, self.mode, *x)).powi(2))
            .sum();
        let whole: f64 = self.points.iter().map(|[_, y]| (y - mean).powi(2)).sum();
        1.0 - left / whole
    }
}

/// A law with its stiffness.
pub trait Response {
    /// Nominal stress of a bar at a stretch, Pa.
    fn pulled(&self, stretch: f64) -> f64;
    /// Stress of simple shear, Pa.
    fn sheared(&self, shear: f64) -> f64;
}

impl Response for Ogden {
    fn pulled(&self, stretch: f64) -> f64 {
        let s = stretch.ln();
        (self.pull(s) - self.pull(-0.5 * s)) / stretch
    }

    fn sheared(&self, shear: f64) -> f64 {
        let stretch = 0.5 * shear + (0.25 * shear * shear + 1.0).sqrt();
        let s = stretch.ln();
        (self.pull(s) - self.pull(-s)) / (stretch + 1.0 / stretch)
    }
}

/// A law that has no shear modulus of its own, with one, Pa.
#[derive(Clone, Copy, Debug)]
pub struct Scaled {
    pub law: Law,
    pub shear_pa: f64,
}

impl From<Ogden> for Scaled {
    fn from(terms: Ogden) -> Self {
        Self {
            law: Law::Ogden(terms),
            shear_pa: terms.shear_pa(),
        }
    }
}

impl Scaled {
    /// `P` and `cof F` of a deformation that keeps the volume.
    fn stress(&self, f: [[f64; 3]; 3]) -> [[[f64; 3]; 3]; 2] {
        let state = Deformation::of(f);
        let moduli = Moduli {
            shear_pa: self.shear_pa,
            bulk_pa: self.shear_pa,
            law: self.law,
        };
        [stress(&state, moduli), state.cofactor]
    }
}

impl Response for Scaled {
    fn pulled(&self, stretch: f64) -> f64 {
        let across = stretch.powf(-0.5);
        let [p, c] = self.stress([[stretch, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]]);
        p[0][0] - p[1][1] / c[1][1] * c[0][0]
    }

    fn sheared(&self, shear: f64) -> f64 {
        let [p, _] = self.stress([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        p[0][1]
    }
}

/// Nominal stress, Pa, at a stretch or an amount of shear; of torsion `2 M / (pi a³)` at the shear of the side.
pub fn nominal_stress(law: &impl Response, mode: Mode, x: f64) -> f64 {
    match mode {
        Mode::Tension | Mode::Compression => law.pulled(x),
        Mode::Shear => law.sheared(x),
        Mode::Torsion => {
            let ring = |at: usize| {
                let s = at as f64 / RINGS as f64;
                let weight = match at {
                    0 | RINGS => 1.0,
                    _ if at % 2 == 1 => 4.0,
                    _ => 2.0,
                };
                weight * s * s * law.sheared(x * s)
            };
            4.0 / (3.0 * RINGS as f64) * (0..=RINGS).map(ring).sum::<f64>()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Mode, Response, Scaled, nominal_stress};
    use elements::{Law, Ogden, VerondaWestmann, Yeoh};

    /// The closed forms in stretches are the stress of the solver's law, less the pressure that the free sides take.
    #[test]
    fn they_are_the_elements_stress() {
        for terms in [&[[-157.0, -18.7]][..], &[[630.0, 1.3], [-10.0, -2.0]]] {
            let law = Ogden::new(terms).unwrap();
            let elements = Scaled {
                law: Law::Ogden(law),
                shear_pa: law.shear_pa(),
            };
            for l in [0.85, 0.95, 1.1f64] {
                let (got, want) = (law.pulled(l), elements.pulled(l));
                assert!((got - want).abs() < 1e-9 * want.abs(), "{got} for {want}");
            }
            let (got, want) = (law.sheared(0.2), elements.sheared(0.2));
            assert!((got - want).abs() < 1e-9 * got, "{got} for {want}");
        }
    }

    /// Of a law by `I1` and `I2` the torque of a cylinder is `4 pi g int r³ (W1 + W2) dr`, here in closed form.
    #[test]
    fn a_twisted_cylinder_has_the_torque_of_its_energy() {
        let (mu, g) = (700.0, 0.6);
        let c = [1.0, 1.5, 0.4];
        let yeoh = Scaled {
            law: Law::Yeoh(Yeoh {
                c2_over_c1: c[1],
                c3_over_c1: c[2],
            }),
            shear_pa: mu,
        };
        // 4 mu g int s³ (1 + 2 c2 x + 3 c3 x²) ds with x = (g s)².
        let want = mu * g * (1.0 + 8.0 * c[1] * g * g / 6.0 + 12.0 * c[2] * g.powi(4) / 8.0);
        let got = nominal_stress(&yeoh, Mode::Torsion, g);
        assert!((got / want - 1.0).abs() < 1e-5, "{got} for {want}");
        let beta = 3.0;
        let exponential = Scaled {
            law: Law::VerondaWestmann(VerondaWestmann { beta }),
            shear_pa: mu,
        };
        // 4 mu g int s³ (2 exp(beta g² s²) - 1) ds.
        let y: f64 = beta * g * g;
        let want = mu * g * (4.0 * ((y - 1.0) * y.exp() + 1.0) / (y * y) - 1.0);
        let got = nominal_stress(&exponential, Mode::Torsion, g);
        assert!((got / want - 1.0).abs() < 1e-5, "{got} for {want}");
        let small = 1e-4;
        let got = nominal_stress(&exponential, Mode::Torsion, small);
        assert!((got / (mu * small) - 1.0).abs() < 1e-5);
    }
}
