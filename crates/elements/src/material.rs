//! A hyperelastic material: its constants, their admitted ranges, its law and its damping.

use crate::fault::MaterialError;
use crate::laws::Law;
use crate::relaxation::Relaxation;
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
    /// Left out of files where it is neo-Hookean.
    #[serde(default, skip_serializing_if = "Law::is_default")]
    pub law: Law,
    /// Left out of files where the tissue is elastic.
    #[serde(default, skip_serializing_if = "Relaxation::is_empty")]
    pub relaxation: Relaxation,
}

impl Default for Material {
    /// Brain tissue as in the paper: 3000 Pa, 0.49, 1000 kg/m³, 20 /s, neo-Hookean.
    fn default() -> Self {
        Self {
            young_pa: 3000.0,
            poisson: 0.49,
            density_kg_m3: 1000.0,
            damping_per_s: 20.0,
            law: Law::default(),
            relaxation: Relaxation::default(),
        }
    }
}

/// Elastic moduli and the law that they stand in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    /// Shear modulus `mu = E / (2 (1 + nu))`, Pa.
    pub shear_pa: f64,
    /// Bulk modulus `kappa = E / (3 (1 - 2 nu))`, Pa.
    pub bulk_pa: f64,
    /// Law of the strain energy without change of volume.
    pub law: Law,
}

impl Moduli {
    /// Of the matrix alone.
    pub fn without_fibres(self) -> Self {
        Self {
            law: self.law.matrix(),
            ..self
        }
    }
}

/// Part by which Young's modulus may differ from that of a law which has its own shear modulus.
const SAME_MODULUS: f64 = 1e-3;

impl Material {
    /// The same with another law, and with Young's modulus as the law has it, if it does.
    pub fn with_law(self, law: Law) -> Self {
        Self {
            young_pa: law.young_pa(self.poisson).unwrap_or(self.young_pa),
            law,
            ..self
        }
    }

    /// The same as steps of `h` seconds see it: with `g(h)` of its relaxation on the shear modulus, and the same bulk modulus. Itself where it is elastic.
    pub fn in_steps_of(self, h: f64) -> Self {
        if self.relaxation.is_empty() {
            return self;
        }
        let part = self.relaxation.over(h);
        let (shear, bulk) = (part * self.shear_pa(), self.bulk_pa());
        let both = 3.0 * bulk + shear;
        Self {
            young_pa: 9.0 * bulk * shear / both,
            poisson: (1.5 * bulk - shear) / both,
            law: self.law.times(part),
            ..self
        }
    }

    /// Shear and bulk modulus, and the law.
    pub fn moduli(&self) -> Moduli {
        Moduli {
            shear_pa: self.shear_pa(),
            bulk_pa: self.bulk_pa(),
            law: self.law,
        }
    }

    /// Shear modulus `mu = E / (2 (1 + nu))`, Pa.
    pub fn shear_pa(&self) -> f64 {
        self.young_pa / (2.0 * (1.0 + self.poisson))
    }

    /// Bulk modulus `kappa = E / (3 (1 - 2 nu))`, Pa.
    pub fn bulk_pa(&self) -> f64 {
        self.young_pa / (3.0 * (1.0 - 2.0 * self.poisson))
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
        let fail = |field: &'static str, value, wanted: &'static str| {
            MaterialError::some(field, value, wanted).map_or(Ok(()), Err)
        };
        if !(self.young_pa > 0.0 && self.young_pa <= 1e12) {
            return fail("young_pa", self.young_pa, "positive and at most 1e12 Pa");
        }
        if !(self.poisson > -1.0 && self.poisson < 0.4999) {
            return fail("poisson", self.poisson, "above -1 and below 0.4999");
        }
        if !(self.density_kg_m3 > 0.0 && self.density_kg_m3 <= 1e5) {
            let wanted = "positive and at most 1e5 kg/m^3";
            return fail("density_kg_m3", self.density_kg_m3, wanted);
        }
        if !(0.0..=1e6).contains(&self.damping_per_s) {
            return fail("damping_per_s", self.damping_per_s, "in [0, 1e6] 1/s");
        }
        if let Some(fault) = self.law.fault().or_else(|| self.relaxation.fault()) {
            return Err(fault);
        }
        match self.law.young_pa(self.poisson) {
            Some(own) if (self.young_pa - own).abs() > SAME_MODULUS * own => {
                let wanted = format!(
                    "{own:.6}, 2 (1 + nu) times the shear modulus of `law`, in Pa as the law's mu"
                );
                MaterialError::some("young_pa", self.young_pa, wanted).map_or(Ok(()), Err)
            }
            _ => Ok(()),
        }
    }
}
