//! Small-strain moduli, the same for every law.

use super::LinearError;

/// Lamé constants, mN/mm².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lame {
    /// First constant, `kappa - 2 mu / 3`.
    pub lambda: f64,
    /// Shear modulus.
    pub mu: f64,
}

impl Lame {
    /// From Young's modulus (Pa) and Poisson's ratio.
    ///
    /// # Errors
    /// [`LinearError::Material`] unless `young_pa > 0` and `0 <= poisson < 0.5`.
    pub fn from_young(young_pa: f64, poisson: f64) -> Result<Self, LinearError> {
        if !(young_pa.is_finite() && young_pa > 0.0) {
            return Err(LinearError::Material {
                field: "young_pa",
                value: young_pa,
                expected: "a positive number of pascals is needed",
            });
        }
        if !(0.0..0.5).contains(&poisson) {
            return Err(LinearError::Material {
                field: "poisson",
                value: poisson,
                expected: "a ratio in [0, 0.5) is needed",
            });
        }
        let young = young_pa * 1e-3;
        let mu = young / (2.0 * (1.0 + poisson));
        let kappa = young / (3.0 * (1.0 - 2.0 * poisson));
        Ok(Self {
            lambda: kappa - 2.0 * mu / 3.0,
            mu,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lame_constants_give_young_and_poisson_back() {
        let lame = Lame::from_young(3000.0, 0.49).unwrap();
        let young = lame.mu * (3.0 * lame.lambda + 2.0 * lame.mu) / (lame.lambda + lame.mu);
        let poisson = lame.lambda / (2.0 * (lame.lambda + lame.mu));
        assert!((young - 3.0).abs() < 1e-12);
        assert!((poisson - 0.49).abs() < 1e-12);
    }

    #[test]
    fn an_incompressible_material_is_refused() {
        assert!(Lame::from_young(3000.0, 0.5).is_err());
        assert!(Lame::from_young(f64::NAN, 0.4).is_err());
    }
}
