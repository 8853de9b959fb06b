//! The mutual compliance `A [3D,3D]` (mm/mN) of the contact degrees of freedom, whole or compressed.
//!
//! Whole it grows with the square of the domain: 15 MB for 639 contact nodes, 221 MB for 2,476. Compressed it is stored for
//! neighbours only; what lies farther apart is smooth and comes out of the linear response itself, `A_ij = U_i response[j]` with
//! the rows `U_i` of node `i` in the bases of its block (low rank).
//!
//! Why neighbours are exact: bases of low rank show what is smooth, and the dent right below a
//! force is the sharpest that there is.

use super::numbers::Numbers;
use super::response_table::Response;
use bundle::TensorFile;
use field::error::Result;
use field::memory::{self, HeldBytes};

/// Where the entries come from.
#[derive(Debug, HeldBytes)]
pub enum Compliance {
    /// `[3D,3D]`.
    Whole(Vec<f32>),
    /// Neighbours exact, the rest from the response.
    Near(Near),
}

/// Blocks of neighbouring contact nodes, upper triangle.
#[derive(Debug, HeldBytes)]
pub struct Near {
    /// Row starts in `nodes` `[D+1]`.
    offsets: Vec<u32>,
    /// Index of each neighbour, from the node itself up, ascending.
    nodes: Vec<u32>,
    /// `[3,3]` a neighbour: row is the axis of the row's node.
    blocks: Vec<[f32; 9]>,
    /// By contact node: first element of its three rows in the basis.
    rows: Vec<u32>,
    /// By contact node: where the coordinates of its block start, and how many.
    ranks: Vec<(u32, u32)>,
}

/// Columns that have the response of others: those of a body that has been cut.
#[derive(Clone, Copy)]
pub struct Borrowed<'a> {
    /// Of each of the columns behind the table's own: the one whose response it has.
    pub sources: &'a [u32],
    /// By column behind the table's own: where the rows of its node in the basis start, where its block's coordinates start, and how many.
    pub places: &'a dyn Fn(usize) -> (u32, u32, u32),
}

/// The tables that far entries come from.
#[derive(Debug, Clone, Copy)]
pub struct Bases<'a> {
    /// `U_k`, block after block.
    pub basis: &'a Numbers,
    /// `[3D,Q]`.
    pub response: &'a Response,
    /// `Q`.
    pub width: usize,
}

/// `a . b`, in so many sums at once that no processor waits for one.
/// Eight sums in a fixed order: the bits do not depend on what the compiler makes of them.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 8;
    let (wide_a, rest_a) = a.as_chunks::<LANES>();
    let (wide_b, rest_b) = b[..a.len()].as_chunks::<LANES>();
    let mut lanes = [0.0f32; LANES];
    for (a, b) in wide_a.iter().zip(wide_b) {
        for ((sum, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    lanes.iter().sum::<f32>() + rest
}

impl Compliance {
    /// Reads `compliance`, or `near_offsets`, `near_nodes` and `near_compliance`, for `count` contact nodes.
    ///
    /// `place(i)` gives for contact node `i` where its rows in the basis start, where its block's coordinates start, and how many.
    pub fn read(
        file: &TensorFile,
        count: usize,
        place: impl Fn(usize) -> (u32, u32, u32),
    ) -> Result<Compliance> {
        if !file.has("near_compliance") {
            let whole = file.f32("compliance", &[Some(3 * count), Some(3 * count)])?;
            if let Some(at) = (0..3 * count).find(|&i| whole[i * (3 * count + 1)] <= 0.0) {
                return Err(file.bad(
                    "compliance",
                    format!("diagonal element {at} is not positive"),
                ));
            }
            return Ok(Compliance::Whole(whole));
        }
        let values = file.f32("near_compliance", &[None, Some(9)])?;
        let nodes = file.indices("near_nodes", &[Some(values.len() / 9)], count)?;
        let offsets = file.offsets("near_offsets", nodes.len())?;
        if offsets.len() != count + 1 || offsets.last() != Some(&nodes.len()) {
            return Err(file.bad(
                "near_offsets",
                format!(
                    "must have {} elements and end with {}",
                    count + 1,
                    nodes.len()
                ),
            ));
        }
        let blocks = values
            .chunks_exact(9)
            .map(|block| std::array::from_fn(|at| block[at]));
        let blocks: Vec<[f32; 9]> = memory::collected(values.len() / 9, blocks, "near_compliance")?;
        for (row, range) in offsets.windows(2).enumerate() {
            let own = &nodes[range[0]..range[1]];
            if own.first() != Some(&(row as u32)) || own.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(file.bad(
                    "near_nodes",
                    format!("row {row} must begin with {row} and ascend"),
                ));
            }
            if let Some(axis) = (0..3).find(|axis| blocks[range[0]][4 * axis] <= 0.0) {
                return Err(file.bad(
                    "near_compliance",
                    format!("diagonal element {} is not positive", 3 * row + axis),
                ));
            }
        }
        const WHAT: &str = "near_compliance";
        let narrow = offsets.iter().map(|&value| value as u32);
        let ranks = (0..count).map(&place).map(|place| (place.1, place.2));
        Ok(Compliance::Near(Near {
            offsets: memory::collected(offsets.len(), narrow, WHAT)?,
            nodes,
            blocks,
            rows: memory::collected(count, (0..count).map(|at| place(at).0), WHAT)?,
            ranks: memory::collected(count, ranks, WHAT)?,
        }))
    }

    /// As [`Compliance::gather`], with columns behind the table's own.
    /// A borrowed column is known by its source's response and by its own node's rows of the basis.
    pub fn gather_borrowed<T: From<f32>>(
        &self,
        bases: Bases<'_>,
        borrowed: Borrowed<'_>,
        (columns, known): (&[u32], &[bool]),
        upper: &mut [T],
        scratch: &mut Vec<f32>,
    ) {
        let order = 3 * columns.len();
        // Contact nodes of the table; columns beyond belong to copies of nodes that a cut has made.
        let own = match self {
            Compliance::Whole(whole) => whole.len().isqrt() / 3,
            Compliance::Near(near) => near.ranks.len(),
        };
        let source = |column: u32| match (column as usize).checked_sub(own) {
            Some(behind) => borrowed.sources[behind] as usize,
            None => column as usize,
        };
        for (i, &column) in columns.iter().enumerate() {
            for (j, &other) in columns.iter().enumerate().skip(i) {
                if are_known(known, i, j) {
                    continue;
                }
                let (row, across) = (source(column), source(other));
                // A whole table has no rows of a copy; its source's are taken for both.
                let block = match self {
                    Compliance::Whole(whole) => std::array::from_fn(|at| {
                        whole[(3 * row + at / 3) * 3 * own + 3 * across + at % 3]
                    }),
                    Compliance::Near(near) => {
                        let place = match (column as usize) < own {
                            true => {
                                let (start, rank) = near.ranks[row];
                                (near.rows[row], start, rank)
                            }
                            false => (borrowed.places)(column as usize - own),
                        };
                        near.block(row, across)
                            .unwrap_or_else(|| far_block(bases, place, across, scratch))
                    }
                };
                for (at, &value) in block.iter().enumerate() {
                    upper[(3 * i + at / 3) * order + 3 * j + at % 3] = T::from(value);
                }
            }
        }
    }

    /// Writes the upper triangle of the block of contact nodes `columns` (ascending), `[3m,3m]` row-major, into `upper`; where two columns
    /// are both `known` it leaves what is there. No list of them: none is.
    ///
    /// `scratch` is kept between calls and grows to six rows of the widest block's rank.
    pub fn gather<T: From<f32>>(
        &self,
        bases: Bases<'_>,
        (columns, known): (&[u32], &[bool]),
        upper: &mut [T],
        scratch: &mut Vec<f32>,
    ) {
        let order = 3 * columns.len();
        match self {
            Compliance::Whole(whole) => {
                let n = whole.len().isqrt();
                for (i, &node) in columns.iter().enumerate() {
                    for axis in 0..3 {
                        let from = &whole[(3 * node as usize + axis) * n..][..n];
                        let to = &mut upper[(3 * i + axis) * order..][..order];
                        let blocks = to.chunks_exact_mut(3).zip(columns).enumerate();
                        for (j, (to, &other)) in blocks.skip(i) {
                            if are_known(known, i, j) {
                                continue;
                            }
                            let from = &from[3 * other as usize..][..3];
                            to[0] = T::from(from[0]);
                            to[1] = T::from(from[1]);
                            to[2] = T::from(from[2]);
                        }
                    }
                }
            }
            Compliance::Near(near) => near.gather(bases, (columns, known), upper, scratch),
        }
    }
}

/// Whether the block of columns `i` and `j` stands in `upper` already: both are columns that an earlier gather had.
fn are_known(known: &[bool], i: usize, j: usize) -> bool {
    !known.is_empty() && known[i] && known[j]
}

/// `U_i response[j]`: of a node by where its rows and coordinates are, and of a column.
fn far_block(
    bases: Bases<'_>,
    (row, start, rank): (u32, u32, u32),
    other: usize,
    scratch: &mut Vec<f32>,
) -> [f32; 9] {
    let (start, rank) = (start as usize, rank as usize);
    if scratch.len() < 6 * rank {
        scratch.resize(6 * rank, 0.0);
    }
    let (rows, forces) = scratch[..6 * rank].split_at_mut(3 * rank);
    bases.basis.widen(row as usize, rows);
    bases.response.widen(other, bases.width, start, forces);
    std::array::from_fn(|at| {
        dot(
            &rows[at / 3 * rank..][..rank],
            &forces[at % 3 * rank..][..rank],
        )
    })
}

impl Near {
    /// The stored block of two contact nodes, where they are neighbours.
    fn block(&self, row: usize, across: usize) -> Option<[f32; 9]> {
        // Blocks lie in the upper triangle; below it they are turned.
        let (low, high) = (row.min(across), row.max(across));
        let range = self.offsets[low] as usize..self.offsets[low + 1] as usize;
        let at = self.nodes[range.clone()]
            .binary_search(&(high as u32))
            .ok()?;
        let block = self.blocks[range.start + at];
        Some(match row <= across {
            true => block,
            false => std::array::from_fn(|k| block[k % 3 * 3 + k / 3]),
        })
    }

    /// As [`Compliance::gather`]: stored neighbours as they are, and other pairs as [`far_block`] has them.
    fn gather<T: From<f32>>(
        &self,
        bases: Bases<'_>,
        (columns, known): (&[u32], &[bool]),
        upper: &mut [T],
        scratch: &mut Vec<f32>,
    ) {
        let order = 3 * columns.len();
        for (i, &node) in columns.iter().enumerate() {
            let node = node as usize;
            let range = self.offsets[node] as usize..self.offsets[node + 1] as usize;
            let (start, rank) = (self.ranks[node].0 as usize, self.ranks[node].1 as usize);
            if scratch.len() < 6 * rank {
                scratch.resize(6 * rank, 0.0);
            }
            let (rows, forces) = scratch[..6 * rank].split_at_mut(3 * rank);
            // The node's rows of the basis are widened once, and only if one of its columns is far.
            let mut widened = false;
            // Columns and neighbours both ascend: one pass over the two.
            let mut next = range.start;
            for (j, &other) in columns.iter().enumerate().skip(i) {
                if are_known(known, i, j) {
                    continue;
                }
                while next < range.end && self.nodes[next] < other {
                    next += 1;
                }
                let mut block = [0.0f32; 9];
                if next < range.end && self.nodes[next] == other {
                    block = self.blocks[next];
                } else {
                    if !std::mem::replace(&mut widened, true) {
                        bases.basis.widen(self.rows[node] as usize, rows);
                    }
                    let other = other as usize;
                    bases.response.widen(other, bases.width, start, forces);
                    for (at, value) in block.iter_mut().enumerate() {
                        *value = dot(
                            &rows[at / 3 * rank..][..rank],
                            &forces[at % 3 * rank..][..rank],
                        );
                    }
                }
                for (at, &value) in block.iter().enumerate() {
                    upper[(3 * i + at / 3) * order + 3 * j + at % 3] = T::from(value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use half::f16;

    /// Four contact nodes in two blocks of rank 8; nodes 0, 1 and 2, 3 are neighbours.
    fn near() -> Compliance {
        let block = |value: f32| std::array::from_fn(|at| if at % 4 == 0 { value } else { 0.125 });
        Compliance::Near(Near {
            offsets: vec![0, 2, 3, 5, 6],
            nodes: vec![0, 1, 1, 2, 3, 3],
            blocks: [4.0, 2.0, 5.0, 6.0, 3.0, 7.0].map(block).to_vec(),
            rows: vec![0, 24, 48, 72],
            ranks: vec![(0, 8), (0, 8), (8, 8), (8, 8)],
        })
    }

    fn numbers(count: usize, half: bool) -> Numbers {
        let value = |at: usize| ((at * 37) % 17) as f32 / 16.0 - 0.5;
        if half {
            Numbers::F16((0..count).map(|at| f16::from_f32(value(at))).collect())
        } else {
            Numbers::F32((0..count).map(value).collect())
        }
    }

    #[test]
    fn neighbours_are_stored_and_the_rest_comes_from_the_response() {
        for half in [false, true] {
            let (basis, response) = (numbers(96, half), numbers(12 * 16, half));
            let whole = Response::Whole(response.clone());
            let bases = Bases {
                basis: &basis,
                response: &whole,
                width: 16,
            };
            let columns = [0, 2, 3];
            let mut upper = vec![f64::NAN; 81];
            near().gather(bases, (&columns, &[]), &mut upper, &mut Vec::new());
            assert_eq!((upper[0], upper[1], upper[10]), (4.0, 0.125, 4.0));
            assert_eq!(upper[3 * 9 + 6], 3.0, "nodes 2 and 3");
            for (axis, other) in [(0, 1), (2, 2)] {
                for force in 0..3 {
                    let wanted: f32 = (0..8)
                        .map(|k| {
                            basis.at(axis * 8 + k)
                                * response.at((3 * columns[other] as usize + force) * 16 + k)
                        })
                        .sum();
                    let found = upper[axis * 9 + 3 * other + force];
                    assert!(
                        (found - f64::from(wanted)).abs() < 1e-6,
                        "{found}, {wanted}"
                    );
                }
            }
        }
    }
}
