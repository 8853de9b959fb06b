//! Several right sides at once: the factor is read once for [`SIDES`] of them.

use lanes::{DenseLanes, Isa, by_isa};

use super::{SparseFactor, WHAT};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Right sides that go through together.
const SIDES: usize = 16;
/// Rows of `U` that go through together.
const PANEL: usize = 8;

/// One value of each right side.
type Sides = [f32; SIDES];

/// Room for the right sides: permuted, and those of one front.
#[derive(Default, HeldBytes)]
pub(super) struct ManySides {
    permuted: Vec<Sides>,
    gathered: Vec<Sides>,
}

impl ManySides {
    pub fn fit(&mut self, rows: usize, widest: usize) -> Result<()> {
        for (list, count) in [(&mut self.permuted, rows), (&mut self.gathered, widest)] {
            list.clear();
            memory::fit(list, count, WHAT)?;
            list.resize(count, [0.0; SIDES]);
        }
        Ok(())
    }
}

impl SparseFactor {
    /// `x = A^-1 b` in place for right sides that follow each other, each `[3 rows]`. What one of them gives does not depend on the others.
    ///
    /// # Panics
    /// If there is no factor or the length is no multiple of that of a right side.
    pub fn solve_many(&mut self, isa: Isa, x: &mut [f32]) {
        assert!(self.is_made, "there is no factor");
        let len = 3 * self.order.len();
        assert!(
            len == 0 || x.len().is_multiple_of(len),
            "length of the right sides"
        );
        for sides in x.chunks_mut((SIDES * len).max(1)) {
            self.solve_sides(isa, sides, len);
        }
    }

    fn solve_sides(&mut self, isa: Isa, x: &mut [f32], len: usize) {
        let count = x.len() / len;
        let ManySides { permuted, gathered } = &mut self.many;
        permuted.fill([0.0; SIDES]);
        for (side, x) in x.chunks_exact(len).enumerate() {
            for (node, values) in x.as_chunks::<3>().0.iter().enumerate() {
                if *values != [0.0; 3] {
                    let place = 3 * self.places[node] as usize;
                    for (axis, value) in values.iter().enumerate() {
                        permuted[place + axis][side] = *value;
                    }
                }
            }
        }
        let borders = self.borders.as_slice();
        for front in &self.fronts {
            let own = &permuted[3 * front.first as usize..][..3 * front.own as usize];
            if own.iter().all(|values| *values == [0.0; SIDES]) {
                continue;
            }
            let width = front.gather_from(borders, permuted, gathered);
            let own = 3 * front.own as usize;
            let upper = &self.upper[front.upper..][..own * width];
            forward(isa, upper, width, count, &mut gathered[..width]);
            permuted[3 * front.first as usize..][..own].copy_from_slice(&gathered[..own]);
            let border = gathered[own..].as_chunks::<3>().0;
            for (from, &place) in border.iter().zip(front.border_in(borders)) {
                permuted[3 * place as usize..][..3].copy_from_slice(from);
            }
        }
        for front in self.fronts.iter().rev().filter(|front| front.own > 0) {
            let width = front.gather_from(borders, permuted, gathered);
            let own = 3 * front.own as usize;
            let upper = &self.upper[front.upper..][..own * width];
            back(isa, upper, width, count, &mut gathered[..width]);
            permuted[3 * front.first as usize..][..own].copy_from_slice(&gathered[..own]);
        }
        for (side, x) in x.chunks_exact_mut(len).enumerate() {
            for (values, &place) in x.as_chunks_mut::<3>().0.iter_mut().zip(&self.places) {
                let place = 3 * place as usize;
                *values = [0, 1, 2].map(|axis| permuted[place + axis][side]);
            }
        }
    }
}

impl super::Front {
    /// Its nodes' entries of permuted right sides; gives how many they are.
    fn gather_from(&self, borders: &[u32], from: &[Sides], to: &mut [Sides]) -> usize {
        let own = 3 * self.own as usize;
        to[..own].copy_from_slice(&from[3 * self.first as usize..][..own]);
        let border = self.border_in(borders);
        for (to, &place) in to[own..].as_chunks_mut::<3>().0.iter_mut().zip(border) {
            to.copy_from_slice(&from[3 * place as usize..][..3]);
        }
        own + 3 * border.len()
    }
}

by_isa! {
    /// `U11^T y1 = b1`, `b2 -= U12^T y1` with the rows `[own, width]` of `U`, of the first `count` right sides.
    fn forward(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) = forward_body, forward_scalar;
}
by_isa! {
    /// `U11 x1 = y1 - U12 x2` likewise.
    fn back(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) = back_body, back_scalar;
}

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

#[inline(always)]
unsafe fn forward_body<V: DenseLanes>(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) {
    assert!(upper.len() / width <= width && width <= x.len(), "a front");
    let own = upper.len() / width;
    for side in (0..count).step_by(V::COUNT) {
        let mut first = 0;
        while first < own {
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

#[inline(always)]
unsafe fn back_body<V: DenseLanes>(upper: &[f32], width: usize, count: usize, x: &mut [Sides]) {
    assert!(upper.len() / width <= width && width <= x.len(), "a front");
    let own = upper.len() / width;
    for side in (0..count).step_by(V::COUNT) {
        let mut end = own;
        while end > 0 {
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
