//! The fields `[K,3]` that a step iterates on. Between two steps they hold nothing that counts.
//!
//! They are made with the scene, since a step may not allocate. Each has several uses in the course
//! of a step, named below; a function that needs one says which it writes over.

use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// See the module.
#[derive(HeldBytes)]
pub(super) struct Fields {
    /// The state being made, mm: the host's field changes only when it is done.
    pub u: Vec<f32>,
    /// The residual `F(u)` of the state that stands, and of the one tried, µN. Zero at held and prescribed nodes.
    pub g: Vec<f32>,
    pub g_new: Vec<f32>,
    /// The direction, mm; a field of scratch while there is none.
    pub d: Vec<f32>,
    /// Scratch: the state tried, then the change of the residual.
    pub q: Vec<f32>,
    /// The first guess of a step that tools drive, mm.
    pub guess: Vec<f32>,
    /// Where the tissue would be, mm, at the nodes of the domain.
    pub touched: Vec<f32>,
}

impl Fields {
    /// Of `len` numbers each.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(len: usize) -> Result<Fields> {
        let field = || memory::zeros(len, "the corrections of a scene");
        Ok(Fields {
            u: field()?,
            g: field()?,
            g_new: field()?,
            d: field()?,
            q: field()?,
            guess: field()?,
            touched: field()?,
        })
    }
}
