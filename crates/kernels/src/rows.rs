//! Decode of the reduced model: `u_row = basis_row . q_k` for the rows of spatial block `k`.
//!
//! Block `k` has nodes `block_nodes[block_offsets[k]..block_offsets[k + 1]]`, a basis
//! `U_k [3 n_k, r_k]` (row-major, row `3 * local + axis`, `r_k` a multiple of 8, f32 or f16) and the
//! part `q[rank_offsets[k]..rank_offsets[k + 1]]` of the coordinates. A [`RowPlan`] lists which
//! nodes are wanted, block by block, and where each goes in the output. Every row is summed in one
//! fixed order, so a region gives the bits of the full decode, for any thread count.

mod some;

use super::parts::Parts;
use super::pool::{Pool, PoolError};
use field::memory::{self, HeldBytes};
use half::f16;
use lanes::DenseLanes;
use lanes::{Isa, by_isa};

pub(super) use some::add_copies;
pub use some::{project_products, project_rows};

/// Numbers stored as f32 or f16.
#[derive(Debug, Clone, Copy)]
pub enum Stored<'a> {
    /// As read, or widened where a machine has no instruction that widens (WebAssembly).
    F32(&'a [f32]),
    /// Half the memory that a step reads; each number is widened exactly when it is loaded.
    F16(&'a [f16]),
}

impl Stored<'_> {
    /// How many numbers.
    pub fn len(&self) -> usize {
        match self {
            Stored::F32(x) => x.len(),
            Stored::F16(x) => x.len(),
        }
    }

    /// Bytes of one.
    pub(super) fn number_bytes(&self) -> usize {
        match self {
            Stored::F32(_) => 4,
            Stored::F16(_) => 2,
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The block-wise basis as stored in `prior.safetensors`.
#[derive(Debug, Clone, Copy)]
pub struct BlockBasis<'a> {
    /// `[K]`: node of each row group, block after block.
    pub block_nodes: &'a [u32],
    /// `[B + 1]` into `block_nodes`.
    pub block_offsets: &'a [u32],
    /// `[B + 1]` into `q`; differences are multiples of 8.
    pub rank_offsets: &'a [u32],
    /// `[sum_k 3 n_k r_k]`.
    pub basis: Stored<'a>,
    /// Of a body that has been cut; none where every node has rows of its own.
    pub copies: Option<Copies<'a>>,
}

/// Copies of nodes have the rows of the node that they stem from. In `block_nodes` they come behind the other nodes of its block.
#[derive(Debug, Clone, Copy)]
pub struct Copies<'a> {
    /// Nodes with rows of their own before each block `[B + 1]`: what `block_offsets` would be without copies.
    pub row_offsets: &'a [u32],
    /// Place in its block of the node whose rows each node of `block_nodes` has.
    pub locals: &'a [u32],
}

impl BlockBasis<'_> {
    /// Nodes of block `k` with rows of their own, the first ones.
    pub(super) fn own_nodes(&self, k: usize) -> usize {
        let offsets = match &self.copies {
            Some(copies) => copies.row_offsets,
            None => self.block_offsets,
        };
        (offsets[k + 1] - offsets[k]) as usize
    }

    /// Where in its block the rows lie of node `local` of block `k`.
    fn row_of(&self, k: usize, local: usize) -> u32 {
        match &self.copies {
            Some(copies) => copies.locals[self.block_offsets[k] as usize + local],
            None => local as u32,
        }
    }
}

/// A run of wanted nodes in one block.
#[derive(Debug, Clone, Copy, HeldBytes)]
struct Run {
    /// All of a run's nodes are of one block, so that they share its coordinates.
    block: u32,
    /// Into `RowPlan::{locals, outputs}`.
    start: u32,
    end: u32,
}

/// Which nodes to decode: made once a region, read each step.
#[derive(Debug, Clone, Default, HeldBytes)]
pub struct RowPlan {
    /// In the order of the blocks, each of [`RUN_NODES`] nodes at most.
    runs: Vec<Run>,
    /// Node's place in its block.
    locals: Vec<u32>,
    /// Node's row in the output.
    outputs: Vec<u32>,
    /// Of each output row of a refilled plan: the node's block, and its place there.
    places: Vec<[u32; 2]>,
    /// Start of each block's basis; `[B + 1]`.
    basis_offsets: Vec<usize>,
    /// Rows of the output that [`decode_rows`] takes.
    output_rows: usize,
}

/// Nodes a run at most: a chunk of work for one thread. With fewer the counter of the pool would be
/// asked more often, with more a large block would be one thread's work alone.
const RUN_NODES: usize = 128;

impl RowPlan {
    /// All nodes, node `i` to row `i` of an output `[K,3]`.
    ///
    /// # Panics
    /// As [`RowPlan::region`].
    pub fn full(basis: &BlockBasis<'_>) -> Self {
        Self::region(
            basis,
            &(0..basis.block_nodes.len() as u32).collect::<Vec<_>>(),
            false,
        )
    }

    /// The nodes of a list (no node twice). `compact`: node `nodes[i]` goes to row `i` of an output
    /// `[nodes,3]`; else to row `nodes[i]` of an output `[K,3]`.
    ///
    /// # Panics
    /// If a node is not in the basis or the offsets do not fit the basis (a bundle's loader checks).
    pub fn region(basis: &BlockBasis<'_>, nodes: &[u32], compact: bool) -> Self {
        Self::try_region(basis, nodes, compact).expect("memory for a plan of rows")
    }

    /// As [`RowPlan::region`].
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    ///
    /// # Panics
    /// As [`RowPlan::region`].
    pub fn try_region(
        basis: &BlockBasis<'_>,
        nodes: &[u32],
        compact: bool,
    ) -> field::error::Result<Self> {
        const WHAT: &str = "a plan of decoded rows";
        let node_count = basis.block_nodes.len();
        let blocks = basis.block_offsets.len();
        let mut basis_offsets = memory::room(blocks, WHAT)?;
        basis_offsets.push(0);
        for k in 0..basis.block_offsets.len() - 1 {
            let n = basis.own_nodes(k);
            let rank = (basis.rank_offsets[k + 1] - basis.rank_offsets[k]) as usize;
            assert!(
                rank.is_multiple_of(8),
                "rank of block {k} must be a multiple of 8"
            );
            basis_offsets.push(basis_offsets[k] + 3 * n * rank);
        }
        assert_eq!(
            basis.basis.len(),
            basis_offsets[basis_offsets.len() - 1],
            "basis length"
        );
        let mut row_of_node = memory::filled(node_count, u32::MAX, WHAT)?;
        for (i, &node) in nodes.iter().enumerate() {
            row_of_node[node as usize] = if compact { i as u32 } else { node };
        }
        let mut plan = Self {
            basis_offsets,
            output_rows: if compact { nodes.len() } else { node_count },
            runs: memory::room(blocks + nodes.len() / RUN_NODES, WHAT)?,
            locals: memory::room(nodes.len(), WHAT)?,
            outputs: memory::room(nodes.len(), WHAT)?,
            places: Vec::new(),
        };
        for k in 0..basis.block_offsets.len() - 1 {
            let range = basis.block_offsets[k] as usize..basis.block_offsets[k + 1] as usize;
            let mut start = plan.locals.len();
            for (local, &node) in basis.block_nodes[range].iter().enumerate() {
                let row = row_of_node[node as usize];
                if row == u32::MAX {
                    continue;
                }
                plan.locals.push(basis.row_of(k, local));
                plan.outputs.push(row);
                if plan.locals.len() - start == RUN_NODES {
                    plan.end_run(k, &mut start);
                }
            }
            plan.end_run(k, &mut start);
        }
        assert_eq!(
            plan.locals.len(),
            nodes.len(),
            "a node of the list is unknown or twice in it"
        );
        Ok(plan)
    }

    /// Ends the run of a block that began at `start`, if it has nodes, and begins the next one there. A run never spans two
    /// blocks, so all its rows have one rank.
    fn end_run(&mut self, block: usize, start: &mut usize) {
        if self.locals.len() > *start {
            self.runs.push(Run {
                block: block as u32,
                start: *start as u32,
                end: self.locals.len() as u32,
            });
            *start = self.locals.len();
        }
    }

    /// Nodes decoded.
    pub fn nodes(&self) -> usize {
        self.locals.len()
    }

    /// Rows of the output: K, or the list's length where the plan is compact.
    pub fn output_rows(&self) -> usize {
        self.output_rows
    }
}

/// Writes `u_node = U_k[node] q_k` for the plan's nodes; other rows of `out` keep their values.
///
/// `q [Q]`, `out [output_rows,3]`.
///
/// # Errors
/// [`PoolError`] where a worker failed.
///
/// # Panics
/// If `basis` is not the one the plan was made for, or `q` or `out` have another length.
pub fn decode_rows(
    isa: Isa,
    pool: &Pool,
    basis: &BlockBasis<'_>,
    plan: &RowPlan,
    q: &[f32],
    out: &mut [f32],
) -> Result<(), PoolError> {
    let ranks = basis.rank_offsets;
    assert_eq!(
        ranks.len(),
        plan.basis_offsets.len(),
        "plan of another basis"
    );
    assert_eq!(
        basis.basis.len(),
        plan.basis_offsets[ranks.len() - 1],
        "plan of another basis"
    );
    assert_eq!(q.len(), ranks[ranks.len() - 1] as usize, "q must be [Q]");
    assert_eq!(out.len(), 3 * plan.output_rows, "out must be [rows, 3]");
    // Bound by memory, and ranks are multiples of 8: 256 bits measure as fast as 512 and leave no tail.
    let isa = if isa == Isa::Avx512 { Isa::Avx2 } else { isa };
    let parts = Parts::new(out);
    let all = basis.basis.len() * basis.basis.number_bytes();
    let bytes = all / basis.block_nodes.len().max(1) * plan.nodes();
    pool.run_streaming(bytes, plan.runs.len(), &|chunk, _| {
        let run = plan.runs[chunk];
        let (k, items) = (run.block as usize, run.start as usize..run.end as usize);
        let q = &q[ranks[k] as usize..ranks[k + 1] as usize];
        let range = plan.basis_offsets[k]..plan.basis_offsets[k + 1];
        let (locals, outputs) = (&plan.locals[items.clone()], &plan.outputs[items]);
        match basis.basis {
            Stored::F32(basis) => nodes_f32(isa, &basis[range], q, locals, outputs, &parts),
            Stored::F16(basis) => nodes_f16(isa, &basis[range], q, locals, outputs, &parts),
        }
    })
}

/// A stored number that registers can be filled from.
pub(super) trait Number: Copy {
    /// The number as f32, without rounding.
    fn wide(self) -> f32;
    /// `N` numbers.
    unsafe fn lanes<V: DenseLanes>(from: *const Self) -> V;
}
impl Number for f32 {
    fn wide(self) -> f32 {
        self
    }
    #[inline(always)]
    unsafe fn lanes<V: DenseLanes>(from: *const Self) -> V {
        // SAFETY: the caller's.
        unsafe { V::load(from) }
    }
}
impl Number for f16 {
    fn wide(self) -> f32 {
        self.to_f32()
    }
    #[inline(always)]
    unsafe fn lanes<V: DenseLanes>(from: *const Self) -> V {
        // SAFETY: the caller's.
        unsafe { V::load_f16(from) }
    }
}

/// The rows of a block's nodes one after another, in plain Rust: `basis` and `q` are those of the block, `[3 n_k,r_k]` and
/// `[r_k]`.
fn nodes_scalar<T: Number>(
    basis: &[T],
    q: &[f32],
    locals: &[u32],
    outputs: &[u32],
    out: &Parts<f32>,
) {
    let rank = q.len();
    for (&local, &output) in locals.iter().zip(outputs) {
        for axis in 0..3 {
            let row = &basis[(3 * local as usize + axis) * rank..][..rank];
            let u = row.iter().zip(q).map(|(b, q)| b.wide() * q).sum();
            // SAFETY: a plan names each output row once.
            unsafe { out.write(3 * output as usize + axis, u) };
        }
    }
}

by_isa! {
    fn nodes_f32(basis: &[f32], q: &[f32], locals: &[u32], outputs: &[u32], out: &Parts<f32>) = nodes_body, nodes_scalar;
}
by_isa! {
    fn nodes_f16(basis: &[f16], q: &[f32], locals: &[u32], outputs: &[u32], out: &Parts<f32>) = nodes_body, nodes_scalar;
}

/// Four nodes, twelve rows at a time; a short last group repeats its last node.
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn nodes_body<V: DenseLanes>(
    basis: &[impl Number],
    q: &[f32],
    locals: &[u32],
    outputs: &[u32],
    out: &Parts<f32>,
) {
    let rank = q.len();
    let highest = locals.iter().copied().max().unwrap_or(0) as usize;
    assert!(
        (3 * highest + 3) * rank <= basis.len(),
        "node outside its block"
    );
    assert!(
        rank.is_multiple_of(V::COUNT),
        "rank must be whole registers"
    );
    for (locals, outputs) in locals.chunks(4).zip(outputs.chunks(4)) {
        // SAFETY: rows are inside `basis` by the check above; a plan names each output row once.
        unsafe {
            let node = |i: usize| {
                let local = locals[i.min(locals.len() - 1)] as usize;
                basis.as_ptr().add(3 * local * rank)
            };
            let nodes = [node(0), node(1), node(2), node(3)];
            let mut sums = [[V::splat(0.0); 4]; 3];
            let mut column = 0;
            while column < rank {
                let q = V::load(q.as_ptr().add(column));
                for axis in 0..3 {
                    for i in 0..4 {
                        let row = Number::lanes::<V>(nodes[i].add(axis * rank + column));
                        sums[axis][i] = row.mul_add(q, sums[axis][i]);
                    }
                }
                column += V::COUNT;
            }
            for axis in 0..3 {
                let u = V::sums(sums[axis]);
                for (&output, u) in outputs.iter().zip(u) {
                    out.write(3 * output as usize + axis, u);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
