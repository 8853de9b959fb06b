//! A cut body that relaxes: its elements remember what those that they stem from do.

use super::core::Core;
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the stresses of a cut body";

impl Core {
    /// Takes what relaxing tissue remembers of the core before it.
    pub(super) fn take_stresses(&mut self, before: &Core) -> Result<()> {
        let (now, then) = (self.parents()?, before.parents()?);
        let (Some(own), Some(old)) = (&mut self.corrected, &before.corrected) else {
            return Ok(());
        };
        let source = (&*old.solver, before.model.corrections()?);
        (own.solver).remember_as(self.model.corrections()?, source, [&now, &then])
    }

    /// The mesh element that each element of a relaxing body stems from, by its number.
    fn parents(&self) -> Result<Vec<u32>> {
        let relaxes = self
            .corrected
            .as_ref()
            .is_some_and(|own| own.solver.relaxes());
        if !relaxes {
            return Ok(Vec::new());
        }
        let intact = self.intact_mesh().tets.len() as u32 / 4;
        let mut parents = memory::collected(intact as usize, 0..intact, WHAT)?;
        if let Some(cut) = &self.cut {
            let new = cut.body.changes().new;
            memory::reserve(&mut parents, new.len(), WHAT)?;
            parents.extend(new.iter().map(|element| element.parent));
        }
        Ok(parents)
    }
}
