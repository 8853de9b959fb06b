//! `W` at any time after a step: the static one less what inertia holds back at that time, `W_k = W - G diag(lost) G^T` with the natural modes `G` at
//! the samples. `W` and `G` are kept from call to call; a row is computed when it is asked for, by contacts whose force changes.

use ::contact::{Rows, Vector};

use super::compliance::{Compliance, WHAT};
use super::delassus::Delassus;
use super::in_lanes::add_rows_by;
use super::ties::Points;
use crate::error::Result;
use crate::kernels::Isa;
use crate::kernels::respond::columns_f32;
use crate::memory::{self, HeldBytes};

/// The modes at the samples of the last call, and rows that were made since it.
/// A frame asks for few rows out of many samples, again and again with other times: hence rows on
/// demand, and a matrix that is never whole.
#[derive(Debug, Default, HeldBytes)]
pub struct InertialCompliance {
    /// By mode, `[m,3n]`.
    modes: Vec<f32>,
    /// `0..m`: the modes, all of which are used.
    all: Vec<u32>,
    /// Scratch of a row: each mode's value there times what it loses.
    factors: Vec<f32>,
    /// `[3n,3n]`, and which contacts' rows are made.
    rows: Vec<f32>,
    made: Vec<bool>,
}

/// `W` at one time.
pub struct At<'a> {
    own: &'a mut InertialCompliance,
    /// The static `W [3n,3n]`, mm/mN.
    fixed: &'a [f32],
    /// By mode, what inertia takes off its compliance at this time.
    lost: &'a [f32],
    /// Of the modes.
    isa: Isa,
}

impl InertialCompliance {
    /// `W` of samples, with what each mode loses at this time (`Compliance::inertia`).
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn at<'a>(
        &'a mut self,
        delassus: &'a mut Delassus,
        compliance: Compliance<'a>,
        all: Points<'_>,
        rows: &[u32],
    ) -> Result<At<'a>> {
        let order = 3 * rows.len();
        let (isa, lost) = match compliance.inertia {
            Some((space, lost)) => (space.isa(), lost),
            None => (Isa::Scalar, &[][..]),
        };
        let alone = Compliance {
            inertia: None,
            ..compliance
        };
        let (fixed, is_new) = delassus.fixed(alone, all, rows)?;
        // Only other samples need their modes read anew; another time changes `lost` alone.
        if is_new || self.modes.len() != lost.len() * order {
            self.read(compliance, all, rows)?;
        }
        self.made.clear();
        memory::fit(&mut self.made, rows.len(), WHAT)?;
        memory::fit(&mut self.factors, lost.len(), WHAT)?;
        self.made.resize(rows.len(), false);
        Ok(At {
            own: self,
            fixed,
            lost,
            isa,
        })
    }

    /// The natural modes at the samples.
    fn read(&mut self, compliance: Compliance<'_>, all: Points<'_>, rows: &[u32]) -> Result<()> {
        self.modes.clear();
        let Some((space, lost)) = compliance.inertia else {
            return Ok(());
        };
        let (count, order) = (lost.len(), 3 * rows.len());
        memory::fit(&mut self.rows, order * order, WHAT)?;
        memory::fit(&mut self.all, count, WHAT)?;
        memory::fit(&mut self.modes, count * order, WHAT)?;
        // It never shrinks: rows that have not been made for this time are not read, so what they
        // hold does not matter.
        let most = self.rows.len().max(order * order);
        self.rows.resize(most, 0.0);
        self.modes.resize(count * order, 0.0);
        self.all.clear();
        self.all.extend(0..count as u32);
        for (at, &row) in rows.iter().enumerate() {
            for (column, weight) in compliance.entries(all.at(row)) {
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
                    // `-G diag(lost) G^T`, one row of it.
                    .extend(modes.map(|(mode, lost)| -lost * mode[at]));
                let row = &mut own.rows[at * order..(at + 1) * order];
                columns_f32(
                    self.isa,
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

    fn add_shift(&mut self, contact: usize, change: Vector, shift: &mut [f32]) {
        add_rows_by(self.isa, self.rows(contact), change, shift);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::bundle::{BundleFiles, Mesh};
    use crate::corrections::Corrections;
    use crate::kernels::Isa;
    use crate::prior::PriorTable;

    /// Rows at a time are those of the whole matrix that a step of that length would have, also after samples and times have changed.
    #[test]
    fn rows_are_those_of_the_whole_matrix() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("tests/fixtures/tiny-corrected");
        let files = BundleFiles::open(&path).unwrap();
        let manifest = &files.manifest;
        let tensors = files.tensors(&manifest.mesh.file).unwrap();
        let mesh = Mesh::parse(&tensors, manifest.boundary).unwrap();
        let prior = PriorTable::open(&files, manifest.prior.as_ref().unwrap(), &mesh).unwrap();
        let corrections = Corrections::open(&files, &mesh, Some(&prior), Isa::detect()).unwrap();
        let (prior, space) = (&prior, &corrections.space);
        let mut held = vec![false; mesh.node_count()];
        for &node in &mesh.held_nodes {
            held[node as usize] = true;
        }
        let places = mesh.positions.as_chunks().0;
        let faces = mesh.domain.faces.as_chunks().0;
        let samples =
            ::contact::Samples::try_new(places, faces, &mesh.held_nodes, ::contact::SPACING_MM);
        let samples = samples.unwrap();
        let points = Points::from(&samples);
        let count = samples.rows().len() as u32;
        let mut own = InertialCompliance::default();
        let mut between = Delassus::default();
        for (step, seconds) in [(1, 0.01f64), (1, 0.04), (3, 0.04)] {
            let rows: Vec<u32> = (0..count).step_by(step).take(20).collect();
            let lost: Vec<f32> = space.holds_back(2.25 / (seconds * seconds)).collect();
            assert!(lost.iter().any(|lost| *lost > 0.0));
            let compliance = Compliance::at_rest(prior, &held, Some((space, &lost)));
            let mut whole = Delassus::default();
            let wanted = whole.of(compliance, points, &rows).unwrap();
            let mut at = own.at(&mut between, compliance, points, &rows).unwrap();
            assert_eq!(at.contacts(), rows.len());
            let size = 9 * rows.len();
            let largest = wanted.iter().fold(0.0f32, |most, w| most.max(w.abs()));
            for contact in [7, 0, 19, 7] {
                let wanted = &wanted[contact * size..][..size];
                for (a, b) in at.rows(contact).iter().zip(wanted) {
                    assert!((a - b).abs() < 1e-5 * largest, "{contact}: {a} {b}");
                }
            }
        }
    }
}
