//! Sweeps whose rows are added up by the instructions of this processor.

use ::contact::sweeps::add_rows;
use ::contact::{Rows, Vector, Whole};
use lanes::by_isa;

use crate::kernels::Isa;

by_isa! {
    /// [`add_rows`]; the bits do not depend on `isa`.
    pub(super) fn add_rows_by(rows: &[f32], change: Vector, shift: &mut [f32]) = add_rows_body, add_rows;
}

/// The compiler makes vectors of the columns.
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn add_rows_body<V>(rows: &[f32], change: Vector, shift: &mut [f32]) {
    add_rows(rows, change, shift);
}

/// All of `W`.
pub(super) struct InLanes<'a> {
    pub whole: Whole<'a>,
    pub isa: Isa,
}

impl Rows for InLanes<'_> {
    fn contacts(&self) -> usize {
        self.whole.contacts()
    }

    fn rows(&mut self, contact: usize) -> &[f32] {
        self.whole.rows(contact)
    }

    fn add_shift(&mut self, contact: usize, change: Vector, shift: &mut [f32]) {
        add_rows_by(self.isa, self.whole.rows(contact), change, shift);
    }
}
