//! The coarse space that a bundle has, to be kept and extended by what data has outside of it.

use std::path::Path;

use anyhow::{Result, bail};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use upt::bundle::BundleFiles;

use super::{FILE, principal};
use yardstick::manifest::Manifest;

/// Modes of a bundle's file, in block coordinates, the natural ones first, and its entry in the manifest.
pub struct Existing {
    pub natural: usize,
    pub entry: Value,
    modes: Vec<Vec<f32>>,
}

impl Existing {
    pub fn read(bundle: &Path) -> Result<Self> {
        let Some(entry) = Manifest::read(bundle)?.get("corrections")? else {
            bail!(
                "{}: has no corrections to extend; leave --extend out to make them",
                bundle.display()
            );
        };
        let file = BundleFiles::open(bundle)?.tensors(FILE)?;
        let natural = file.f32("frequency", &[None])?.len();
        let width = file.shape("modes")?.last().map_or(1, |&width| width.max(1));
        let values = file.f16("modes", &[None, Some(width)])?;
        let modes = values.chunks_exact(width);
        Ok(Self {
            natural,
            entry,
            modes: modes
                .map(|mode| mode.iter().map(|value| value.to_f32()).collect())
                .collect(),
        })
    }

    /// The modes after the natural ones, then `count` principal directions of what `rows` have outside of all modes.
    pub fn extended(self, rows: &[Vec<f32>], count: usize) -> Vec<Vec<f32>> {
        let column = |mode: &Vec<f32>| DVector::from_iterator(mode.len(), mode.iter().copied());
        let columns: Vec<DVector<f32>> = self.modes.iter().map(column).collect();
        let basis = DMatrix::from_columns(&columns).qr().q();
        let outside: Vec<Vec<f32>> = rows
            .iter()
            .map(|row| {
                let row = column(row);
                let inside = &basis * basis.tr_mul(&row);
                (row - inside).as_slice().to_vec()
            })
            .collect();
        let mut more = self.modes;
        more.drain(..self.natural);
        more.extend(principal(&outside, count));
        more
    }
}
