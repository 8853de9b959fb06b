//! A measured curve, and what a law gives for it: homogeneous, incompressible deformation in closed form.
//!
//! With the pull `p(s) = sum mu (phi(alpha s) - 1)` of a logarithmic stretch ([`elements::Ogden::pull`]) the nominal stress is
//! `(p(ln l) - p(-ln l / 2)) / l` of a bar at stretch `l`, and `(p(ln l) - p(-ln l)) / (l + 1/l)`, `l = g/2 + (1 + g²/4)^(1/2)`, of simple shear `g`
//! (Ogden, *Non-linear Elastic Deformations*, 1984, sections 7.2 and 7.3).

use std::str::FromStr;

use anyhow::{Result, bail};
use elements::Ogden;

/// How a specimen was loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    Tension,
    Compression,
    Shear,
}

impl Mode {
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Tension => "tension",
            Self::Compression => "compression",
            Self::Shear => "shear",
        }
    }
}

impl FromStr for Mode {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        [Self::Tension, Self::Compression, Self::Shear]
            .into_iter()
            .find(|mode| mode.as_str() == text)
            .ok_or_else(|| format!("mode `{text}` is unknown: use tension, compression or shear"))
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
            let strain = if self.mode == Mode::Shear {
                *x
            } else {
                x - 1.0
            };
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
    pub fn r2(&self, law: &Ogden) -> f64 {
        let count = self.points.len() as f64;
        let mean = self.points.iter().map(|[_, y]| y).sum::<f64>() / count;
        let left: f64 = (self.points.iter())
            .map(|[x, y]| (y - nominal_stress(law, self.mode, *x)).powi(2))
            .sum();
        let whole: f64 = self.points.iter().map(|[_, y]| (y - mean).powi(2)).sum();
        1.0 - left / whole
    }
}

/// Nominal stress, Pa, at a stretch or an amount of shear.
pub fn nominal_stress(law: &Ogden, mode: Mode, x: f64) -> f64 {
    if mode == Mode::Shear {
        let stretch = 0.5 * x + (0.25 * x * x + 1.0).sqrt();
        let s = stretch.ln();
        return (law.pull(s) - law.pull(-s)) / (stretch + 1.0 / stretch);
    }
    let s = x.ln();
    (law.pull(s) - law.pull(-0.5 * s)) / x
}

#[cfg(test)]
mod tests {
    use super::{Mode, nominal_stress};
    use elements::{Deformation, Law, Material, Ogden, stress, vector};

    /// The closed forms are the stress of the solver's law, less the pressure that the free sides take.
    #[test]
    fn they_are_the_elements_stress() {
        for terms in [&[[-157.0, -18.7]][..], &[[630.0, 1.3], [-10.0, -2.0]]] {
            let law = Ogden::new(terms).unwrap();
            let moduli = Material::default().with_law(Law::Ogden(law)).moduli();
            let of = |f: [[f64; 3]; 3]| {
                let cofactor = [
                    vector::cross(f[1], f[2]),
                    vector::cross(f[2], f[0]),
                    vector::cross(f[0], f[1]),
                ];
                let det = vector::dot(f[0], cofactor[0]);
                let invariant = f.iter().flatten().map(|x| x * x).sum();
                let state = Deformation {
                    f,
                    cofactor,
                    det,
                    invariant,
                };
                (stress(&state, moduli), cofactor)
            };
            for l in [0.85, 0.95, 1.1f64] {
                let across = l.powf(-0.5);
                let (p, c) = of([[l, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]]);
                let free = p[1][1] / c[1][1];
                let want = p[0][0] - free * c[0][0];
                let got = nominal_stress(&law, Mode::Tension, l);
                assert!((got - want).abs() < 1e-9 * want.abs(), "{got} for {want}");
            }
            let (p, _) = of([[1.0, 0.2, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
            let got = nominal_stress(&law, Mode::Shear, 0.2);
            assert!((got - p[0][1]).abs() < 1e-9 * got, "{got} for {}", p[0][1]);
        }
    }
}
