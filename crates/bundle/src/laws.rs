//! Regions of a body with a law of their own: `region` and the text `laws` of a mesh file, `laws` of the manifest.

use elements::{Laws, Material, MaterialError, Region};

use serde_json::Value;

use super::faults::bad;
use super::mesh::Mesh;
use super::tensors::TensorFile;
use crate::error::{Error, Result};
use crate::memory;

/// Numbers of the laws of a mesh's tetrahedra, and the regions.
pub(super) fn read(file: &TensorFile, tets: usize) -> Result<(Vec<u8>, Vec<Region>)> {
    let regions: Vec<Region> = match file.text().get("laws") {
        Some(text) => Region::list(text).map_err(|error| {
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
    pub fn check_named_laws(&self, file: &TensorFile, named: &Value) -> Result<()> {
        let own = file.text().get("laws").map_or(Ok(Value::Null), |text| {
            serde_json::from_str(text)
                .map_err(|error| Error::bundle(file.name(), error.to_string()))
        })?;
        let count = |list: &Value| list.as_array().map_or(0, Vec::len);
        let differs = |at: &usize| own.get(*at) != named.get(*at);
        let Some(at) = (0..count(&own).max(count(named))).find(differs) else {
            return Ok(());
        };
        let told = |list: &Value| list.get(at).map_or("nothing".to_owned(), Value::to_string);
        let problem = format!("is {}; the mesh has {}", told(named), told(&own));
        Err(bad(&format!("laws[{at}]"), problem))
    }
}
