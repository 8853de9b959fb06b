//! A cut body that relaxes: its elements remember what those that they stem from do.

use topology::{Element, origin};

use super::core::Core;
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the stresses of a cut body";

impl Core {
    /// Takes what relaxing tissue remembers of the core before it; `source` is the node there of each node.
    pub(super) fn take_stresses(
        &mut self,
        before: &Core,
        source: impl Fn(usize) -> usize,
    ) -> Result<()> {
        let (Some(own), Some(old)) = (&self.corrected, &before.corrected) else {
            return Ok(());
        };
        if !own.solver.relaxes() {
            return Ok(());
        }
        let sources = self.element_sources(before, source)?;
        let from = (&*old.solver, before.model.corrections()?);
        let corrections = self.model.corrections()?;
        match &mut self.corrected {
            Some(own) => own.solver.remember_as(corrections, from, &sources),
            None => Ok(()),
        }
    }

    /// The number, in the body before, of what each element stems from, by its own number. Cells of one mesh element that an earlier cut has parted have been
    /// strained on their own since.
    fn element_sources(&self, before: &Core, source: impl Fn(usize) -> usize) -> Result<Vec<u32>> {
        let intact = self.intact_mesh().tets.len() as u32 / 4;
        let mut sources = memory::collected(intact as usize, 0..intact, WHAT)?;
        let cells = |core: &Core| -> Vec<Element> {
            let cut = core.cut.as_ref();
            cut.map_or_else(Vec::new, |cut| cut.body.changes().new)
        };
        let (own, old) = (cells(self), cells(before));
        memory::reserve(&mut sources, own.len(), WHAT)?;
        for element in &own {
            let place = origin(element, &old, |node| source(node as usize) as u32);
            sources.push(place.map_or(element.parent, |place| intact + place as u32));
        }
        Ok(sources)
    }
}
