//! Kernels of a front for [`SIDES`] right sides at once, and the room for these.
//!
//! With one right side a solve reads two numbers of `U` for each multiply-add pair and waits for
//! memory. With [`SIDES`] of them, one to a lane, each number that is read serves sixteen. Sides
//! never meet: what one gives does not depend on the others, nor on how many there are.

use lanes::{DenseLanes, by_isa};

use field::error::Result;
use field::memory::{self, HeldBytes};

/// Right sides that go through together: one AVX-512 register, and a multiple of every other.
pub const SIDES: usize = 16;
/// Rows of `U` that go through together: eight sums in registers, and room for the operands in the
/// sixteen registers of AVX2.
const PANEL: usize = 8;

/// One value of each right side.
pub type Sides = [f32; SIDES];

/// Room for the right sides: permuted, and those of one front.
#[derive(Default, HeldBytes)]
pub struct ManySides {
    /// By row in the order of elimination `[n]`.
    pub permuted: Vec<Sides>,
    /// The rows of the front that is worked on, `[widest]`: its own first, then those that it updates.
    pub gathered: Vec<Sides>,
}

impl ManySides {
    /// Makes room and zeros for a factor of `rows` rows whose widest front has `widest`; `what` names it where memory runs
    /// out. The room stays for the next call.
    pub fn fit(&mut self, rows: usize, widest: usize, what: &str) -> Result<()> {
        for (list, count) in [(&mut self.permuted, rows), (&mut self.gathered, widest)] {
            list.clear();
            memory::fit(list, count, what)?;
            list.resize(count, [0.0; SIDES]);
        }
        Ok(())
    }
}

by_isa! {
    /// `U11^T y1 = b1`, `b2 -= U12^T y1` with the rows `[own, width]` of `U`, of the first `count` right sides.
    pub fn forward(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) = forward_body, forward_scalar;
}
by_isa! {
    /// `U11 x1 = y1 - U12 x2` likewise.
    pub fn back(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) = back_body, back_scalar;
}

/// Row after row; the diagonal of `upper` holds reciprocals, so that no side divides.
fn forward_scalar(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) {
    for (k, row) in upper.chunks_exact(width).enumerate() {
        let (own, later) = x[k..].split_at_mut(1);
        for value in &mut own[0][..count] {
            *value *= row[k];
        }
        for (x, u) in later.iter_mut().zip(&row[k + 1..]) {
            for (x, y) in x[..count].iter_mut().zip(&own[0]) {
                *x -= u * y;
            }
        }
    }
}

/// From the last row to the first; what is later than the front's own rows, `x2`, is known and stays as it is.
fn back_scalar(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) {
    for (k, row) in upper.chunks_exact(width).enumerate().rev() {
        let (own, later) = x[k..].split_at_mut(1);
        for (x, u) in later.iter().zip(&row[k + 1..]) {
            for (own, x) in own[0][..count].iter_mut().zip(x) {
                *own -= u * x;
            }
        }
        for value in &mut own[0][..count] {
            *value *= row[k];
        }
    }
}

/// The same by panels of eight rows. Each side is a lane, and each of its values takes the rows in the order of the scalar
/// way.
///
/// # Safety
/// The instruction set of `V` is there, and `V::COUNT` divides [`SIDES`].
#[inline(always)]
unsafe fn forward_body<V: DenseLanes>(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) {
    assert!(upper.len() / width <= width && width <= x.len(), "a front");
    let own = upper.len() / width;
    for side in (0..count).step_by(V::COUNT) {
        let mut first = 0;
        while first < own {
            // A panel's values stay in registers while all later rows pass: each is loaded and stored once for eight rows of `U`.
            let rows = PANEL.min(own - first);
            // SAFETY: `V::COUNT` divides the sides; rows and columns lie in the front.
            unsafe {
                let u = |row: usize, column: usize| *upper.get_unchecked(row * width + column);
                let x = |row: usize| x.as_ptr().add(row).cast::<f32>().add(side).cast_mut();
                let mut y = [V::splat(0.0); PANEL];
                for k in 0..rows {
                    let row = first + k;
                    let mut value = V::load(x(row));
                    for (earlier, y) in y[..k].iter().enumerate() {
                        value = y.neg_mul_add(V::splat(u(first + earlier, row)), value);
                    }
                    y[k] = value.mul(V::splat(u(row, row)));
                    y[k].store(x(row));
                }
                // Written twice so that the count is a constant in the common case and the loop
                // unrolls.
                if rows == PANEL {
                    for column in first + PANEL..width {
                        let mut value = V::load(x(column));
                        for k in 0..PANEL {
                            value = y[k].neg_mul_add(V::splat(u(first + k, column)), value);
                        }
                        value.store(x(column));
                    }
                } else {
                    for column in first + rows..width {
                        let mut value = V::load(x(column));
                        for (k, y) in y[..rows].iter().enumerate() {
                            value = y.neg_mul_add(V::splat(u(first + k, column)), value);
                        }
                        value.store(x(column));
                    }
                }
            }
            first += rows;
        }
    }
}

/// Likewise; in a panel the columns behind it come first, from left to right, then its own triangle from below.
///
/// # Safety
/// As [`forward_body`].
#[inline(always)]
unsafe fn back_body<V: DenseLanes>(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) {
    assert!(upper.len() / width <= width && width <= x.len(), "a front");
    let own = upper.len() / width;
    for side in (0..count).step_by(V::COUNT) {
        let mut end = own;
        while end > 0 {
            // From the last panel to the first; in each the later values come first, then the triangle of its own rows.
            let first = end.saturating_sub(PANEL);
            let rows = end - first;
            // SAFETY: as in `forward_body`.
            unsafe {
                let u = |row: usize, column: usize| *upper.get_unchecked(row * width + column);
                let x = |row: usize| x.as_ptr().add(row).cast::<f32>().add(side).cast_mut();
                let mut sums = [V::splat(0.0); PANEL];
                for (k, sum) in sums[..rows].iter_mut().enumerate() {
                    *sum = V::load(x(first + k));
                }
                if rows == PANEL {
                    for column in end..width {
                        let known = V::load(x(column));
                        for k in 0..PANEL {
                            sums[k] = known.neg_mul_add(V::splat(u(first + k, column)), sums[k]);
                        }
                    }
                } else {
                    for column in end..width {
                        let known = V::load(x(column));
                        for (k, sum) in sums[..rows].iter_mut().enumerate() {
                            *sum = known.neg_mul_add(V::splat(u(first + k, column)), *sum);
                        }
                    }
                }
                for k in (0..rows).rev() {
                    let row = first + k;
                    let own = sums[k].mul(V::splat(u(row, row)));
                    own.store(x(row));
                    for (earlier, sum) in sums[..k].iter_mut().enumerate() {
                        *sum = own.neg_mul_add(V::splat(u(first + earlier, row)), *sum);
                    }
                }
            }
            end = first;
        }
    }
}
