//! The directions of fibres of a chunk.

use crate::directions::Directions;
use crate::partition::{Chunk, Partition};

impl Partition {
    /// Whether any law has fibres.
    pub(crate) fn has_fibres(&self) -> bool {
        std::iter::once(&self.moduli.law)
            .chain(&self.laws)
            .any(|law| law.fibres().is_some())
    }

    /// The directions of the fibres of a chunk's batches; empty where no law has fibres.
    #[inline(always)]
    pub fn directions(
        &self,
        chunk: &Chunk,
    ) -> (&[Directions<4>], &[Directions<2>], &[Directions<1>]) {
        (
            self.octahedra.directions_of(&chunk.octahedra),
            self.pairs.directions_of(&chunk.pairs),
            self.singles.directions_of(&chunk.singles),
        )
    }
}
