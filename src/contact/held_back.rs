//! `W` at any time after a step: the static one less what inertia holds back at that time, `W_k = W - G diag(lost) G^T` with the natural modes `G` at
//! the samples. `W` and `G` are kept from call to call; a row is computed when it is asked for, by contacts whose force changes.

use ::contact::{Rows, Sample};

use super::compliance::{Compliance, Delassus, WHAT};
use crate::error::Result;
use crate::kernels::Isa;
use crate::kernels::respond::columns_f32;
use crate::memory;

/// The modes at the samples of the last call, and rows that were made since it.
#[derive(Debug, Default)]
pub struct HeldBack {
    /// By mode, `[m,3n]`.
    modes: Vec<f32>,
    /// All modes.
    all: Vec<u32>,
    factors: Vec<f32>,
    /// `[3n,3n]`, and which contacts' rows are made.
    rows: Vec<f32>,
    made: Vec<bool>,
}

/// `W` at one time.
pub struct At<'a> {
    own: &'a mut HeldBack,
    fixed: &'a [f32],
    lost: &'a [f32],
}

impl HeldBack {
    /// `W` of samples, with what each mode loses at this time (`Compliance::inertia`).
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn at<'a>(
        &'a mut self,
        delassus: &'a mut Delassus,
        compliance: Compliance<'a>,
        all: &[Sample],
        rows: &[u32],
    ) -> Result<At<'a>> {
        let order = 3 * rows.len();
        let lost = compliance.inertia.map_or(&[][..], |(_, lost)| lost);
        let alone = Compliance {
            inertia: None,
            ..compliance
        };
        let (fixed, is_new) = delassus.fixed(alone, all, rows)?;
        if is_new || self.modes.len() != lost.len() * order {
            self.read(compliance, all, rows)?;
        }
        self.made.clear();
        self.made.resize(rows.len(), false);
        Ok(At {
            own: self,
            fixed,
            lost,
        })
    }

    /// The natural modes at the samples.
    fn read(&mut self, compliance: Compliance<'_>, all: &[Sample], rows: &[u32]) -> Result<()> {
        self.modes.clear();
        let Some((space, lost)) = compliance.inertia else {
            return Ok(());
        };
        let (count, order) = (lost.len(), 3 * rows.len());
        memory::reserve(&mut self.modes, count * order, WHAT)?;
        let grown = (order * order).saturating_sub(self.rows.len());
        memory::reserve(&mut self.rows, grown, WHAT)?;
        self.rows.resize(self.rows.len() + grown, 0.0);
        self.modes.resize(count * order, 0.0);
        self.all.clear();
        self.all.extend(0..count as u32);
        for (at, &row) in rows.iter().enumerate() {
            for (column, weight) in compliance.entries(all[row as usize]) {
                for axis in 0..3 {
                    let own = space.at_contact(3 * column as usize + axis);
                    let to = self.modes.chunks_exact_mut(order);
                    for (to, own) in to.zip(own) {
                        to[3 * at + axis] += weight * own;
                    }
                }
            }
        }
        Ok(())
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let floats = self.modes.capacity() + self.factors.capacity() + self.rows.capacity();
        4 * (floats + self.all.capacity()) + self.made.capacity()
    }
}

impl Rows for At<'_> {
    fn contacts(&self) -> usize {
        self.own.made.len()
    }

    fn rows(&mut self, contact: usize) -> &[f32] {
        let order = 3 * self.own.made.len();
        let place = 3 * contact * order..3 * (contact + 1) * order;
        let own = &mut *self.own;
        if !std::mem::replace(&mut own.made[contact], true) {
            own.rows[place.clone()].copy_from_slice(&self.fixed[place.clone()]);
            for axis in 0..3 {
                let at = 3 * contact + axis;
                let modes = own.modes.chunks_exact(order).zip(self.lost);
                own.factors.clear();
                own.factors
                    .extend(modes.map(|(mode, lost)| -lost * mode[at]));
                let row = &mut own.rows[at * order..(at + 1) * order];
                columns_f32(
                    Isa::detect(),
                    &own.modes,
                    order,
                    &own.all,
                    &own.factors,
                    true,
                    row,
                );
            }
        }
        &own.rows[place]
    }
}
