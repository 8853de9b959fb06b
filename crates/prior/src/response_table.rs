//! The response of the contact dofs in block coordinates, `[3D,Q]`: whole, or without the coordinates that a contact node does not reach, which a
//! step does not read then.
//!
//! A force at one node moves its surroundings in many ways and distant blocks in few. So the far
//! blocks of a row hold few numbers or none, and since a step's time is mostly the reading of these
//! rows, what is not stored is time that is not spent.

use half::f16;

use super::numbers::Numbers;
use field::error::Result;
use field::memory::{self, HeldBytes};
use kernels::project::row_dots;
use kernels::ragged::Ragged;
use kernels::respond::accumulate_rows;
use kernels::rows::Stored;
use kernels::{Isa, Pool};

const WHAT: &str = "the linear response";

/// The table.
#[derive(Debug, HeldBytes)]
pub enum Response {
    /// `[3D,Q]`.
    Whole(Numbers),
    /// Of each block the leading coordinates.
    Leading(Leading),
}

/// Rows without their zeros ([`Ragged`]).
#[derive(Debug, HeldBytes)]
pub struct Leading {
    /// The kept numbers, node by node, row by row, block by block.
    values: Numbers,
    /// Where each node's three rows begin in `values`, `[D+1]`.
    starts: Vec<usize>,
    /// Eights of coordinates that a node's rows have of each block, `[D,B]`; the same for all
    /// three.
    kept: Vec<u8>,
    /// Where each block's coordinates begin in `q`, `[B+1]`.
    rank_offsets: Vec<u32>,
}

impl Leading {
    /// As the kernels take it.
    fn table(&self) -> Ragged<'_> {
        Ragged {
            values: self.values.stored(),
            starts: &self.starts,
            kept: &self.kept,
            rank_offsets: &self.rank_offsets,
        }
    }
}

impl Response {
    /// `values` holds of each block the leading `8 kept[node, block]` coordinates, node by node and row by row; `kept` is `[D,B]` and fits the blocks.
    pub(super) fn leading(
        values: Vec<f16>,
        kept: Vec<u8>,
        rank_offsets: &[usize],
    ) -> Result<Response> {
        let blocks = rank_offsets.len() - 1;
        let mut starts = memory::room(kept.len() / blocks.max(1) + 1, WHAT)?;
        let mut at = 0;
        starts.push(at);
        for node in kept.chunks_exact(blocks.max(1)) {
            // Three rows of eights.
            at += 24
                * node
                    .iter()
                    .map(|&eights| usize::from(eights))
                    .sum::<usize>();
            starts.push(at);
        }
        let narrow = rank_offsets.iter().map(|&offset| offset as u32);
        Ok(Response::Leading(Leading {
            values: Numbers::of_f16(values)?,
            starts,
            kept,
            rank_offsets: memory::collected(rank_offsets.len(), narrow, WHAT)?,
        }))
    }

    /// `q += sum_i factors_i response[rows_i]`, or `q = ..` where `add` is false.
    ///
    /// # Errors
    /// A panic on another thread of the pool.
    pub fn accumulate(
        &self,
        isa: Isa,
        pool: &Pool,
        (rows, factors): (&[u32], &[f32]),
        add: bool,
        q: &mut [f32],
    ) -> Result<()> {
        match self {
            Response::Whole(numbers) => {
                accumulate_rows(isa, pool, numbers.stored(), rows, factors, add, q)?;
            }
            Response::Leading(leading) => {
                leading
                    .table()
                    .accumulate(isa, pool, (rows, factors), add, q)?;
            }
        }
        Ok(())
    }

    /// `out[i] = response[rows[i]] . q`.
    ///
    /// # Errors
    /// A panic on another thread of the pool.
    pub fn dots(
        &self,
        isa: Isa,
        pool: &Pool,
        rows: &[u32],
        q: &[f32],
        out: &mut [f32],
    ) -> Result<()> {
        match self {
            Response::Whole(numbers) => row_dots(isa, pool, numbers.stored(), rows, q, out)?,
            Response::Leading(leading) => leading.table().dots(isa, pool, rows, q, out)?,
        }
        Ok(())
    }

    /// The numbers that it holds.
    pub fn stored(&self) -> Stored<'_> {
        match self {
            Response::Whole(numbers) => numbers.stored(),
            Response::Leading(leading) => leading.values.stored(),
        }
    }

    /// Bytes that some rows hold; `width` is `Q`.
    pub fn bytes(&self, rows: &[u32], width: usize) -> usize {
        match self {
            Response::Whole(Numbers::F32(_)) => 4 * rows.len() * width,
            Response::Whole(Numbers::F16(_)) => 2 * rows.len() * width,
            Response::Leading(leading) => leading.table().bytes(rows),
        }
    }

    /// Coordinates `[start, start + rank)` of a node's three rows, those of one block, into `out [3,rank]`; `width` is `Q`.
    pub(super) fn widen(&self, node: usize, width: usize, start: usize, out: &mut [f32]) {
        let rank = out.len() / 3;
        let rows = out.chunks_exact_mut(rank.max(1));
        match self {
            Response::Whole(numbers) => {
                for (axis, out) in rows.enumerate() {
                    numbers.widen((3 * node + axis) * width + start, out);
                }
            }
            Response::Leading(leading) => {
                let offsets = &leading.rank_offsets;
                // The last that starts there: one before it may have no coordinate.
                let block = offsets.partition_point(|&own| own as usize <= start) - 1;
                let blocks = offsets.len() - 1;
                let kept = &leading.kept[node * blocks..][..=block];
                let before = kept[..block].iter().map(|&eights| usize::from(eights));
                let before = 8 * before.sum::<usize>();
                let (from, to) = (leading.starts[node], leading.starts[node + 1]);
                for (axis, out) in rows.enumerate() {
                    let (own, rest) = out.split_at_mut(8 * usize::from(kept[block]));
                    leading
                        .values
                        .widen(from + axis * (to - from) / 3 + before, own);
                    rest.fill(0.0);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_of_a_block_are_those_of_the_whole_table() {
        // Two nodes; blocks of 16, none and 8 coordinates.
        let (offsets, width) = ([0, 16, 16, 24], 24);
        let kept = [[1u8, 0, 1], [2, 0, 0]];
        let (mut values, mut whole) = (Vec::new(), vec![f16::ZERO; 6 * width]);
        for row in 0..6 {
            for (block, &eights) in kept[row / 3].iter().enumerate() {
                for at in offsets[block]..offsets[block] + 8 * usize::from(eights) {
                    let value = f16::from_f32((row * width + at + 1) as f32);
                    values.push(value);
                    whole[row * width + at] = value;
                }
            }
        }
        let whole = Response::Whole(Numbers::of_f16(whole).unwrap());
        let leading = Response::leading(values, kept.as_flattened().to_vec(), &offsets).unwrap();
        for node in 0..2 {
            for (start, rank) in [(0, 16), (16, 8)] {
                let (mut a, mut b) = (vec![f32::NAN; 3 * rank], vec![f32::NAN; 3 * rank]);
                whole.widen(node, width, start, &mut a);
                leading.widen(node, width, start, &mut b);
                assert_eq!(a, b, "node {node}, block at {start}");
            }
        }
        assert_eq!(
            leading.bytes(&[0, 3], width),
            leading.bytes(&[0], width) * 2
        );
    }
}
