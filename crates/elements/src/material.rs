//! The compressible neo-Hookean material and its damping.
//!
//! `S = mu J^(-2/3) (I - I1/3 C^-1) + kappa J (J - 1) C^-1`, from the energy
//! `W = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2`, Pa.

use serde::{Deserialize, Serialize};

/// Elastic constants, density and damping.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio, below 0.5.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// Mass-proportional damping, 1/s; 20 is near critical for the brain's lowest mode.
    pub damping_per_s: f64,
}

impl Default for Material {
    /// Brain tissue as in the paper: 3000 Pa, 0.49, 1000 kg/m³, 20 /s.
    fn default() -> Self {
        Self {
            young_pa: 3000.0,
            poisson: 0.49,
            density_kg_m3: 1000.0,
            damping_per_s: 20.0,
        }
    }
}

/// Elastic moduli.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    /// Shear modulus `mu = E / (2 (1 + nu))`, Pa.
    pub shear_pa: f64,
    /// Bulk modulus `kappa = E / (3 (1 - 2 nu))`, Pa.
    pub bulk_pa: f64,
}

impl Moduli {
    /// From Young's modulus, Pa, and Poisson's ratio below 0.5.
    pub fn from_young(young_pa: f64, poisson: f64) -> Self {
        Self {
            shear_pa: young_pa / (2.0 * (1.0 + poisson)),
            bulk_pa: young_pa / (3.0 * (1.0 - 2.0 * poisson)),
        }
    }
}

/// A material that the solver cannot use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("material: `{field}` is {value}; it must be {wanted}")]
pub struct MaterialError {
    pub field: &'static str,
    pub value: f64,
    pub wanted: &'static str,
}

impl Material {
    /// Shear and bulk modulus.
    pub fn moduli(&self) -> Moduli {
        Moduli::from_young(self.young_pa, self.poisson)
    }

    /// Shear modulus `mu = E / (2 (1 + nu))`, Pa.
    pub fn shear_pa(&self) -> f64 {
        self.moduli().shear_pa
    }

    /// Bulk modulus `kappa = E / (3 (1 - 2 nu))`, Pa.
    pub fn bulk_pa(&self) -> f64 {
        self.moduli().bulk_pa
    }

    /// Density in g/mm³, the solver's unit.
    pub fn density_g_mm3(&self) -> f64 {
        self.density_kg_m3 * 1e-6
    }

    /// Speed of pressure waves at rest, mm/s.
    pub fn wave_speed_mm_s(&self) -> f64 {
        let modulus = self.bulk_pa() + 4.0 / 3.0 * self.shear_pa();
        (modulus / self.density_g_mm3()).sqrt()
    }

    /// Checks that the constants describe a stable solid.
    pub fn validate(&self) -> Result<(), MaterialError> {
        let fail = |field, value, wanted| {
            Err(MaterialError {
                field,
                value,
                wanted,
            })
        };
        if !(self.young_pa.is_finite() && self.young_pa > 0.0) {
            return fail("young_pa", self.young_pa, "positive");
        }
        if !(self.poisson > -1.0 && self.poisson < 0.4999) {
            return fail("poisson", self.poisson, "above -1 and below 0.4999");
        }
        if !(self.density_kg_m3.is_finite() && self.density_kg_m3 > 0.0) {
            return fail("density_kg_m3", self.density_kg_m3, "positive");
        }
        if !(self.damping_per_s.is_finite() && self.damping_per_s >= 0.0) {
            return fail("damping_per_s", self.damping_per_s, "zero or positive");
        }
        Ok(())
    }
}
