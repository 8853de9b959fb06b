//! Several right sides at once: the factor is read once for [`SIDES`] of them.
//!
//! The same two passes as [`SparseFactor::solve`], on rows of sixteen numbers in place of one. The
//! last group may have fewer sides; its other lanes are zeros and stay so.

use lanes::Isa;

use super::SparseFactor;
use super::many::{ManySides, SIDES, back, forward};

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

    /// Up to [`SIDES`] right sides of `len = 3 rows` numbers each.
    fn solve_sides(&mut self, isa: Isa, x: &mut [f32], len: usize) {
        let count = x.len() / len;
        let ManySides { permuted, gathered } = &mut self.room.many;
        permuted.fill([0.0; SIDES]);
        for (side, x) in x.chunks_exact(len).enumerate() {
            for (node, values) in x.as_chunks::<3>().0.iter().enumerate() {
                // The room was just set to zeros; right sides of contacts are zero at almost all
                // nodes.
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
            let width = front.gather(borders, permuted, gathered);
            let upper = &self.upper[front.upper..][..3 * front.own as usize * width];
            forward(isa, upper, width, count, &mut gathered[..width]);
            front.scatter(gathered, permuted);
            front.scatter_border(borders, gathered, permuted);
        }
        for front in self.fronts.iter().rev().filter(|front| front.own > 0) {
            let width = front.gather(borders, permuted, gathered);
            let upper = &self.upper[front.upper..][..3 * front.own as usize * width];
            back(isa, upper, width, count, &mut gathered[..width]);
            front.scatter(gathered, permuted);
        }
        for (side, x) in x.chunks_exact_mut(len).enumerate() {
            for (values, &place) in x.as_chunks_mut::<3>().0.iter_mut().zip(&self.places) {
                let place = 3 * place as usize;
                *values = [0, 1, 2].map(|axis| permuted[place + axis][side]);
            }
        }
    }
}
