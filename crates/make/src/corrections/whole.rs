//! `whole.safetensors`: natural modes as whole fields, less what the coarse space has of them (`docs/decisions/029-whole-modes.md`).

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use half::f16;
use nalgebra::{Cholesky, DMatrix};
use tissue::linear::{NaturalModes, Stiffness};
use tissue::mesh::{Mesh, tet_volume};
use tissue::tensors::{Dtype, Tensor, write_file};
use upt::prior::{CoarseSpace, PriorTable};

/// The file, and its key in the manifest's entry.
pub const FILE: &str = "whole.safetensors";
pub const KEY: &str = "whole";
/// Of what a mode has outside of the coarse space: its part of the mode's mass below which it is left out.
const NEW: f64 = 0.05;

/// What the fields are made of.
pub struct Source<'a> {
    pub mesh: &'a Mesh,
    pub stiffness: &'a Stiffness,
    pub natural: &'a NaturalModes,
    pub prior: &'a PriorTable,
    pub space: &'a CoarseSpace,
    pub density_kg_m3: f64,
}

/// Writes the file, where there is anything to write; returns the number of modes.
pub fn write(source: &Source<'_>, path: &Path) -> Result<usize> {
    let free = &source.stiffness.free.nodes;
    let (len, nodes) = (3 * free.len(), source.mesh.node_count());
    let mut mass = vec![0.0; nodes];
    for (at, tet) in source.mesh.tets.iter().enumerate() {
        let density = source.mesh.laws().density_of(at, source.density_kg_m3);
        let share = 0.25e-6 * density * tet_volume(&source.mesh.positions, *tet);
        tet.iter().for_each(|&node| mass[node as usize] += share);
    }
    let mass: Vec<f64> = (free.iter())
        .flat_map(|&node| [mass[node as usize]; 3])
        .collect();
    let phi = coarse_fields(source);
    let natural = free_rows(source);
    let on_mass = |fields: &DMatrix<f64>| {
        DMatrix::from_fn(len, fields.ncols(), |row, column| {
            mass[row] * fields[(row, column)]
        })
    };
    // What the coarse space lacks of each, M-orthogonal to it.
    let heavy = on_mass(&phi);
    let gram = Cholesky::new(heavy.tr_mul(&phi)).context("the coarse modes are not independent")?;
    let rest = &natural - &phi * gram.solve(&heavy.tr_mul(&natural));
    let eigen = on_mass(&rest).tr_mul(&rest).symmetric_eigen();
    let kept: Vec<usize> = (0..rest.ncols())
        .filter(|&at| eigen.eigenvalues[at] > NEW)
        .collect();
    if kept.is_empty() {
        return Ok(0);
    }
    let weights = DMatrix::from_fn(rest.ncols(), kept.len(), |row, column| {
        let at = kept[column];
        eigen.eigenvectors[(row, at)] / eigen.eigenvalues[at].sqrt()
    });
    let stored = (rest * weights).map(f16::from_f64);
    let rounded = stored.map(f64::from);
    let stiff = stiff_fields(source.stiffness, &rounded);
    let heavy = on_mass(&rounded);
    let count = kept.len();
    let mut half = vec![f16::ZERO; 3 * nodes * count];
    for (field, column) in half.chunks_exact_mut(3 * nodes).zip(stored.column_iter()) {
        for (at, &node) in free.iter().enumerate() {
            for axis in 0..3 {
                field[3 * node as usize + axis] = column[3 * at + axis];
            }
        }
    }
    let table = |name: &str, rows: &DMatrix<f64>, images: &DMatrix<f64>| {
        // Row-major.
        let product = images.tr_mul(rows);
        let bytes = product
            .iter()
            .flat_map(|value| (*value as f32).to_le_bytes());
        let shape = vec![rows.ncols(), images.ncols()];
        Tensor::new(name, Dtype::F32, shape, bytes.collect())
    };
    let metadata = BTreeMap::from([
        ("format".to_owned(), "upt-whole-modes".to_owned()),
        ("version".to_owned(), "1".to_owned()),
    ]);
    let half = half.iter().flat_map(|value| value.to_le_bytes()).collect();
    let tensors = [
        table("cross_mass", &phi, &heavy),
        table("cross_stiffness", &phi, &stiff),
        table("mass", &rounded, &heavy),
        Tensor::new("modes", Dtype::F16, vec![count, 3 * nodes], half),
        table("stiffness", &rounded, &stiff),
    ];
    write_file(path, &metadata, &tensors)
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    Ok(count)
}

/// The modes of the coarse space at the free nodes, as columns.
fn coarse_fields(source: &Source<'_>) -> DMatrix<f64> {
    let free = &source.stiffness.free.nodes;
    let mut fields = DMatrix::zeros(3 * free.len(), source.space.count());
    let mut q = vec![0.0; source.prior.width()];
    for mode in 0..source.space.count() {
        source.space.read_mode(mode, &mut q);
        for (at, &node) in free.iter().enumerate() {
            for axis in 0..3 {
                let value = source.prior.value_at(node, axis, |at| q[at]);
                fields[(3 * at + axis, mode)] = f64::from(value);
            }
        }
    }
    fields
}

/// The natural modes at the free nodes, of mass 1 g.
fn free_rows(source: &Source<'_>) -> DMatrix<f64> {
    let (free, width) = (&source.stiffness.free.nodes, 3 * source.mesh.node_count());
    let scale = 1e-3f64.sqrt();
    let count = source.natural.frequency.len();
    DMatrix::from_fn(3 * free.len(), count, |row, mode| {
        let at = 3 * free[row / 3] as usize + row % 3;
        scale * source.natural.modes[mode * width + at]
    })
}

/// `K V`, µN.
fn stiff_fields(stiffness: &Stiffness, fields: &DMatrix<f64>) -> DMatrix<f64> {
    let mut images = DMatrix::zeros(fields.nrows(), fields.ncols());
    for (field, mut image) in fields.column_iter().zip(images.column_iter_mut()) {
        let field: Vec<f64> = field.iter().copied().collect();
        let forces = stiffness.multiply(&field);
        image
            .iter_mut()
            .zip(forces)
            .for_each(|(to, force)| *to = 1e3 * force);
    }
    images
}
