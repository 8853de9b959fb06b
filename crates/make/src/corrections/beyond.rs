//! What a state in contact has beyond the linear response to its collision field.

use anyhow::Result;
use upt::kernels::{Isa, Pool};
use upt::prior::ContactResponse;

use super::workbench::Workbench;

/// Solves for linear responses, one after another, on one thread.
pub struct Beyond<'a> {
    source: &'a Workbench,
    response: ContactResponse,
    isa: Isa,
    pool: Pool,
}

impl<'a> Beyond<'a> {
    pub fn new(source: &'a Workbench) -> Result<Self> {
        Ok(Self {
            source,
            response: ContactResponse::new(&source.prior)?,
            isa: Isa::detect(),
            pool: Pool::new(1)?,
        })
    }

    /// The state `q` less the linear response to `nodes` displaced by `vectors` (mm), both in block coordinates `[Q]`.
    pub fn linear(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        mut q: Vec<f32>,
    ) -> Result<Vec<f32>> {
        let Workbench {
            prior, held_flags, ..
        } = self.source;
        let vectors = vectors.as_flattened();
        self.response
            .solve(self.isa, prior, held_flags, nodes, vectors)?;
        let mut linear = vec![0.0; q.len()];
        self.response
            .field(self.isa, &self.pool, prior, &mut linear)?;
        q.iter_mut().zip(&linear).for_each(|(q, l)| *q -= l);
        Ok(q)
    }
}
