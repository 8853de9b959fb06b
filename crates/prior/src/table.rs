//! The tables of the linear response: compliance, block-wise basis, response, residual modes.

mod blocks;
mod cut;
mod read;

use std::sync::Arc;

use super::compliance::{Bases, Borrowed, Compliance};
use super::response_table::Response;
use super::vibration::FreeVibration;
use blocks::Blocks;
use field::error::Result;
use field::memory::{self, HeldBytes};
use kernels::rows::BlockBasis;

/// A node without a column near it.
pub const NO_COLUMN: u32 = u32::MAX;
/// The tables of the linear response, as `prior.safetensors` has them.
#[derive(Debug, HeldBytes)]
pub struct PriorTable {
    /// Nodes with compliance columns `[D]`: those of the tables, ascending, and behind them those that a cut has laid bare.
    pub contact_nodes: Vec<u32>,
    /// Of each of the latter: the column of the tables whose response it has.
    sources: Vec<u32>,
    /// Of the columns of the tables with each other; a cut body has the intact body's, and asks it for what its columns
    /// borrow.
    #[held(own)]
    compliance: Arc<Compliance>,
    /// The basis that decodes `q`, and projects on it.
    blocks: Blocks,
    /// Response of a unit force on a column of the tables `[3D,Q]`, mm/mN; see [`PriorTable::stored_dof`].
    #[held(own)]
    pub response: Arc<Response>,
    /// Of a learned map; a cut body has none, since the map knows the intact body alone.
    pub learned: LearnedTables,
    /// For each node the column (index into `contact_nodes`) of itself or of the nearest contact node within
    /// four typical edges of the domain; `NO_COLUMN` for nodes farther away.
    pub nearest_column: Vec<u32>,
    /// Whether a node belongs to the domain `[K]`. A bundle may have columns of a part of the domain only.
    pub in_domain: Vec<bool>,
    /// What the response does when the contact is gone; without it the response is zero then.
    pub vibration: Option<FreeVibration>,
}

/// The residual modes of a learned map, and what it reads of contact forces; all empty where the bundle has none.
#[derive(Debug, Default, HeldBytes)]
pub struct LearnedTables {
    /// Residual modes `[r,Q]`.
    pub residual: Vec<f32>,
    /// `[3D,r_z]`.
    pub force_to_z: Vec<f32>,
    /// `[3D,r]`.
    pub force_to_p: Vec<f32>,
}

impl PriorTable {
    /// Length of `q`.
    pub fn width(&self) -> usize {
        self.blocks.width()
    }

    /// Largest rank of a block.
    pub fn widest_block(&self) -> usize {
        self.blocks.widest()
    }

    /// Row `axis` of a node in the basis times coordinates `q`.
    pub fn value_at(&self, node: u32, axis: usize, q: impl Fn(usize) -> f32) -> f32 {
        self.blocks.value_at(node, axis, q)
    }

    /// Coordinates of the block that a node is of.
    pub fn coordinates_of(&self, node: u32) -> std::ops::Range<usize> {
        self.blocks.coordinates_of(node)
    }

    /// `q += U^T f` of a vector on one node.
    pub fn add_row(&self, node: u32, f: [f32; 3], q: &mut [f32]) {
        self.blocks.add_row(node, f, q);
    }

    /// Where each block's rows start in the basis `[B+1]`.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn basis_starts(&self) -> Result<Vec<usize>> {
        self.blocks.starts()
    }

    /// The block-wise basis as the kernels take it.
    pub fn basis(&self) -> BlockBasis<'_> {
        self.blocks.basis()
    }

    /// `q += U^T u` of a field `[K,3]`: its coordinates in the orthonormal block bases.
    pub fn project(&self, field: &[f32], q: &mut [f32]) {
        self.blocks.project(field, q);
    }

    /// Writes the upper triangle of the compliance of `columns` (indices into `contact_nodes`, ascending) with themselves,
    /// `[3m,3m]`, mm/mN. `scratch` is kept between calls.
    pub fn gather_compliance(&self, columns: &[u32], upper: &mut [f64], scratch: &mut Vec<f32>) {
        self.gather_new_compliance((columns, &[]), upper, scratch);
    }

    /// The same without the blocks of two columns that are both `known`, which stay as they are.
    /// Contacts grow node by node: of a set that has grown only the new rows are read.
    pub fn gather_new_compliance<T: From<f32>>(
        &self,
        columns: (&[u32], &[bool]),
        upper: &mut [T],
        scratch: &mut Vec<f32>,
    ) {
        let bases = Bases {
            basis: &self.blocks.numbers,
            response: &self.response,
            width: self.width(),
        };
        if self.sources.is_empty() {
            self.compliance.gather(bases, columns, upper, scratch);
            return;
        }
        let own = self.contact_nodes.len() - self.sources.len();
        let borrowed = Borrowed {
            sources: &self.sources,
            places: &|behind| self.blocks.places[self.contact_nodes[own + behind] as usize],
        };
        (self.compliance).gather_borrowed(bases, borrowed, columns, upper, scratch);
    }

    /// The row of the tables that a degree of freedom of a column has: its own, or that of the column whose response it has.
    pub fn stored_dof(&self, dof: u32) -> u32 {
        let own = self.contact_nodes.len() - self.sources.len();
        match (dof as usize / 3).checked_sub(own) {
            Some(behind) => 3 * self.sources[behind] + dof % 3,
            None => dof,
        }
    }

    /// Whether some columns have the response of others.
    pub fn borrows(&self) -> bool {
        !self.sources.is_empty()
    }

    /// The same for a list; `room` is taken where they are others.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn stored_dofs<'a>(&self, dofs: &'a [u32], room: &'a mut Vec<u32>) -> Result<&'a [u32]> {
        if self.sources.is_empty() {
            return Ok(dofs);
        }
        room.clear();
        memory::fit(room, dofs.len(), "the linear response of a cut body")?;
        room.extend(dofs.iter().map(|dof| self.stored_dof(*dof)));
        Ok(room)
    }

    /// Bytes that it shares with the table of the intact body.
    pub fn shared_bytes(&self) -> usize {
        memory::behind(&self.compliance)
            + memory::behind(&self.blocks.numbers)
            + memory::behind(&self.response)
    }

    /// The column that a contact node acts on, and whether it is the column's own node; none for a node that is held or too
    /// far from every column.
    pub fn column_for(&self, held: &[bool], node: u32) -> Option<(usize, bool)> {
        let column = self.nearest_column[node as usize];
        if held[node as usize] || column == NO_COLUMN {
            return None;
        }
        Some((column as usize, self.contact_nodes[column as usize] == node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ContactResponse;
    use crate::numbers::Numbers;
    use kernels::Isa;

    /// Four nodes; columns at 0 and 1, which node 2 (of the domain) and node 3 (outside) have nearest by.
    fn table() -> PriorTable {
        let mut compliance = vec![0.0; 36];
        (0..6).for_each(|i| compliance[7 * i] = 2.0);
        PriorTable {
            contact_nodes: vec![0, 1],
            sources: Vec::new(),
            compliance: Arc::new(Compliance::Whole(compliance)),
            blocks: Blocks {
                nodes: vec![0, 1, 2, 3],
                offsets: vec![0, 4],
                rank_offsets: vec![0, 8],
                copies: None,
                numbers: Arc::new(Numbers::F32(vec![0.0; 96])),
                places: Vec::new(),
            },
            response: Arc::new(Response::Whole(Numbers::F32(vec![0.0; 48]))),
            learned: LearnedTables::default(),
            nearest_column: vec![0, 1, 1, 1],
            in_domain: vec![true, true, true, false],
            vibration: None,
        }
    }

    #[test]
    fn borrowers_share_a_column_and_only_nodes_beyond_the_domain_are_reported() {
        let table = table();
        let mut response = ContactResponse::new(&table).unwrap();
        let mut solve = |nodes: &[u32], vectors: &[f32]| {
            let report = response
                .solve(Isa::Scalar, &table, &[false; 4], nodes, vectors)
                .unwrap();
            (report.outside, response.forces().to_vec())
        };
        assert_eq!(
            solve(&[2], &[4.0, 0.0, -2.0]),
            (false, vec![2.0, 0.0, -1.0])
        );
        assert_eq!(
            solve(&[2, 3], &[4.0, 0.0, 0.0, 0.0, 0.0, 8.0]),
            (true, vec![1.0, 0.0, 2.0])
        );
        // The column's own node goes before those that borrow it.
        assert_eq!(
            solve(&[1, 2], &[6.0, 0.0, 0.0, 9.0, 9.0, 9.0]),
            (false, vec![3.0, 0.0, 0.0])
        );
    }

    #[test]
    fn borrowers_share_a_columns_force_and_its_own_node_goes_before_them() {
        let mut table = table();
        let mut response = ContactResponse::new(&table).unwrap();
        let held = [true, false, false, false];
        let mut reaction = |table: &PriorTable, nodes: &[u32], vectors: &[f32], places: &[u32]| {
            response
                .solve(Isa::Scalar, table, &held, nodes, vectors)
                .unwrap();
            let mut out = vec![f32::NAN; 3 * nodes.len()];
            response.reaction(table, &held, nodes, places, &mut out);
            out
        };
        // The mean of both is imposed on column 1, in the host's order; its compliance is 2 mm/mN.
        let two = [4.0, 0.0, 0.0, 0.0, 0.0, 8.0];
        assert_eq!(
            reaction(&table, &[2, 3], &two, &[1, 0]),
            [-0.5, 0.0, -1.0, -0.5, 0.0, -1.0]
        );
        // Node 0 is held.
        assert_eq!(
            reaction(&table, &[0, 1], &two, &[0, 1]),
            [0.0, 0.0, 0.0, 0.0, 0.0, -4.0]
        );
        let both = [0.0, 6.0, 0.0, 9.0, 9.0, 9.0];
        assert_eq!(
            reaction(&table, &[1, 2], &both, &[0, 1]),
            [0.0, -3.0, 0.0, 0.0, 0.0, 0.0]
        );
        table.nearest_column[2] = NO_COLUMN;
        assert_eq!(
            reaction(&table, &[2, 3], &two, &[0, 1]),
            [0.0, 0.0, 0.0, 0.0, 0.0, -4.0]
        );
        assert_eq!(reaction(&table, &[], &[], &[]), [0.0; 0]);
    }
}
