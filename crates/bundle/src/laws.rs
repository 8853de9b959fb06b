//! Regions of a body with a law of their own: `region` and the text `laws` of a mesh file, `laws` of the manifest.

use elements::{Laws, Material, MaterialError, Region};

use super::faults::bad;
use super::mesh::Mesh;
use super::tensors::TensorFile;
use crate::error::{Error, Result};
use crate::memory;

/// Numbers of the laws of a mesh's tetrahedra, and the regions.
pub(super) fn read(file: &TensorFile, tets: usize) -> Result<(Vec<u8>, Vec<Region>)> {
    let regions: Vec<Region> = match file.text().get("laws") {
        Some(text) => serde_json::from_str(text).map_err(|error| {
            let problem = format!("metadata `laws` is no list of regions: {error}");
            Error::bundle(file.name(), problem)
        })?,
        None => Vec::new(),
    };
    let of_tet = match file.has("region") {
        true => {
            let numbers = file.indices("region", &[Some(tets)], regions.len() + 1)?;
            let numbers = numbers.iter().map(|number| *number as u8);
            memory::collected(tets, numbers, "a mesh")?
        }
        false => Vec::new(),
    };
    let laws = Laws {
        of_tet: &of_tet,
        regions: &regions,
    };
    laws.check(tets)
        .map_err(|error| fault(file.name(), &error))?;
    Ok((of_tet, regions))
}

fn fault(file: &str, error: &MaterialError) -> Error {
    let MaterialError {
        field,
        value,
        wanted,
    } = error;
    Error::bundle(file, format!("{field} is {value}; it must be {wanted}"))
}

impl Mesh {
    /// Checks that laws with a shear modulus of their own agree with the stiffness of their tetrahedra in a material.
    ///
    /// # Errors
    /// [`Error::Bundle`] with the region.
    pub fn check_laws(&self, file: &str, material: &Material) -> Result<()> {
        let body = self.tetrahedra();
        let checked = (body.laws).check_with(body.tets.len(), &self.stiffness, material);
        checked.map_err(|error| fault(file, &error))
    }

    /// Checks that a manifest names the laws that the mesh has.
    ///
    /// # Errors
    /// [`Error::Bundle`] with the region.
    pub fn check_named_laws(&self, named: &[Region]) -> Result<()> {
        let differs = |at: &usize| named.get(*at) != self.laws.get(*at);
        let Some(at) = (0..named.len().max(self.laws.len())).find(differs) else {
            return Ok(());
        };
        let problem = match (self.laws.get(at), named.get(at)) {
            (Some(own), None) => format!(
                "is missing; the mesh has {} in region `{}`",
                own.law, own.name
            ),
            (Some(own), Some(named)) => format!(
                "is {} in region `{}`; the mesh has {} in region `{}`",
                named.law, named.name, own.law, own.name
            ),
            (None, _) => "names a region that the mesh lacks".to_owned(),
        };
        Err(bad(&format!("laws[{at}]"), problem))
    }
}
