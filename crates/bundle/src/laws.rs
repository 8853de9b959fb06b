//! What each tetrahedron of a body is made of: `stiffness`, `region`, `fibre` and the text `laws` of a mesh file, `laws` of the manifest.

use elements::{Laws, MaterialError, Region};
use topology::{Changes, Element};

use super::tensors::TensorFile;
use field::error::{Error, Result};
use field::memory::{self, HeldBytes};

const WHAT: &str = "the laws of a mesh";

/// What each tetrahedron is made of, apart from the material that the bundle names.
#[derive(Debug, Default, HeldBytes)]
pub struct ElementLaws {
    /// Young's modulus of each tetrahedron over the material's `[T]`; empty where the body is uniform.
    pub stiffness: Vec<f32>,
    /// Number of each tetrahedron's law `[T]`, see [`Laws`]; empty where the body has the material's.
    pub of_tet: Vec<u8>,
    /// Regions with a law of their own.
    pub regions: Vec<Region>,
    /// Directions of the tetrahedra's fibres at rest `[T]`, unit vectors or zero; empty where the body has none.
    pub fibre: Vec<[f32; 3]>,
}

impl ElementLaws {
    /// Those of a file with so many tetrahedra, checked.
    ///
    /// # Errors
    /// [`Error::Bundle`] with the element or the region.
    pub(super) fn read(file: &TensorFile, tets: usize) -> Result<ElementLaws> {
        let stiffness = if file.has("stiffness") {
            file.f32("stiffness", &[Some(tets)])?
        } else {
            Vec::new()
        };
        if let Some(tet) = stiffness.iter().position(|&factor| factor <= 0.0) {
            let problem = format!("element {tet} is {}, must be positive", stiffness[tet]);
            return Err(file.bad("stiffness", problem));
        }
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
        let own = ElementLaws {
            stiffness,
            of_tet,
            regions,
            fibre,
        };
        let checked = own.view().check(tets);
        checked.map_err(|error| fault(file.name(), &error))?;
        Ok(own)
    }

    /// Law and fibre of each tetrahedron, as the elements read them.
    pub fn view(&self) -> Laws<'_> {
        Laws {
            of_tet: &self.of_tet,
            regions: &self.regions,
            fibre: &self.fibre,
        }
    }

    /// Young's modulus of a tetrahedron over the material's.
    pub fn stiffness_at(&self, tet: u32) -> f32 {
        self.stiffness.get(tet as usize).copied().unwrap_or(1.0)
    }

    /// Stiffness over the material's of a cell that a blade has made of one of these tetrahedra, times the share of it that the cell fills.
    pub fn stiffness_of(&self, cell: &Element) -> f32 {
        self.stiffness_at(cell.parent) * cell.stiffness * cell.share as f32
    }

    /// Those of a body of `whole` tetrahedra that has been cut: without the elements that have changed, and behind the others the cells of these.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(super) fn cut(&self, whole: usize, changes: &Changes) -> Result<ElementLaws> {
        let Changes { gone, new } = changes;
        let most = whole + new.len();
        // The stiffness is always written out: a cell has its share of an element's, also where the
        // body is uniform.
        let room = |is_empty: bool| if is_empty { 0 } else { most };
        let mut stiffness = memory::room(most, WHAT)?;
        let mut of_tet = memory::room(room(self.of_tet.is_empty()), WHAT)?;
        let mut fibre = memory::room(room(self.fibre.is_empty()), WHAT)?;
        let ends = gone.iter().map(|element| *element as usize);
        let mut start = 0;
        for end in ends.chain([whole]) {
            match self.stiffness.is_empty() {
                true => stiffness.resize(stiffness.len() + end - start, 1.0),
                false => stiffness.extend_from_slice(&self.stiffness[start..end]),
            }
            of_tet.extend(self.of_tet.get(start..end).unwrap_or_default());
            fibre.extend(self.fibre.get(start..end).unwrap_or_default());
            start = end + 1;
        }
        for cell in new {
            stiffness.push(self.stiffness_of(cell));
            of_tet.extend(self.of_tet.get(cell.parent as usize));
            fibre.extend(self.fibre.get(cell.parent as usize));
        }
        Ok(ElementLaws {
            stiffness,
            of_tet,
            regions: memory::collected(self.regions.len(), self.regions.iter().cloned(), WHAT)?,
            fibre,
        })
    }
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
