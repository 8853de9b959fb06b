//! The tables of a body that has been cut: a copy of a node has its parent's rows.
//!
//! With the gather `G` of each node from its parent the basis is `G U`, so that a projection of forces adds those of copies to their parent's. Nodes that
//! tools may touch since have columns, too: the response of the intact body to a force on the nearest column, which is what the linear
//! guess takes; the iterations know them by the factor of the tangent (`docs/decisions/026-near-factor.md`).

use super::read::basis_places;
use super::{NO_COLUMN, PriorTable};
use crate::bundle::Mesh;
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the linear response of a cut body";

impl PriorTable {
    /// The tables of a mesh that this one's was cut to; `parents`: the node that each of its copies stems from.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn cut(&self, mesh: &Mesh, parents: &[u32]) -> Result<PriorTable> {
        let count = mesh.node_count();
        let own = count - parents.len();
        let mut copies: Vec<(u32, u32)> = Vec::new();
        memory::reserve(&mut copies, parents.len(), WHAT)?;
        copies.extend(
            (parents.iter())
                .zip(own as u32..)
                .map(|(parent, copy)| (*parent, copy)),
        );
        copies.sort_unstable();
        let (mut block_nodes, mut sources) =
            (memory::room(count, WHAT)?, memory::room(count, WHAT)?);
        let mut block_offsets = memory::room(self.block_offsets.len(), WHAT)?;
        block_offsets.push(0);
        for range in self.block_offsets.windows(2) {
            let nodes = &self.block_nodes[range[0] as usize..range[1] as usize];
            block_nodes.extend(nodes);
            sources.extend(nodes);
            for &node in nodes {
                let first = copies.partition_point(|copy| copy.0 < node);
                for (parent, copy) in copies[first..].iter().take_while(|copy| copy.0 == node) {
                    block_nodes.push(*copy);
                    sources.push(*parent);
                }
            }
            block_offsets.push(block_nodes.len());
        }
        let rows = sources.iter().map(|node| {
            let (row, _, rank) = self.places[*node as usize];
            row as usize..(row + 3 * rank) as usize
        });
        let basis = self.basis.gathered(rows)?;
        let ranks: Vec<usize> = self
            .rank_offsets
            .iter()
            .map(|rank| *rank as usize)
            .collect();
        let places = basis_places(&block_nodes, &block_offsets, &ranks)?;
        // Columns: those that there were, and the touchable nodes near one.
        let parent = |node: u32| match (node as usize).checked_sub(own) {
            Some(copy) => parents[copy],
            None => node,
        };
        let mut contact_nodes = memory::copied(&self.contact_nodes, WHAT)?;
        memory::reserve(&mut contact_nodes, mesh.domain_nodes.len(), WHAT)?;
        let touchable = mesh.domain_nodes.iter().copied();
        contact_nodes.extend(
            touchable.filter(|node| self.nearest_column[parent(*node) as usize] != NO_COLUMN),
        );
        contact_nodes.sort_unstable();
        contact_nodes.dedup();
        let bases = contact_nodes
            .iter()
            .map(|node| self.nearest_column[parent(*node) as usize]);
        let base = memory::collected(contact_nodes.len(), bases, WHAT)?;
        let mut nearest_column = memory::filled(count, NO_COLUMN, WHAT)?;
        for node in 0..count as u32 {
            let old = self.nearest_column[parent(node) as usize];
            if old != NO_COLUMN {
                let near = self.contact_nodes[old as usize];
                let column = (contact_nodes.binary_search(&node))
                    .or_else(|_| contact_nodes.binary_search(&near));
                nearest_column[node as usize] = column.map_or(NO_COLUMN, |at| at as u32);
            }
        }
        let mut in_domain = memory::filled(count, false, WHAT)?;
        for &node in &mesh.domain_nodes {
            in_domain[node as usize] = true;
        }
        let dofs = 3 * self.contact_nodes.len();
        let rows = |table: &[f32]| {
            let width = 3 * (table.len() / dofs.max(1));
            let all = base
                .iter()
                .flat_map(|b| &table[*b as usize * width..][..width]);
            memory::collected(base.len() * width, all.copied(), WHAT)
        };
        let width = 3 * self.width();
        let response = base
            .iter()
            .map(|b| *b as usize * width..(*b as usize + 1) * width);
        let place = |at: usize| places[contact_nodes[at] as usize];
        Ok(PriorTable {
            compliance: self.compliance.of_bases(&base, place)?,
            block_nodes,
            block_offsets: block_offsets.iter().map(|at| *at as u32).collect(),
            rank_offsets: memory::copied(&self.rank_offsets, WHAT)?,
            basis,
            response: self.response.gathered(response)?,
            residual: memory::copied(&self.residual, WHAT)?,
            force_to_z: rows(&self.force_to_z)?,
            force_to_p: rows(&self.force_to_p)?,
            vibration: self.vibration.as_ref().map(|own| own.of_bases(&base)),
            nearest_column,
            in_domain,
            places,
            contact_nodes,
        })
    }
}
