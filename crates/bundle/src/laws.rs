//! Regions of a body with a law of their own: `region`, `fibre` and the text `laws` of a mesh file, `laws` of the manifest.

use elements::{Laws, MaterialError, Region};

use super::tensors::TensorFile;
use field::error::{Error, Result};
use field::memory;

/// See [`read`].
type Own = (Vec<u8>, Vec<Region>, Vec<[f32; 3]>);

/// Numbers of the laws of a mesh's tetrahedra, the regions, and directions of fibres.
pub(super) fn read(file: &TensorFile, tets: usize) -> Result<Own> {
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
    let fibre = match file.has("fibre") {
        true => {
            let values = file.f32("fibre", &[Some(tets), Some(3)])?;
            memory::copied(values.as_chunks().0, "a mesh")?
        }
        false => Vec::new(),
    };
    let laws = Laws {
        of_tet: &of_tet,
        regions: &regions,
        fibre: &fibre,
    };
    laws.check(tets)
        .map_err(|error| fault(file.name(), &error))?;
    Ok((of_tet, regions, fibre))
}

/// A fault of a file's laws.
pub(super) fn fault(file: &str, error: &MaterialError) -> Error {
    let MaterialError {
        field,
        value,
        wanted,
    } = error;
    Error::bundle(file, format!("{field} is {value}; it must be {wanted}"))
}
