//! The coarse space as it is stored: modes in block coordinates, what stiffness and mass make of them.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use half::f16;
use nalgebra::{Cholesky, DMatrix};
use tissue::linear::{NaturalModes, Stiffness};
use tissue::mesh::{Mesh, tet_volume};
use tissue::tensors::{Dtype, Tensor, write_file};
use upt::prior::PriorTable;

/// A mode that adds less than this of itself to the others is left out.
const NEW: f64 = 0.05;

/// Modes under construction.
pub struct Space<'a> {
    prior: &'a PriorTable,
    stiffness: &'a Stiffness,
    /// Lumped, g, a node.
    mass: Vec<f64>,
    /// Orthonormal rows `[r][Q]`, the natural modes not among themselves.
    modes: Vec<Vec<f32>>,
    natural: usize,
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

fn normalise(mode: &mut [f32]) -> f64 {
    let length = dot(mode, mode).sqrt();
    mode.iter_mut()
        .for_each(|value| *value = (f64::from(*value) / length) as f32);
    length
}

impl<'a> Space<'a> {
    pub fn new(
        prior: &'a PriorTable,
        stiffness: &'a Stiffness,
        mesh: &Mesh,
        density_kg_m3: f64,
    ) -> Self {
        let mut mass = vec![0.0; mesh.node_count()];
        for (at, tet) in mesh.tets.iter().enumerate() {
            let density = mesh.laws().density_of(at, density_kg_m3);
            let share = 0.25e-6 * density * tet_volume(&mesh.positions, *tet);
            for &node in tet {
                mass[node as usize] += share;
            }
        }
        Self {
            prior,
            stiffness,
            mass,
            modes: Vec::new(),
            natural: 0,
        }
    }

    /// The natural modes, projected on the block bases and made modes of what is left there (Rayleigh-Ritz), so that what inertia holds
    /// back never exceeds the compliance; they come first. Returns their angular frequencies, rad/s.
    pub fn add_natural(&mut self, found: &NaturalModes) -> Result<Vec<f64>> {
        let nodes = self.mass.len();
        let mut projected = Vec::new();
        for mode in found.modes.chunks_exact(3 * nodes) {
            let field: Vec<f32> = mode.iter().map(|&value| value as f32).collect();
            let mut q = vec![0.0; self.prior.width()];
            self.prior.project(&field, &mut q);
            normalise(&mut q);
            projected.push(q);
        }
        let [stiffness, mass] = self.tables(&projected);
        let count = projected.len();
        let matrix = |table: &[f64]| DMatrix::from_row_slice(count, count, table);
        let lower = Cholesky::new(matrix(&mass))
            .context("the natural modes are not independent in this bundle's basis; ask for fewer (--natural)")?
            .l();
        let solved = |m: DMatrix<f64>| lower.solve_lower_triangular(&m).context("a mass of zero");
        let reduced = solved(solved(matrix(&stiffness))?.transpose())?;
        let eigen = reduced.symmetric_eigen();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let vectors = lower
            .transpose()
            .solve_upper_triangular(&eigen.eigenvectors)
            .context("a mass of zero")?;
        for &at in &order {
            let mut mode = vec![0.0f32; self.prior.width()];
            for (q, &weight) in projected.iter().zip(vectors.column(at).iter()) {
                for (mode, q) in mode.iter_mut().zip(q) {
                    *mode += weight as f32 * q;
                }
            }
            normalise(&mut mode);
            self.modes.push(mode);
        }
        self.natural = count;
        Ok(order
            .iter()
            .map(|&at| eigen.eigenvalues[at].sqrt())
            .collect())
    }

    /// `Phi^T K Phi` (µN/mm) and `Phi^T M Phi` (g) of modes in block coordinates.
    fn tables(&self, modes: &[Vec<f32>]) -> [Vec<f64>; 2] {
        let free = &self.stiffness.free.nodes;
        let count = modes.len();
        let fields: Vec<Vec<f64>> = modes
            .iter()
            .map(|q| {
                let rows = free.iter().flat_map(|&node| {
                    [0, 1, 2].map(|axis| f64::from(self.prior.value_at(node, axis, |at| q[at])))
                });
                rows.collect()
            })
            .collect();
        let mut tables = [vec![0.0; count * count], vec![0.0; count * count]];
        for (i, field) in fields.iter().enumerate() {
            // mN to µN.
            let mut forces = self.stiffness.multiply(field);
            forces.iter_mut().for_each(|force| *force *= 1e3);
            let masses = free.iter().flat_map(|&node| [self.mass[node as usize]; 3]);
            let inertia: Vec<f64> = field.iter().zip(masses).map(|(u, m)| u * m).collect();
            for (j, other) in fields.iter().enumerate().skip(i) {
                for (table, image) in tables.iter_mut().zip([&forces, &inertia]) {
                    let value: f64 = image.iter().zip(other).map(|(a, b)| a * b).sum();
                    table[i * count + j] = value;
                    table[j * count + i] = value;
                }
            }
        }
        tables
    }

    /// More modes, as far as they say something new.
    pub fn add(&mut self, modes: impl Iterator<Item = Vec<f32>>) {
        let mut basis: Vec<Vec<f32>> = Vec::new();
        let orthogonal = |basis: &[Vec<f32>], mode: &mut [f32]| {
            for _ in 0..2 {
                for other in basis {
                    let part = dot(mode, other) as f32;
                    for (value, other) in mode.iter_mut().zip(other) {
                        *value -= part * other;
                    }
                }
            }
        };
        for mode in &self.modes {
            let mut mode = mode.clone();
            orthogonal(&basis, &mut mode);
            normalise(&mut mode);
            basis.push(mode);
        }
        for mut mode in modes {
            normalise(&mut mode);
            orthogonal(&basis, &mut mode);
            if normalise(&mut mode) > NEW {
                basis.push(mode.clone());
                self.modes.push(mode);
            }
        }
    }

    /// Writes the file; returns the number of modes.
    pub fn write(&self, path: &Path, frequency: &[f64]) -> std::io::Result<usize> {
        let (count, width) = (self.modes.len(), self.prior.width());
        let stored: Vec<f16> = self
            .modes
            .iter()
            .flatten()
            .map(|&value| f16::from_f32(value))
            .collect();
        let rounded: Vec<Vec<f32>> = stored
            .chunks_exact(width)
            .map(|mode| mode.iter().map(|value| value.to_f32()).collect())
            .collect();
        let narrow = |table: &[f64]| -> Vec<f32> { table.iter().map(|&v| v as f32).collect() };
        let tables = self.tables(&rounded).map(|table| narrow(&table));
        let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let [stiffness, mass] = &tables;
        let frequency: Vec<f32> = frequency.iter().map(|&omega| omega as f32).collect();
        let metadata = BTreeMap::from([
            ("format".to_owned(), "upt-corrections".to_owned()),
            ("version".to_owned(), "1".to_owned()),
        ]);
        let half = stored
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        write_file(
            path,
            &metadata,
            &[
                Tensor::new(
                    "frequency",
                    Dtype::F32,
                    vec![self.natural],
                    bytes(&frequency),
                ),
                Tensor::new("mass", Dtype::F32, vec![count, count], bytes(mass)),
                Tensor::new("modes", Dtype::F16, vec![count, width], half),
                Tensor::new(
                    "stiffness",
                    Dtype::F32,
                    vec![count, count],
                    bytes(stiffness),
                ),
            ],
        )?;
        Ok(count)
    }
}
