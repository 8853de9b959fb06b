//! Rows of some nodes that change from call to call: a plan filled anew in the room that it has, and the projection of a field at its nodes.

use half::f16;
use lanes::{DenseLanes, Isa, by_isa};

use super::{BlockBasis, Number, RUN_NODES, RowPlan, Stored};
use field::memory;

impl RowPlan {
    /// Takes other nodes in place of the plan's: those of which `row_of` has an output row, of `rows` in all. The room stays.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn refill(
        &mut self,
        basis: &BlockBasis<'_>,
        rows: usize,
        row_of: impl Fn(u32) -> Option<u32>,
    ) -> field::error::Result<()> {
        const WHAT: &str = "a plan of decoded rows";
        self.runs.clear();
        self.locals.clear();
        self.outputs.clear();
        self.output_rows = rows;
        // Room for all rows at once, so that a plan of the same size later asks for no memory.
        memory::fit(&mut self.locals, rows, WHAT)?;
        memory::fit(&mut self.outputs, rows, WHAT)?;
        self.places.clear();
        memory::fit(&mut self.places, rows, WHAT)?;
        self.places.resize(rows, [0; 2]);
        // Each block ends a run, and each full run begins another.
        let blocks = basis.block_offsets.len() - 1;
        memory::fit(&mut self.runs, blocks + rows / RUN_NODES, WHAT)?;
        for k in 0..blocks {
            let range = basis.block_offsets[k] as usize..basis.block_offsets[k + 1] as usize;
            let mut start = self.locals.len();
            for (local, &node) in basis.block_nodes[range].iter().enumerate() {
                if let Some(row) = row_of(node) {
                    let local = basis.row_of(k, local);
                    self.locals.push(local);
                    self.outputs.push(row);
                    self.places[row as usize] = [k as u32, local];
                    if self.locals.len() - start == RUN_NODES {
                        self.end_run(k, &mut start);
                    }
                }
            }
            self.end_run(k, &mut start);
        }
        Ok(())
    }

    /// The block of an output row of a refilled plan.
    pub fn block_of(&self, row: u32) -> usize {
        self.places[row as usize][0] as usize
    }

    /// The blocks that the plan's nodes are of, ascending.
    pub fn blocks(&self) -> impl Iterator<Item = usize> + '_ {
        let mut last = u32::MAX;
        let own = self.runs.iter().map(|run| run.block);
        own.filter(move |&block| std::mem::replace(&mut last, block) != block)
            .map(|block| block as usize)
    }
}

/// `q += U^T r` of a field at the plan's nodes alone, `r` by output row `[rows,3]`; only the coordinates of their blocks change.
///
/// # Panics
/// If a length does not match the plan.
pub fn project_rows(isa: Isa, basis: &BlockBasis<'_>, plan: &RowPlan, r: &[f32], q: &mut [f32]) {
    let ranks = basis.rank_offsets;
    assert_eq!(q.len(), ranks[ranks.len() - 1] as usize, "q must be [Q]");
    assert_eq!(r.len(), 3 * plan.output_rows, "r must be [rows, 3]");
    // Ranks are multiples of eight and not of sixteen.
    let isa = if isa == Isa::Avx512 { Isa::Avx2 } else { isa };
    for run in &plan.runs {
        let (k, items) = (run.block as usize, run.start as usize..run.end as usize);
        let q = &mut q[ranks[k] as usize..ranks[k + 1] as usize];
        let range = plan.basis_offsets[k]..plan.basis_offsets[k + 1];
        let (locals, outputs) = (&plan.locals[items.clone()], &plan.outputs[items]);
        // Fields of a few nodes are nothing in most blocks.
        if outputs
            .iter()
            .all(|&row| r[3 * row as usize..][..3] == [0.0; 3])
        {
            continue;
        }
        match basis.basis {
            Stored::F32(basis) => add_f32(isa, &basis[range], locals, outputs, r, q),
            Stored::F16(basis) => add_f16(isa, &basis[range], locals, outputs, r, q),
        }
    }
}

/// `q += U^T r` for the nine fields `r = e_i w_j` of some rows of a refilled plan, each with a vector `w`: `q [9,Q]`, field `3 i + j`.
///
/// # Panics
/// If a length does not match the plan.
pub fn project_products(
    isa: Isa,
    basis: &BlockBasis<'_>,
    plan: &RowPlan,
    of_rows: &[(u32, [f32; 3])],
    q: &mut [f32],
) {
    let ranks = basis.rank_offsets;
    assert_eq!(
        q.len(),
        9 * ranks[ranks.len() - 1] as usize,
        "q must be [9,Q]"
    );
    let isa = if isa == Isa::Avx512 { Isa::Avx2 } else { isa };
    // By row and not by run: a few rows are looked up where they lie.
    let table = (plan.places.as_slice(), plan.basis_offsets.as_slice());
    match basis.basis {
        Stored::F32(basis) => products_f32(isa, basis, table, ranks, of_rows, q),
        Stored::F16(basis) => products_f16(isa, basis, table, ranks, of_rows, q),
    }
}

by_isa! {
    fn products_f32(basis: &[f32], table: (&[[u32; 2]], &[usize]), ranks: &[u32], of_rows: &[(u32, [f32; 3])], q: &mut [f32]) = products_body, products_scalar;
}
by_isa! {
    fn products_f16(basis: &[f16], table: (&[[u32; 2]], &[usize]), ranks: &[u32], of_rows: &[(u32, [f32; 3])], q: &mut [f32]) = products_body, products_scalar;
}

/// Of [`project_products`], in plain Rust.
fn products_scalar<T: Number>(
    basis: &[T],
    table: (&[[u32; 2]], &[usize]),
    ranks: &[u32],
    of_rows: &[(u32, [f32; 3])],
    q: &mut [f32],
) {
    each_product(basis, table, ranks, of_rows, q, |row, w, q| {
        for (q, b) in q.iter_mut().zip(row) {
            *q += w * b.wide();
        }
    });
}

/// The same a register at a time. Each coordinate is added to once for each row and component, in the order of `of_rows`,
/// as in the scalar way; no two lanes meet.
///
/// # Safety
/// The instruction set of `V` is there; lengths are checked.
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn products_body<V: DenseLanes>(
    basis: &[impl Number],
    table: (&[[u32; 2]], &[usize]),
    ranks: &[u32],
    of_rows: &[(u32, [f32; 3])],
    q: &mut [f32],
) {
    each_product(
        basis,
        table,
        ranks,
        of_rows,
        q,
        #[inline(always)]
        |row, w, q| {
            assert!(
                row.len().is_multiple_of(V::COUNT),
                "rank must be whole registers"
            );
            for (q, row) in q.chunks_exact_mut(V::COUNT).zip(row.chunks_exact(V::COUNT)) {
                // SAFETY: both are as long as a register.
                unsafe {
                    let (from, to) = (row.as_ptr(), q.as_mut_ptr());
                    let sum = Number::lanes::<V>(from).mul_add(V::splat(w), V::load(to));
                    sum.store(to);
                }
            }
        },
    );
}

/// Calls with each row of the basis, each component of its vector and the coordinates that their product goes to.
///
/// The field `e_i w_j` of a row is zero but for component `i`, so that each of the nine takes one
/// row of the basis times one number: `3 i + j` names the field, and three fields share a row while
/// it is in the cache.
#[inline(always)]
fn each_product<T: Number>(
    basis: &[T],
    (places, starts): (&[[u32; 2]], &[usize]),
    ranks: &[u32],
    of_rows: &[(u32, [f32; 3])],
    q: &mut [f32],
    mut take: impl FnMut(&[T], f32, &mut [f32]),
) {
    let all = q.len() / 9;
    for (row, vector) in of_rows {
        let [block, local] = places[*row as usize].map(|at| at as usize);
        let [start, end] = [ranks[block], ranks[block + 1]].map(|at| at as usize);
        let rank = end - start;
        for i in 0..3 {
            let row = &basis[starts[block] + (3 * local + i) * rank..][..rank];
            for (j, w) in vector.iter().enumerate() {
                take(row, *w, &mut q[(3 * i + j) * all + start..][..rank]);
            }
        }
    }
}

/// `q += U^T r` of the copies of nodes in block `k`, whose rows lie at `rows`; `r` by node.
///
/// Behind a block's own nodes its list has the copies that cuts have made of them; a copy moves as
/// its parent does, so its force counts on the parent's row. Own nodes come first and copies after
/// them: the order of a sum decides its bits.
pub(crate) fn add_copies(
    isa: Isa,
    basis: &BlockBasis<'_>,
    k: usize,
    rows: std::ops::Range<usize>,
    r: &[f32],
    q: &mut [f32],
) {
    let Some(copies) = &basis.copies else {
        return;
    };
    let start = basis.block_offsets[k] as usize + basis.own_nodes(k);
    let all = start..basis.block_offsets[k + 1] as usize;
    let (locals, nodes) = (&copies.locals[all.clone()], &basis.block_nodes[all]);
    match basis.basis {
        Stored::F32(basis) => add_f32(isa, &basis[rows], locals, nodes, r, q),
        Stored::F16(basis) => add_f16(isa, &basis[rows], locals, nodes, r, q),
    }
}

by_isa! {
    fn add_f32(basis: &[f32], locals: &[u32], outputs: &[u32], r: &[f32], q: &mut [f32]) = add_rows_body, add_rows_scalar;
}
by_isa! {
    fn add_f16(basis: &[f16], locals: &[u32], outputs: &[u32], r: &[f32], q: &mut [f32]) = add_rows_body, add_rows_scalar;
}

/// `q += U^T r` of some nodes of one block: `basis [3 n,rank]`, `q [rank]`, node `locals[i]` of the block with the field's
/// row `outputs[i]`.
fn add_rows_scalar<T: Number>(
    basis: &[T],
    locals: &[u32],
    outputs: &[u32],
    r: &[f32],
    q: &mut [f32],
) {
    let rank = q.len();
    for (&local, &output) in locals.iter().zip(outputs) {
        for axis in 0..3 {
            let force = r[3 * output as usize + axis];
            let row = &basis[(3 * local as usize + axis) * rank..][..rank];
            for (q, b) in q.iter_mut().zip(row) {
                *q += force * b.wide();
            }
        }
    }
}

/// The same by strips of up to eight registers of coordinates, which stay in registers while all nodes pass: each number of
/// the basis is read once, and `q` is read and written once. A coordinate adds its nodes up in the order of the list.
///
/// # Safety
/// The instruction set of `V` is there; the highest node and the rank are checked here.
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn add_rows_body<V: DenseLanes>(
    basis: &[impl Number],
    locals: &[u32],
    outputs: &[u32],
    r: &[f32],
    q: &mut [f32],
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
    let mut column = 0;
    while column < rank {
        let registers = ((rank - column) / V::COUNT).min(8);
        // SAFETY: rows end below `highest`, columns below the rank.
        unsafe {
            let (from, to) = (basis.as_ptr().add(column), &mut q[column..]);
            match registers {
                8 => add_tile::<V, 8>(from, rank, locals, outputs, r, to),
                7 => add_tile::<V, 7>(from, rank, locals, outputs, r, to),
                6 => add_tile::<V, 6>(from, rank, locals, outputs, r, to),
                5 => add_tile::<V, 5>(from, rank, locals, outputs, r, to),
                4 => add_tile::<V, 4>(from, rank, locals, outputs, r, to),
                3 => add_tile::<V, 3>(from, rank, locals, outputs, r, to),
                2 => add_tile::<V, 2>(from, rank, locals, outputs, r, to),
                _ => add_tile::<V, 1>(from, rank, locals, outputs, r, to),
            }
        }
        column += registers * V::COUNT;
    }
}

/// `M` registers of [`add_rows_body`].
#[inline(always)]
unsafe fn add_tile<V: DenseLanes, const M: usize>(
    basis: *const impl Number,
    rank: usize,
    locals: &[u32],
    outputs: &[u32],
    r: &[f32],
    q: &mut [f32],
) {
    // SAFETY: the caller's.
    unsafe {
        let mut sum = [V::splat(0.0); M];
        for v in 0..M {
            sum[v] = V::load(q.as_ptr().add(v * V::COUNT));
        }
        for (&local, &output) in locals.iter().zip(outputs) {
            let mut row = basis.wrapping_add(3 * local as usize * rank);
            let forces = &r[3 * output as usize..3 * output as usize + 3];
            // Its products would add zeros, and a residual near tools is zero at most nodes.
            if *forces == [0.0; 3] {
                continue;
            }
            for &force in forces {
                let force = V::splat(force);
                for v in 0..M {
                    sum[v] = Number::lanes::<V>(row.add(v * V::COUNT)).mul_add(force, sum[v]);
                }
                row = row.wrapping_add(rank);
            }
        }
        for v in 0..M {
            sum[v].store(q.as_mut_ptr().add(v * V::COUNT));
        }
    }
}
