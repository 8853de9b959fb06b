//! Support groups in a frame: where the host has them at its time, and the body by their columns ([`crate::corrections::Group`]).
//!
//! At the group's nodes the frame would have `u_n + tau v_n`; the host has them elsewhere by `delta`, of which the columns take the body's part.
//! What a step has let go moves as tissue until a step holds it again, and what a step holds is held in frames until a step lets it go.

use super::extrapolation::VelocityExtrapolation;
use crate::bundle::Mesh;
use crate::corrections::Group;
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use crate::scene::supports::{GroupMotion, GroupState};

const WHAT: &str = "the present state of a scene";

/// Groups of a step, and what they do in a frame after it.
#[derive(Default, HeldBytes)]
pub(super) struct LedGroups {
    /// Of the step; empty where all are as they were meshed.
    pub states: Vec<GroupState>,
    /// What each group that is led has of its columns.
    amounts: Vec<(usize, [f32; Group::MOST_COLUMNS])>,
    /// Where its nodes are, ascending.
    places: Vec<(u32, [f32; 3])>,
    own: Vec<(u32, [f32; 3])>,
    /// Room for a group at the time of the frame.
    now: GroupState,
}

impl LedGroups {
    /// Looks where the groups are; `motions` empty: they go on as they went.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] for a node that would go too far, [`crate::Error::OutOfMemory`].
    pub fn look(
        &mut self,
        (mesh, groups): (&Mesh, &[Group]),
        motions: &[GroupMotion<'_>],
        extrapolation: &VelocityExtrapolation,
        fields: (&[f32], &[f32], &[f32]),
        free: &mut [f32],
    ) -> Result<()> {
        self.amounts.clear();
        self.places.clear();
        if motions.is_empty() {
            return Ok(());
        }
        memory::fit(&mut self.amounts, groups.len(), WHAT)?;
        let count = mesh.supports.iter().map(|group| group.nodes.len()).sum();
        memory::fit(&mut self.places, count, WHAT)?;
        memory::fit(&mut self.own, count, WHAT)?;
        for (at, (set, group)) in mesh.supports.iter().zip(groups).enumerate() {
            let motion = motions.iter().find(|motion| motion.group as usize == at);
            let motion = motion.copied().unwrap_or_default();
            let state = self.states.get(at);
            let is_free = motion.let_go || state.is_some_and(|state| state.let_go);
            // No step has moved it yet: its columns are made in the first that does.
            if is_free || !group.has_lift() {
                continue;
            }
            extrapolation.follow(&set.nodes, fields, |_, u| u, free);
            self.own.clear();
            let last = fields.1;
            self.now
                .take(mesh, set, &motion, (state, last), &mut self.own)?;
            let amounts = group.amounts(|index| {
                let (node, to) = self.own[index];
                let from = &free[3 * node as usize..];
                [0, 1, 2].map(|axis| to[axis] - from[axis])
            });
            self.amounts.push((at, amounts));
            self.places.extend_from_slice(&self.own);
        }
        self.places.sort_unstable_by_key(|(node, _)| *node);
        Ok(())
    }

    /// Where a node is that would be at `free` without the groups.
    pub fn moved(&self, groups: &[Group], node: u32, free: [f32; 3]) -> [f32; 3] {
        if self.amounts.is_empty() {
            return free;
        }
        match self.places.binary_search_by_key(&node, |(node, _)| *node) {
            Ok(at) => self.places[at].1,
            Err(_) => {
                let mut u = free;
                for (at, amounts) in &self.amounts {
                    groups[*at].add(amounts, node, &mut u);
                }
                u
            }
        }
    }

    /// Tissue that stays at these nodes where the step left it, `last [K,3]`, and goes with the groups alone, into `free`.
    pub fn stay<'a>(
        &self,
        groups: &[Group],
        nodes: impl IntoIterator<Item = &'a u32>,
        last: &[f32],
        free: &mut [f32],
    ) {
        let (last, free) = (last.as_chunks::<3>().0, free.as_chunks_mut::<3>().0);
        for &node in nodes {
            free[node as usize] = self.moved(groups, node, last[node as usize]);
        }
    }

    /// All of it that a contact solve depends on.
    pub fn key(&self) -> &[(u32, [f32; 3])] {
        &self.places
    }
}
