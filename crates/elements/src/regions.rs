//! Regions of a body that have a law of their own.
//!
//! A region's law gives the shape of the stress; how stiff it is against the rest of the body is the stiffness of its tetrahedra. So at rest a body of several
//! laws is one of several stiffnesses, and modes, linear response and compliance know nothing of laws. A region may have a density, too, which masses alone
//! know, and a relaxation: the tables of a step have the modulus `g(h)` of the body's material, and what a region's differs from that by is a load, as all that its
//! elements remember is ([`crate::StressHistory`]). That is stable where a region keeps little more of its stress within a step than the material does. Poisson's
//! ratio and damping are the body's.

use crate::fault::MaterialError;
use crate::laws::Law;
use crate::material::{Material, Moduli};
use crate::relaxation::Relaxation;
use serde::{Deserialize, Serialize};

/// Regions of a body at most.
pub const MOST_REGIONS: usize = 64;
/// Density of a region at most, kg/m³.
const MOST_DENSITY: f64 = 1e5;
/// Part by which the stiffness of a tetrahedron may differ from that of a law which has its own shear modulus.
const SAME_MODULUS: f64 = 1e-3;
/// By how much the length of a direction may differ from 1.
const UNIT: f64 = 1e-3;
/// Lengths of steps at which the moduli `g(h)` of regions and material are compared, s.
const STEPS_S: [f64; 4] = [0.002, 0.01, 0.05, 0.1];
/// That of a region over the material's at most: what the rest is stressed by in a step is known one step late, and from 2 on would swing without end.
const MOST_KEPT: f64 = 1.25;

/// A region, as files have it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    pub name: String,
    pub law: Law,
    /// Where its constants come from: a DOI, a test. Left out of files where nothing is known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// Density, kg/m³. Left out of files where it is the material's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_kg_m3: Option<f64>,
    /// Without branches the region is elastic. Left out of files where it is the material's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Relaxation>,
}

impl Region {
    /// The regions of a list that files have as JSON.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn list(text: &str) -> Result<Vec<Self>, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    /// Bytes of the heap that it holds.
    pub fn bytes(&self) -> usize {
        self.name.capacity() + self.source.capacity()
    }
}

/// Which tetrahedra have which law.
#[derive(Clone, Copy, Debug, Default)]
pub struct Laws<'a> {
    /// `[T]`: 0 for the material's law, else one more than the place in `regions`. Empty where the whole body has the material's.
    pub of_tet: &'a [u8],
    pub regions: &'a [Region],
    /// `[T]` directions of fibres at rest, unit vectors or zero for an element without. Empty where the body has none.
    pub fibre: &'a [[f32; 3]],
}

impl Laws<'_> {
    /// The number of a tetrahedron's law.
    pub fn number_of(&self, tet: usize) -> u8 {
        self.of_tet.get(tet).copied().unwrap_or(0)
    }

    /// The direction of a tetrahedron's fibres; zero where it has none.
    pub fn fibre_of(&self, tet: usize) -> [f32; 3] {
        self.fibre.get(tet).copied().unwrap_or_default()
    }

    /// The material's moduli with the law of a tetrahedron.
    pub fn moduli_of(&self, tet: usize, own: Moduli) -> Moduli {
        match usize::from(self.number_of(tet)).checked_sub(1) {
            None => own,
            Some(at) => Moduli {
                law: self.regions[at].law,
                ..own
            },
        }
    }

    /// The density of a tetrahedron, kg/m³, in a body of the density `own`.
    pub fn density_of(&self, tet: usize, own: f64) -> f64 {
        let region = usize::from(self.number_of(tet)).checked_sub(1);
        let region = region.and_then(|at| self.regions.get(at));
        region
            .and_then(|region| region.density_kg_m3)
            .unwrap_or(own)
    }

    /// Checks names and constants of the regions, and that every tetrahedron has a law.
    ///
    /// # Errors
    /// The first fault, with the region's name.
    pub fn check(&self, tets: usize) -> Result<(), MaterialError> {
        let fail = |field: String, value: usize, wanted: String| {
            MaterialError::some(field, value as f64, wanted).map_or(Ok(()), Err)
        };
        let count = self.regions.len();
        if count > MOST_REGIONS {
            let wanted = format!("at most {MOST_REGIONS}");
            return fail("number of regions with a law".into(), count, wanted);
        }
        for (at, region) in self.regions.iter().enumerate() {
            let mut before = self.regions[..at].iter();
            if region.name.is_empty() || before.any(|other| other.name == region.name) {
                let field = format!("region `{}`", region.name);
                return fail(field, at, "a region with a name of its own".into());
            }
            let density = region.density_kg_m3;
            if density.is_some_and(|own| !(own > 0.0 && own <= MOST_DENSITY)) {
                let field = format!("region `{}`: density_kg_m3", region.name);
                let wanted = "positive and at most 1e5 kg/m^3";
                return MaterialError::some(field, density.unwrap_or(0.0), wanted)
                    .map_or(Ok(()), Err);
            }
            let relaxation = region.relaxation.and_then(|own| own.fault());
            if let Some(fault) = region.law.fault().or(relaxation) {
                return Err(MaterialError {
                    field: format!("region `{}`: {}", region.name, fault.field).into(),
                    ..fault
                });
            }
        }
        if self.of_tet.len() != tets && !(self.of_tet.is_empty() && count == 0) {
            let wanted = format!("{tets}, a region for each tetrahedron");
            return fail("length of `region`".into(), self.of_tet.len(), wanted);
        }
        self.check_fibres(tets)?;
        let has_none = |number: &u8| usize::from(*number) > count;
        match self.of_tet.iter().position(has_none) {
            None => Ok(()),
            Some(tet) => fail(
                format!("region of tetrahedron {tet}"),
                self.of_tet[tet].into(),
                format!("at most {count}: there is no law for it"),
            ),
        }
    }

    /// Checks the directions of fibres.
    fn check_fibres(&self, tets: usize) -> Result<(), MaterialError> {
        let fail = |field: String, value: f64, wanted: String| {
            MaterialError::some(field, value, wanted).map_or(Ok(()), Err)
        };
        if !self.fibre.is_empty() && self.fibre.len() != tets {
            let wanted = format!("{tets}, a direction for each tetrahedron, or none");
            return fail("length of `fibre`".into(), self.fibre.len() as f64, wanted);
        }
        for (tet, own) in self.fibre.iter().enumerate() {
            let length = crate::vector::length(own.map(f64::from));
            // A NaN is neither.
            if length == 0.0 || (length - 1.0).abs() <= UNIT {
                continue;
            }
            let field = format!("length of `fibre` of tetrahedron {tet}");
            return fail(field, length, "1, or 0 for no fibres".into());
        }
        for (at, region) in self.regions.iter().enumerate() {
            if region.law.fibres().is_some() {
                self.check_direction(at as u8 + 1, &format!("region `{}`", region.name))?;
            }
        }
        Ok(())
    }

    /// Checks that some tetrahedron of a law with fibres has a direction.
    fn check_direction(&self, number: u8, name: &str) -> Result<(), MaterialError> {
        let has =
            |(tet, own): (usize, &[f32; 3])| self.number_of(tet) == number && *own != [0.0; 3];
        if self.fibre.iter().enumerate().any(has) {
            return Ok(());
        }
        let field = format!("{name}: number of directions in `fibre`");
        let wanted = "1 or more: its law has fibres, and no tetrahedron a direction";
        MaterialError::some(field, 0.0, wanted).map_or(Ok(()), Err)
    }

    /// Checks that no region keeps far more of its stress within a step than the material does.
    fn check_relaxation(&self, material: &Material) -> Result<(), MaterialError> {
        for region in self.regions {
            let Some(relaxation) = region.relaxation else {
                continue;
            };
            for h in STEPS_S {
                let [own, body] = [relaxation.over(h), material.relaxation.over(h)];
                if own <= MOST_KEPT * body {
                    continue;
                }
                return Err(MaterialError {
                    field: format!(
                        "region `{}`: relaxation, part of the stress left by a step of {h} s,",
                        region.name
                    )
                    .into(),
                    value: own,
                    wanted: format!(
                        "at most {:.6}, {MOST_KEPT} times the material's: give the body the relaxation of the tissue that relaxes least, or none",
                        MOST_KEPT * body
                    )
                    .into(),
                });
            }
        }
        Ok(())
    }

    /// The same, and that laws with a shear modulus of their own agree with the stiffness of their tetrahedra.
    ///
    /// # Errors
    /// The first fault, with the region's name.
    pub fn check_with(
        &self,
        tets: usize,
        stiffness: &[f32],
        material: &Material,
    ) -> Result<(), MaterialError> {
        self.check(tets)?;
        self.check_relaxation(material)?;
        let is_used = (0..tets).any(|tet| self.number_of(tet) == 0);
        if is_used && material.law.fibres().is_some() {
            self.check_direction(0, "material")?;
        }
        for (tet, number) in self.of_tet.iter().enumerate() {
            let Some(region) = (usize::from(*number).checked_sub(1)).map(|at| &self.regions[at])
            else {
                continue;
            };
            let Some(young) = region.law.young_pa(material.poisson) else {
                continue;
            };
            let wanted = young / material.young_pa;
            let own = stiffness.get(tet).map_or(1.0, |own| f64::from(*own));
            if (own - wanted).abs() > SAME_MODULUS * wanted {
                return Err(MaterialError {
                    field: format!("region `{}`: stiffness of tetrahedron {tet}", region.name)
                        .into(),
                    value: own,
                    wanted: format!(
                        "{wanted:.6}, Young's modulus of the region's law ({young:.6} Pa, its mu in Pa) over the material's of {} Pa",
                        material.young_pa
                    )
                    .into(),
                });
            }
        }
        Ok(())
    }
}
