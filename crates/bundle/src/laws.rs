//! Regions of a body with a law of their own: `region`, `fibre` and the text `laws` of a mesh file, `laws` of the manifest.

use std::ops::Range;

use elements::{Laws, MaterialError, Region};

use super::tensors::TensorFile;
use field::error::{Error, Result};
use field::memory::{self, HeldBytes};

const WHAT: &str = "a mesh";

/// Which tetrahedra of a mesh have which law, and which way their fibres run.
#[derive(Debug, Default, HeldBytes)]
pub struct LawTable {
    /// Number of each tetrahedron's law `[T]`, see [`elements::Laws`]; empty where the body has the material's.
    pub of_tet: Vec<u8>,
    /// Regions with a law of their own.
    pub regions: Vec<Region>,
    /// Directions of the tetrahedra's fibres at rest `[T]`, unit vectors or zero; empty where the body has none.
    pub fibre: Vec<[f32; 3]>,
}

impl LawTable {
    /// As the elements read it.
    pub fn view(&self) -> Laws<'_> {
        Laws {
            of_tet: &self.of_tet,
            regions: &self.regions,
            fibre: &self.fibre,
        }
    }

    /// That of a body whose elements are runs of this one's, one after another.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(super) fn gathered(
        &self,
        most: usize,
        runs: impl Iterator<Item = Range<usize>> + Clone,
    ) -> Result<LawTable> {
        let room = |is_empty: bool| if is_empty { 0 } else { most };
        let mut of_tet = memory::room(room(self.of_tet.is_empty()), WHAT)?;
        let mut fibre = memory::room(room(self.fibre.is_empty()), WHAT)?;
        for run in runs {
            of_tet.extend(self.of_tet.get(run.clone()).unwrap_or_default());
            fibre.extend(self.fibre.get(run).unwrap_or_default());
        }
        Ok(LawTable {
            of_tet,
            regions: memory::collected(self.regions.len(), self.regions.iter().cloned(), WHAT)?,
            fibre,
        })
    }
}

/// The table of a mesh file, checked.
pub(super) fn read(file: &TensorFile, tets: usize) -> Result<LawTable> {
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
            memory::collected(tets, numbers, WHAT)?
        }
        false => Vec::new(),
    };
    let fibre = match file.has("fibre") {
        true => {
            let values = file.f32("fibre", &[Some(tets), Some(3)])?;
            memory::copied(values.as_chunks().0, WHAT)?
        }
        false => Vec::new(),
    };
    let own = LawTable {
        of_tet,
        regions,
        fibre,
    };
    let checked = own.view().check(tets);
    checked.map_err(|error| fault(file.name(), &error))?;
    Ok(own)
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
