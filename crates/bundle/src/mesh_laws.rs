//! The laws of a mesh against the material and the manifest of its bundle.

use elements::Material;
use serde_json::Value;

use super::faults::bad;
use super::laws::fault;
use super::mesh::Mesh;
use super::tensors::TensorFile;
use field::error::{Error, Result};

impl Mesh {
    /// Checks that laws with a shear modulus of their own agree with the stiffness of their tetrahedra in a material.
    ///
    /// # Errors
    /// [`Error::Bundle`] with the region.
    pub fn check_laws(&self, file: &str, material: &Material) -> Result<()> {
        let body = self.tetrahedra();
        let checked = (body.laws).check_with(body.tets.len(), body.stiffness, material);
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
