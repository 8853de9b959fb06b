//! What is kept of a pair of local iterations from step to step, and in snapshots.

use serde::{Deserialize, Serialize};

use super::linear::WHAT;
use super::near::NearSet;
use super::step::{Change, Step};
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use crate::stored;

/// What is kept of a pair.
/// By node and mode and not by place, so that a pair outlives the near set that it was made with
/// (`docs/decisions/023-local-iterations.md`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, HeldBytes)]
pub struct Record {
    /// Nodes that the tools touched when it was made, thinned out, and the centres of what was near.
    /// The near set that is made next is made about these, too.
    #[serde(with = "stored")]
    pub about: Vec<u32>,
    #[serde(with = "stored")]
    pub centres: Vec<u32>,
    /// Inside nodes then.
    #[serde(with = "stored")]
    pub nodes: Vec<u32>,
    /// The step, and what it changed: `[3 S]` at these nodes each, and by mode.
    #[serde(with = "stored")]
    pub t: Vec<f32>,
    #[serde(with = "stored")]
    pub r: Vec<f32>,
    #[serde(with = "stored")]
    pub c: Vec<f32>,
    #[serde(with = "stored")]
    pub p: Vec<f32>,
}

impl Record {
    /// Checks what was read.
    /// Against the numbers of nodes and modes of a body.
    pub fn check(&self, [nodes, modes]: [usize; 2]) -> Result<()> {
        let inside = |list: &[u32]| list.iter().all(|&node| (node as usize) < nodes);
        let sound = inside(&self.about)
            && inside(&self.nodes)
            && inside(&self.centres)
            && self.centres.windows(2).all(|pair| pair[0] < pair[1]);
        if !sound {
            return Err(crate::Error::Snapshot(
                "holds corrections of another body".into(),
            ));
        }
        for (list, len) in [
            (&self.t, 3 * self.nodes.len()),
            (&self.r, 3 * self.nodes.len()),
            (&self.c, modes),
            (&self.p, modes),
        ] {
            stored::check(list, len)?;
        }
        Ok(())
    }
}

impl Record {
    /// Copies another into the room that there is. In the order of the fields: what fails half way
    /// is in no list yet.
    pub(super) fn take(&mut self, other: &Record) -> Result<()> {
        memory::replace(&mut self.about, &other.about, WHAT)?;
        memory::replace(&mut self.centres, &other.centres, WHAT)?;
        memory::replace(&mut self.nodes, &other.nodes, WHAT)?;
        memory::replace(&mut self.t, &other.t, WHAT)?;
        memory::replace(&mut self.r, &other.r, WHAT)?;
        memory::replace(&mut self.c, &other.c, WHAT)?;
        memory::replace(&mut self.p, &other.p, WHAT)
    }

    /// Takes a pair in the places of a near set: only inside nodes have a `t` and an `r`.
    pub(super) fn fill(
        &mut self,
        near: &NearSet,
        about: &[u32],
        step: &Step,
        change: &Change,
    ) -> Result<()> {
        memory::replace(&mut self.about, about, WHAT)?;
        memory::replace(&mut self.centres, &near.centres, WHAT)?;
        memory::replace(
            &mut self.nodes,
            &near.places.nodes[..near.places.inside],
            WHAT,
        )?;
        memory::replace(&mut self.t, &step.t, WHAT)?;
        memory::replace(&mut self.r, &change.r, WHAT)?;
        memory::replace(&mut self.c, &step.c, WHAT)?;
        memory::replace(&mut self.p, &change.p, WHAT)
    }
}
