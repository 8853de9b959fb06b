//! `vibration.safetensors`: the natural modes in block coordinates (`docs/reference/formats.md`).

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use tissue::mesh::{Mesh, tet_volume};
use tissue::tensors::{Dtype, Tensor, write_file};

use super::options::Options;
use super::projected::Projected;
use crate::modes;

/// Number of modes: as asked, but at most a sixth of the free degrees of freedom.
pub fn count(mesh: &Mesh, options: &Options) -> usize {
    let free = 3 * (mesh.node_count() - mesh.held_nodes(options.boundary).len());
    options.natural.min(free / 6).max(1)
}

/// What `upt modes` writes.
pub struct Modes {
    /// rad/s.
    pub frequency: Vec<f64>,
    /// `[m,3K]`, mass-normalised, kg^-1/2.
    pub fields: Vec<f32>,
}

impl Modes {
    /// Reads the file.
    pub fn read(path: &Path) -> Result<Self> {
        let found = modes::read(path)?;
        Ok(Self {
            frequency: found.frequency,
            fields: found.modes.iter().map(|&value| value as f32).collect(),
        })
    }

    /// Each mode with its largest component 1, `[m,3K]`, and that component of the mass-normalised one.
    pub fn scaled(&self) -> (Vec<f32>, Vec<f32>) {
        let width = self.fields.len() / self.frequency.len();
        let largest: Vec<f32> = self
            .fields
            .chunks_exact(width)
            .map(|mode| mode.iter().fold(0.0f32, |most, x| most.max(x.abs())))
            .collect();
        let fields = self.fields.chunks_exact(width).zip(&largest);
        (
            fields
                .flat_map(|(mode, most)| mode.iter().map(move |x| x / most))
                .collect(),
            largest,
        )
    }

    /// Amplitude of each mode of largest component 1 under a unit force at each contact dof, `[3D,m]`, mm/mN:
    /// `z = phi_max phi(dof) / omega²`.
    pub fn force_to_mode(&self, contact_nodes: &[u32]) -> Vec<f32> {
        let width = self.fields.len() / self.frequency.len();
        let (_, largest) = self.scaled();
        contact_nodes
            .iter()
            .flat_map(|&node| [0, 1, 2].map(|axis| 3 * node as usize + axis))
            .flat_map(|dof| {
                let modes = self.frequency.iter().zip(&largest).enumerate();
                modes
                    .map(|(k, (omega, most))| {
                        let here = f64::from(self.fields[k * width + dof]);
                        (f64::from(*most) * here / (omega * omega)) as f32
                    })
                    .collect::<Vec<f32>>()
            })
            .collect()
    }

    /// `phi_max M phi` `[m,3K]`: its product with a field is the amplitude of the mode in it.
    pub fn weighted(&self, mesh: &Mesh, density_kg_m3: f64) -> Vec<f32> {
        let mut mass = vec![0.0; mesh.node_count()];
        for (at, tet) in mesh.tets.iter().enumerate() {
            let density = mesh.laws().density_of(at, density_kg_m3);
            let share = 0.25e-9 * density * tet_volume(&mesh.positions, *tet);
            tet.iter().for_each(|&node| mass[node as usize] += share);
        }
        let (_, largest) = self.scaled();
        self.fields
            .chunks_exact(3 * mesh.node_count())
            .zip(&largest)
            .flat_map(|(mode, most)| {
                let masses = mass.iter().flat_map(|m| [*m; 3]);
                mode.iter()
                    .zip(masses)
                    .map(move |(x, m)| (f64::from(*x) * m) as f32 * most)
            })
            .collect()
    }
}

/// Writes the tables; `modes` and `projection` in block coordinates `[m,Q]`.
pub fn write(
    path: &Path,
    modes: &Modes,
    force_to_mode: &[f32],
    fields: &Projected,
    projection: &Projected,
) -> Result<()> {
    let count = modes.frequency.len();
    let bytes = |values: &[f32]| {
        values
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let frequency: Vec<f32> = modes.frequency.iter().map(|&omega| omega as f32).collect();
    let metadata = BTreeMap::from([
        ("format".to_owned(), "upt-vibration".to_owned()),
        ("version".to_owned(), "1".to_owned()),
    ]);
    write_file(
        path,
        &metadata,
        &[
            Tensor::new(
                "force_to_mode",
                Dtype::F32,
                vec![force_to_mode.len() / count, count],
                bytes(force_to_mode),
            ),
            Tensor::new("frequency", Dtype::F32, vec![count], bytes(&frequency)),
            Tensor::new(
                "modes",
                Dtype::F32,
                vec![count, fields.width],
                bytes(&fields.rows()),
            ),
            Tensor::new(
                "projection",
                Dtype::F32,
                vec![count, projection.width],
                bytes(&projection.rows()),
            ),
        ],
    )
    .with_context(|| format!("{}: cannot be written", path.display()))
}
