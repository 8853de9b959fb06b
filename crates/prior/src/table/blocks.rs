//! The block-wise basis: each node is of one block, and each block has modes of its own.
//!
//! Neighbouring nodes move alike, so the fields of a block of them lie near a space of far fewer
//! dimensions than it has degrees of freedom. `u_k = U_k q_k` with `U_k [3 n_k,r_k]`,
//! `U_k^T U_k = 1`; blocks share no node and no coordinate, so each can be decoded on its own.

use std::sync::Arc;

use crate::numbers::Numbers;
use field::error::Result;
use field::memory::{self, HeldBytes};
use kernels::rows::{BlockBasis, Copies};

/// `U`, block after block; of a block the rows of its nodes, three each.
#[derive(Debug, HeldBytes)]
pub(super) struct Blocks {
    /// Nodes of all blocks, one block after another, and where each block's start `[B+1]`.
    pub nodes: Vec<u32>,
    pub offsets: Vec<u32>,
    /// Where each block's coordinates start in `q` `[B+1]`.
    pub rank_offsets: Vec<u32>,
    /// Of a cut body: nodes with rows of their own before each block, and whose rows each node of `nodes` has ([`Copies`]).
    pub copies: Option<(Vec<u32>, Vec<u32>)>,
    /// `[sum_k 3 n_k r_k]`, row-major by block; a cut body has the intact body's, and its copies have their parents' rows
    /// in it.
    #[held(own)]
    pub numbers: Arc<Numbers>,
    /// By node: where its rows start, where its block's coordinates start, and how many.
    /// In numbers, not bytes: `u32` reaches 16 GB of f32.
    pub places: Vec<(u32, u32, u32)>,
}

impl Blocks {
    /// Length of `q`.
    pub fn width(&self) -> usize {
        self.rank_offsets.last().map_or(0, |&width| width as usize)
    }

    /// Largest rank of a block.
    pub fn widest(&self) -> usize {
        let ranks = self.rank_offsets.windows(2);
        ranks.map(|pair| pair[1] - pair[0]).max().unwrap_or(0) as usize
    }

    /// Row `axis` of a node in the basis times coordinates `q`.
    /// `q` is asked for the coordinates of the node's block alone.
    pub fn value_at(&self, node: u32, axis: usize, q: impl Fn(usize) -> f32) -> f32 {
        let (row, start, rank) = self.places[node as usize];
        let row = row as usize + axis * rank as usize;
        let columns = 0..rank as usize;
        columns
            .map(|at| self.numbers.at(row + at) * q(start as usize + at))
            .sum()
    }

    /// Coordinates of the block that a node is of.
    pub fn coordinates_of(&self, node: u32) -> std::ops::Range<usize> {
        let (_, start, rank) = self.places[node as usize];
        start as usize..(start + rank) as usize
    }

    /// `q += U^T f` of a vector on one node.
    pub fn add_row(&self, node: u32, f: [f32; 3], q: &mut [f32]) {
        let (row, start, rank) = self.places[node as usize];
        let (row, start, rank) = (row as usize, start as usize, rank as usize);
        for (axis, f) in f.into_iter().enumerate() {
            let from = row + axis * rank;
            for (at, q) in q[start..start + rank].iter_mut().enumerate() {
                *q += f * self.numbers.at(from + at);
            }
        }
    }

    /// Where each block's rows start in the basis `[B+1]`.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn starts(&self) -> Result<Vec<usize>> {
        let mut starts = memory::room(self.rank_offsets.len(), "the linear response")?;
        starts.push(0);
        let offsets = match &self.copies {
            Some((own, _)) => own,
            None => &self.offsets,
        };
        let blocks = offsets.windows(2).zip(self.rank_offsets.windows(2));
        for (nodes, ranks) in blocks {
            let size = 3 * (nodes[1] - nodes[0]) as usize * (ranks[1] - ranks[0]) as usize;
            starts.push(starts[starts.len() - 1] + size);
        }
        Ok(starts)
    }

    /// The block-wise basis as the kernels take it.
    pub fn basis(&self) -> BlockBasis<'_> {
        BlockBasis {
            block_nodes: &self.nodes,
            block_offsets: &self.offsets,
            rank_offsets: &self.rank_offsets,
            basis: self.numbers.stored(),
            copies: (self.copies.as_ref()).map(|(own, locals)| Copies {
                row_offsets: own,
                locals,
            }),
        }
    }

    /// `q += U^T u` of a field `[K,3]`: its coordinates in the orthonormal block bases.
    pub fn project(&self, field: &[f32], q: &mut [f32]) {
        for &node in &self.nodes {
            let (row, start, rank) = self.places[node as usize];
            let (mut row, start, rank) = (row as usize, start as usize, rank as usize);
            let q = &mut q[start..start + rank];
            for &u in &field[3 * node as usize..3 * node as usize + 3] {
                match &*self.numbers {
                    Numbers::F32(basis) => {
                        for (q, &phi) in q.iter_mut().zip(&basis[row..row + rank]) {
                            *q += phi * u;
                        }
                    }
                    Numbers::F16(basis) => {
                        for (q, phi) in q.iter_mut().zip(&basis[row..row + rank]) {
                            *q += phi.to_f32() * u;
                        }
                    }
                }
                row += rank;
            }
        }
    }
}
