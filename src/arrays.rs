//! Fields as arrays of the crate `ndarray`: `[n,3]` float32, row-major, without a copy where the library's own memory can be
//! lent. A C host has none of it.

use ndarray::{Array2, ArrayView2};

use crate::error::{Error, Result};
use crate::model::Model;
use crate::options::IndexSet;
use crate::scene::{Contact, Scene, StepInput};

impl Model {
    /// Rest positions `[K,3]`, mm.
    pub fn rest(&self) -> ArrayView2<'_, f32> {
        view(self.positions(), 3)
    }

    /// Triangles `[n,3]` or tetrahedra `[n,4]` of a static index set, by node; a set of nodes is one column.
    pub fn elements(&self, set: IndexSet) -> ArrayView2<'_, u32> {
        let columns = match set {
            IndexSet::SurfaceNodes | IndexSet::DomainNodes | IndexSet::HeldNodes => 1,
            IndexSet::SurfaceFaces | IndexSet::DomainFaces => 3,
            IndexSet::Tets => 4,
        };
        view(self.indices(set), columns)
    }
}

impl Scene {
    /// The last published displacement `[n,3]`, mm: all `K` nodes, or those of the region in its order.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn displacement(&self) -> Result<Array2<f32>> {
        let mut field = Array2::zeros((self.region_count(), 3));
        if let Some(out) = field.as_slice_mut() {
            self.read(out)?;
        }
        Ok(field)
    }
}

impl<'a> StepInput<'a> {
    /// With the current displacement `[K,3]`, mm, in place of the scene's own state.
    ///
    /// # Errors
    /// [`Error::Argument`] for another number of columns, and where the rows do not lie one behind another in memory.
    pub fn with_displacement(self, field: ArrayView2<'a, f32>) -> Result<StepInput<'a>> {
        let displacement = Some(rows(field, "displacement")?);
        Ok(StepInput {
            displacement,
            ..self
        })
    }
}

impl<'a> Contact<'a> {
    /// The collision field `[K,3]`, mm, zero but at nodes in contact.
    ///
    /// # Errors
    /// As [`StepInput::with_displacement`].
    pub fn field(field: ArrayView2<'a, f32>) -> Result<Contact<'a>> {
        Ok(Contact::Dense(rows(field, "collision field")?))
    }

    /// Nodes in contact, and `[m,3]` where they go, mm.
    ///
    /// ```
    /// use ndarray::array;
    /// use upt::Contact;
    ///
    /// let down = array![[0.0, 0.0, -1.0], [0.0, 0.0, -0.5]];
    /// assert!(Contact::at(&[12, 40], down.view()).is_ok());
    /// assert!(Contact::at(&[12, 40], array![[0.0]].view()).is_err());
    /// ```
    ///
    /// # Errors
    /// As [`StepInput::with_displacement`].
    pub fn at(nodes: &'a [u32], vectors: ArrayView2<'a, f32>) -> Result<Contact<'a>> {
        let vectors = rows(vectors, "contact vectors")?;
        Ok(Contact::Sparse { nodes, vectors })
    }
}

fn view<T>(values: &[T], columns: usize) -> ArrayView2<'_, T> {
    let shape = (values.len() / columns, columns);
    ArrayView2::from_shape(shape, values)
        .expect("whole rows: the bundle's reader has checked the mesh")
}

fn rows<'a>(field: ArrayView2<'a, f32>, name: &str) -> Result<&'a [f32]> {
    if field.ncols() != 3 {
        return Err(Error::Argument(format!(
            "{name} is [{}, {}], must have 3 columns: x, y, z in mm",
            field.nrows(),
            field.ncols()
        )));
    }
    field.to_slice().ok_or_else(|| {
        Error::Argument(format!(
            "{name}: the rows do not lie one behind another; pass `field.as_standard_layout().view()`"
        ))
    })
}
