//! The transposed products of a block-wise basis: `q = U^T r` of a field, and inner products of table rows with `q`.
//!
//! What [`super::rows`] and [`super::respond`] are to a step's prediction, these are to its corrections: forces on nodes become
//! forces on coordinates.

use super::parts::Parts;
use super::pool::{Pool, PoolError};
use super::rows::{BlockBasis, Number, Stored, add_copies};
use half::f16;
use lanes::DenseLanes;
use lanes::{Isa, by_isa};

mod ranges;

pub use ranges::row_dots_in;

/// `q = U^T r`: `r [K,3]`, `q [Q]`.
///
/// # Errors
/// [`PoolError`] where a worker failed.
///
/// # Panics
/// If a length does not fit the basis.
pub fn project_field(
    isa: Isa,
    pool: &Pool,
    basis: &BlockBasis<'_>,
    starts: &[usize],
    r: &[f32],
    q: &mut [f32],
) -> Result<(), PoolError> {
    let blocks = basis.block_offsets.len() - 1;
    assert_eq!(starts.len(), blocks + 1, "starts of another basis");
    assert_eq!(starts[blocks], basis.basis.len(), "starts of another basis");
    assert_eq!(r.len(), 3 * basis.block_nodes.len(), "r must be [K,3]");
    assert_eq!(
        q.len(),
        basis.rank_offsets[blocks] as usize,
        "q must be [Q]"
    );
    // As in `decode_rows`: bound by memory, ranks are multiples of 8.
    let isa = if isa == Isa::Avx512 { Isa::Avx2 } else { isa };
    let parts = Parts::new(q);
    let bytes = basis.basis.len() * basis.basis.number_bytes();
    pool.run_streaming(bytes, blocks, &|k, _| {
        let ranks = basis.rank_offsets[k] as usize..basis.rank_offsets[k + 1] as usize;
        // SAFETY: these coordinates belong to this block alone.
        let q = unsafe { parts.part(ranks.start, ranks.len()) };
        let nodes = &basis.block_nodes[basis.block_offsets[k] as usize..][..basis.own_nodes(k)];
        match basis.basis {
            Stored::F32(u) => block_f32(isa, &u[starts[k]..starts[k + 1]], nodes, r, q),
            Stored::F16(u) => block_f16(isa, &u[starts[k]..starts[k + 1]], nodes, r, q),
        }
        add_copies(isa, basis, k, starts[k]..starts[k + 1], r, q);
    })
}

by_isa! {
    fn block_f32(basis: &[f32], nodes: &[u32], r: &[f32], q: &mut [f32]) = block_body, block_scalar;
}
by_isa! {
    fn block_f16(basis: &[f16], nodes: &[u32], r: &[f32], q: &mut [f32]) = block_body, block_scalar;
}

/// `q = U_k^T r` of one block in plain Rust: `basis [3 n_k,r_k]` are the rows of the block's own nodes, `q [r_k]` its
/// coordinates.
fn block_scalar<T: Number>(basis: &[T], nodes: &[u32], r: &[f32], q: &mut [f32]) {
    q.fill(0.0);
    let rank = q.len();
    for (local, &node) in nodes.iter().enumerate() {
        for axis in 0..3 {
            let force = r[3 * node as usize + axis];
            let row = &basis[(3 * local + axis) * rank..][..rank];
            for (q, u) in q.iter_mut().zip(row) {
                *q += force * u.wide();
            }
        }
    }
}

/// The same by strips of up to eight registers of coordinates. A strip passes over all nodes with its sums in registers; a
/// coordinate adds its nodes up in the order of the block, so threads, which have whole blocks, do not change its bits.
///
/// # Safety
/// The instruction set of `V` is there; lengths are checked here.
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn block_body<V: DenseLanes>(
    basis: &[impl Number],
    nodes: &[u32],
    r: &[f32],
    q: &mut [f32],
) {
    let rank = q.len();
    assert!(basis.len() >= 3 * nodes.len() * rank, "basis of the block");
    assert!(
        rank.is_multiple_of(V::COUNT),
        "rank must be whole registers"
    );
    let mut column = 0;
    // SAFETY: rows and columns are inside `basis` by the checks above.
    unsafe {
        // Every sweep reads the whole block: as few of them as there are registers for.
        while column < rank {
            let (from, to) = (basis.as_ptr().add(column), &mut q[column..]);
            let registers = ((rank - column) / V::COUNT).min(8);
            match registers {
                8 => tile::<V, 8>(from, rank, nodes, r, to),
                7 => tile::<V, 7>(from, rank, nodes, r, to),
                6 => tile::<V, 6>(from, rank, nodes, r, to),
                5 => tile::<V, 5>(from, rank, nodes, r, to),
                4 => tile::<V, 4>(from, rank, nodes, r, to),
                3 => tile::<V, 3>(from, rank, nodes, r, to),
                2 => narrow_tile::<V, 2>(from, rank, nodes, r, to),
                _ => narrow_tile::<V, 1>(from, rank, nodes, r, to),
            }
            column += registers * V::COUNT;
        }
    }
}

/// `M` registers of [`block_body`], three registers and more: so many sums keep the multipliers busy one after another.
///
/// # Safety
/// The caller's: `nodes.len()` times three rows of `rank` numbers from `basis` on, of which `M` registers are read.
#[inline(always)]
unsafe fn tile<V: DenseLanes, const M: usize>(
    basis: *const impl Number,
    rank: usize,
    nodes: &[u32],
    r: &[f32],
    q: &mut [f32],
) {
    // SAFETY: the caller's.
    unsafe {
        let mut sum = [V::splat(0.0); M];
        let mut row = basis;
        for &node in nodes {
            for &force in &r[3 * node as usize..3 * node as usize + 3] {
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

/// The same with a sum an axis: few sums would wait for each other.
#[inline(always)]
unsafe fn narrow_tile<V: DenseLanes, const M: usize>(
    basis: *const impl Number,
    rank: usize,
    nodes: &[u32],
    r: &[f32],
    q: &mut [f32],
) {
    // SAFETY: the caller's.
    unsafe {
        let mut sums = [[V::splat(0.0); M]; 3];
        let mut row = basis;
        for &node in nodes {
            let forces = &r[3 * node as usize..3 * node as usize + 3];
            for (sum, &force) in sums.iter_mut().zip(forces) {
                let force = V::splat(force);
                for v in 0..M {
                    sum[v] = Number::lanes::<V>(row.add(v * V::COUNT)).mul_add(force, sum[v]);
                }
                row = row.wrapping_add(rank);
            }
        }
        for v in 0..M {
            let one = V::splat(1.0);
            let total = sums[0][v].mul_add(one, sums[1][v]).mul_add(one, sums[2][v]);
            total.store(q.as_mut_ptr().add(v * V::COUNT));
        }
    }
}

/// `out[i] = table[rows[i]] . q` for a table `[n,Q]`.
///
/// # Errors
/// [`PoolError`] where a worker failed.
///
/// # Panics
/// If the lengths do not match or a row lies outside the table.
pub fn row_dots(
    isa: Isa,
    pool: &Pool,
    table: Stored<'_>,
    rows: &[u32],
    q: &[f32],
    out: &mut [f32],
) -> Result<(), PoolError> {
    assert_eq!(rows.len(), out.len(), "one result a row");
    // Once for all: the lanes read without looking.
    if let Some(&last) = rows.iter().max() {
        assert!((last as usize + 1) * q.len() <= table.len(), "row {last}");
    }
    let parts = Parts::new(out);
    let bytes = rows.len() * q.len() * table.number_bytes();
    pool.run_streaming(bytes, rows.len().div_ceil(16), &|chunk, _| {
        let rows = &rows[16 * chunk..rows.len().min(16 * chunk + 16)];
        // SAFETY: these results belong to this chunk alone.
        let out = unsafe { parts.part(16 * chunk, rows.len()) };
        match table {
            Stored::F32(table) => dots_f32(isa, table, rows, q, out),
            Stored::F16(table) => dots_f16(isa, table, rows, q, out),
        }
    })
}

by_isa! {
    fn dots_f32(table: &[f32], rows: &[u32], q: &[f32], out: &mut [f32]) = dots_body, dots_scalar;
}
by_isa! {
    fn dots_f16(table: &[f16], rows: &[u32], q: &[f32], out: &mut [f32]) = dots_body, dots_scalar;
}

/// Row after row in plain Rust: sixteen sums, by the column modulo sixteen, added up at the end.
fn dots_scalar<T: Number>(table: &[T], rows: &[u32], q: &[f32], out: &mut [f32]) {
    for (&row, out) in rows.iter().zip(out) {
        let row = &table[row as usize * q.len()..][..q.len()];
        let mut lanes = [0.0f32; 16];
        for (row, q) in row.chunks(16).zip(q.chunks(16)) {
            for ((lane, a), b) in lanes.iter_mut().zip(row).zip(q) {
                *lane += a.wide() * b;
            }
        }
        *out = lanes.iter().sum();
    }
}

/// Four rows at a time, a sum each, one register of `q` after the other.
///
/// # Safety
/// The instruction set of `V` is there; rows were checked by [`row_dots`].
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn dots_body<V: DenseLanes>(
    table: &[impl Number],
    rows: &[u32],
    q: &[f32],
    out: &mut [f32],
) {
    for (rows, out) in rows.chunks(4).zip(out.chunks_mut(4)) {
        // SAFETY: `row_dots` has checked every row.
        unsafe {
            let row = |i: usize| {
                let row = rows[i.min(rows.len() - 1)] as usize;
                table.as_ptr().add(row * q.len())
            };
            // Four rows share each load of `q`; a last group of fewer takes its last row several times.
            let rows = [row(0), row(1), row(2), row(3)];
            let mut total = [V::splat(0.0); 4];
            let mut at = 0;
            while at + V::COUNT <= q.len() {
                let x = V::load(q.as_ptr().add(at));
                for i in 0..4 {
                    total[i] = Number::lanes::<V>(rows[i].add(at)).mul_add(x, total[i]);
                }
                at += V::COUNT;
            }
            // What is left of a row comes last, in the same order for every set of rows.
            let mut sums = V::sums(total);
            for (at, q) in q.iter().enumerate().skip(at) {
                for i in 0..4 {
                    sums[i] += (*rows[i].add(at)).wide() * q;
                }
            }
            for (out, sum) in out.iter_mut().zip(sums) {
                *out = sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Random, max_error};
    use super::*;

    #[test]
    fn they_are_the_transposed_products_on_every_isa() {
        let mut random = Random::new(3);
        let (block_nodes, block_offsets) = ([2, 0, 3, 1, 4], [0, 2, 5]);
        let (rank_offsets, starts) = ([0, 8, 88], [0, 48, 48 + 9 * 80]);
        let wide = random.normal(48 + 9 * 80, 1.0);
        let half: Vec<f16> = wide.iter().map(|&x| f16::from_f32(x)).collect();
        let (r, q) = (random.normal(15, 1.0), random.normal(88, 1.0));
        let rows = [3, 0, 1, 1, 2, 5];
        let table = random.normal(6 * 88, 1.0);
        for basis in [Stored::F32(&wide), Stored::F16(&half)] {
            let basis = BlockBasis {
                block_nodes: &block_nodes,
                block_offsets: &block_offsets,
                rank_offsets: &rank_offsets,
                basis,
                copies: None,
            };
            let run = |isa, threads| {
                let pool = Pool::new(threads).unwrap();
                let (mut projected, mut out) = (vec![f32::NAN; 88], [f32::NAN; 6]);
                project_field(isa, &pool, &basis, &starts, &r, &mut projected).unwrap();
                row_dots(isa, &pool, Stored::F32(&table), &rows, &q, &mut out).unwrap();
                (projected, out)
            };
            // The work of forces on fields: r . (U q) = (U^T r) . q.
            let plan = super::super::rows::RowPlan::full(&basis);
            let mut field = vec![0.0; 15];
            let pool = Pool::new(1).unwrap();
            super::super::rows::decode_rows(Isa::Scalar, &pool, &basis, &plan, &q, &mut field)
                .unwrap();
            let work: f32 = field.iter().zip(&r).map(|(u, r)| u * r).sum();
            let want = run(Isa::Scalar, 1);
            let found: f32 = want.0.iter().zip(&q).map(|(a, b)| a * b).sum();
            assert!((work - found).abs() < 1e-3, "{work} {found}");
            for isa in Isa::available() {
                let got = run(isa, 1);
                assert!(max_error(&want.0, &got.0) < 2e-5);
                assert!(max_error(&want.1, &got.1) < 2e-5);
                assert_eq!(got, run(isa, 2));
            }
        }
    }
}
