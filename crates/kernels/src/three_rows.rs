//! What a change of force at one contact does to all of them: a sum of three rows of a small dense matrix.

use lanes::{Isa, by_isa};

/// `to += rows^T change` with `rows [3,n]`, row-major. The bits do not depend on `isa`.
///
/// # Panics
/// If `rows` are not three rows of the length of `to`.
pub fn add_three_rows(isa: Isa, rows: &[f32], change: [f32; 3], to: &mut [f32]) {
    assert_eq!(rows.len(), 3 * to.len(), "`rows` is [3,n]");
    add(isa, rows, change, to);
}

by_isa! {
    fn add(rows: &[f32], change: [f32; 3], to: &mut [f32]) = add_body, add_scalar;
}

/// The compiler makes vectors of the columns.
#[inline(always)]
fn add_scalar(rows: &[f32], change: [f32; 3], to: &mut [f32]) {
    let (x, others) = rows.split_at(to.len());
    let (y, z) = others.split_at(to.len());
    let rows = x.iter().zip(y).zip(z);
    for (to, ((x, y), z)) in to.iter_mut().zip(rows) {
        *to = *to + x * change[0] + y * change[1] + z * change[2];
    }
}

#[inline(always)]
unsafe fn add_body<V>(rows: &[f32], change: [f32; 3], to: &mut [f32]) {
    add_scalar(rows, change, to);
}
