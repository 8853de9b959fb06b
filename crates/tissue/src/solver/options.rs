//! Settings of a solver and their checks.

use super::error::SolverError;
use crate::material::Material;
use lanes::Isa;

/// How the pressure of an element is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pressure {
    /// `kappa (J - 1)` of the element itself; locks near incompressibility.
    #[default]
    Element,
    /// Mean of the corners' average nodal pressure (Bonet and Burton 1998): softer, about twice the cost.
    AverageNodal,
}

/// What happens when the asked inner step is above the stable one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Substep {
    /// The frame is cut into more inner steps; a frame that fails is repeated with half the step.
    #[default]
    Automatic,
    /// [`SolverError::StepTooLong`].
    Refuse,
}

/// Settings of a `Solver`.
#[derive(Clone, Debug)]
pub struct SolverOptions {
    /// Default: brain tissue, see [`Material`].
    pub material: Material,
    /// Asked inner step, s. Default 1e-4.
    pub inner_step_s: f64,
    /// Part of the estimated critical step that is used. Default 0.8.
    pub safety: f64,
    /// Selective mass scaling: elements whose own critical step is shorter get mass until it is this long, s.
    /// Default 0: none. See `Solver::added_mass`.
    pub mass_scaling_s: f64,
    /// Default [`Substep::Automatic`].
    pub substep: Substep,
    /// Default [`Pressure::Element`].
    pub pressure: Pressure,
    /// Default 1.
    pub threads: usize,
    /// Default: the best set of this processor.
    pub isa: Option<Isa>,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            material: Material::default(),
            inner_step_s: 1e-4,
            safety: 0.8,
            mass_scaling_s: 0.0,
            substep: Substep::Automatic,
            pressure: Pressure::Element,
            threads: 1,
            isa: None,
        }
    }
}

impl SolverOptions {
    /// The material's own checks, and ranges of the numbers.
    pub(super) fn validate(&self) -> Result<(), SolverError> {
        self.material.validate()?;
        check_positive("inner_step_s", self.inner_step_s)?;
        check_positive("safety", self.safety)?;
        if !(self.mass_scaling_s.is_finite() && self.mass_scaling_s >= 0.0) {
            return Err(SolverError::Option {
                field: "mass_scaling_s",
                value: self.mass_scaling_s,
                wanted: "zero or positive",
            });
        }
        Ok(())
    }
}

pub(super) fn check_positive(field: &'static str, value: f64) -> Result<(), SolverError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SolverError::Option {
            field,
            value,
            wanted: "positive",
        })
    }
}
