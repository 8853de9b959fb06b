//! The tables of a body that has been cut: a copy of a node has its parent's rows.
//!
//! With the gather `G` of each node from its parent the basis is `G U`, so that a projection of forces adds those of copies to their parent's. Nodes that
//! tools may touch since have columns, too, behind the others: the response of the intact body to a force on the nearest column, which is what the linear
//! guess takes; the iterations know them by the factor of the tangent (`docs/decisions/026-near-factor.md`). The large tables are the intact body's own.

use std::sync::Arc;

use super::blocks::Blocks;
use super::{LearnedTables, NO_COLUMN, PriorTable};
use bundle::Mesh;
use field::error::Result;
use field::memory;

const WHAT: &str = "the linear response of a cut body";

impl PriorTable {
    /// The tables of a mesh that this one's was cut to; `parents`: the node that each of its copies stems from.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    /// `mesh` has the nodes of this table's mesh first and the copies behind them, one for each of
    /// `parents`, in the order in which they were made.
    pub fn cut(&self, mesh: &Mesh, parents: &[u32]) -> Result<PriorTable> {
        let (count, blocks) = (mesh.node_count(), &self.blocks);
        let own = count - parents.len();
        let mut copies: Vec<(u32, u32)> = memory::room(parents.len(), WHAT)?;
        copies.extend(
            (parents.iter())
                .zip(own as u32..)
                .map(|(parent, copy)| (*parent, copy)),
        );
        // By the block that they are of, which a block's first coordinate tells, in the order of their numbers.
        let block = |copy: &(u32, u32)| {
            let (_, start, rank) = blocks.places[copy.0 as usize];
            (start, rank)
        };
        copies.sort_unstable_by_key(|copy| (block(copy), copy.1));
        let mut block_nodes = memory::room(count, WHAT)?;
        let mut locals = memory::room(count, WHAT)?;
        let mut block_offsets = memory::room(blocks.offsets.len(), WHAT)?;
        block_offsets.push(0);
        let mut left = copies.as_slice();
        let (mut first_row, mut places) = (0, memory::room(count, WHAT)?);
        places.extend_from_slice(&blocks.places);
        // Every copy's place is set below: each belongs to the block of its parent.
        places.resize(count, (0, 0, 0));
        let ranges = (blocks.offsets)
            .windows(2)
            .zip(blocks.rank_offsets.windows(2));
        for (range, ranks) in ranges {
            let nodes = &blocks.nodes[range[0] as usize..range[1] as usize];
            block_nodes.extend_from_slice(nodes);
            locals.extend(0..nodes.len() as u32);
            let (start, rank) = (ranks[0], ranks[1] - ranks[0]);
            let is_here = |copy: &&(u32, u32)| block(copy) == (start, rank);
            let here = left.iter().take_while(is_here).count();
            // The parent's rows, by its place in the block: where they start, over three rows'
            // length.
            for &(parent, copy) in &left[..here] {
                let place = blocks.places[parent as usize];
                block_nodes.push(copy);
                locals.push((place.0 - first_row) / (3 * rank.max(1)));
                places[copy as usize] = place;
            }
            left = &left[here..];
            first_row += 3 * rank * nodes.len() as u32;
            block_offsets.push(block_nodes.len() as u32);
        }
        let parent = |node: u32| match (node as usize).checked_sub(own) {
            Some(copy) => parents[copy],
            None => node,
        };
        // Columns: those that there were, and the touchable nodes near one.
        let mut contact_nodes = memory::copied(&self.contact_nodes, WHAT)?;
        let mut nearest_column = memory::room(count, WHAT)?;
        nearest_column.extend_from_slice(&self.nearest_column);
        nearest_column.extend(
            parents
                .iter()
                .map(|node| self.nearest_column[*node as usize]),
        );
        let mut sources = Vec::new();
        let mut in_domain = memory::filled(count, false, WHAT)?;
        for &node in &mesh.domain.nodes {
            in_domain[node as usize] = true;
            // A copy, or a node inside the body that a cut has laid bare: the nearest column of its
            // parent is the nearest of its own, as both rest at one place.
            let near = self.nearest_column[parent(node) as usize];
            if near != NO_COLUMN && self.contact_nodes[near as usize] != node {
                nearest_column[node as usize] = contact_nodes.len() as u32;
                memory::push(&mut contact_nodes, node, WHAT)?;
                memory::push(&mut sources, near, WHAT)?;
            }
        }
        Ok(PriorTable {
            compliance: Arc::clone(&self.compliance),
            blocks: Blocks {
                nodes: block_nodes,
                offsets: block_offsets,
                rank_offsets: memory::copied(&blocks.rank_offsets, WHAT)?,
                copies: Some((memory::copied(&blocks.offsets, WHAT)?, locals)),
                numbers: Arc::clone(&blocks.numbers),
                places,
            },
            response: Arc::clone(&self.response),
            learned: LearnedTables::default(),
            vibration: None,
            nearest_column,
            in_domain,
            contact_nodes,
            sources,
        })
    }
}
