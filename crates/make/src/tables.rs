//! `prior.safetensors`: the compliance columns in block-wise bases (`docs/reference/formats.md`), and the natural modes in the same.
//!
//! The basis of a block spans what sampled contacts do there, and the natural modes with the amplitudes that these contacts give
//! them. The columns are read once for as many blocks as have room in memory together.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use half::f16;
use tissue::linear::{Blocks, ColumnsFile, Compliance, leading_directions};
use tissue::mesh::Mesh;
use tissue::tensors::{Dtype, Tensor, write_file};

use super::clock::{self, Clock};
use super::options::Options;
use super::patches::{self, Forces};
use super::projected::Projected;
use super::sizes::Sizes;
use super::stages::Stage;
use super::vibration::{self, Modes};

/// Nodes of a block, at most.
const BLOCK: usize = 192;
/// Rank of a block, at most.
const MOST: usize = 256;
/// Memory for columns, bytes.
const MEMORY: usize = 1 << 30;
/// Neighbours within so many radii of the largest contact have exact compliance, the others' comes from the response.
const NEAR: f64 = 1.0;

/// Writes `prior.safetensors` and `vibration.safetensors` into the stage's folder.
pub fn make(
    options: &Options,
    mesh: &Mesh,
    columns: &ColumnsFile,
    modes: &Modes,
    sizes: &Sizes,
    clock: &Clock,
    stage: &mut Stage,
) -> Result<()> {
    let go_on = |what: &str| clock.go_on(clock::TABLES, what);
    let compliance = &columns.compliance;
    let width = 3 * mesh.node_count();
    let samples = patches::sample(
        mesh,
        compliance,
        sizes,
        (3 * compliance.nodes.len() / 2).clamp(512, 3000),
        options.seed ^ 0x5A3F,
        &|| go_on("the tables are not begun"),
    )?;
    let force_to_mode = modes.force_to_mode(&compliance.nodes);
    let (fields, _) = modes.scaled();
    let weighted = modes.weighted(mesh, options.material()?.density_kg_m3);
    let amplitudes = amplitudes(&samples, &force_to_mode, modes.frequency.len());

    let blocks = Blocks::new(&mesh.positions, &mesh.surface, BLOCK);
    let contacts = 3 * compliance.nodes.len();
    let mut response = Projected::new(contacts);
    let mut shapes = Projected::new(modes.frequency.len());
    let mut projection = Projected::new(modes.frequency.len());
    let (mut basis, mut ranks, mut lost) = (Vec::new(), vec![0usize], 0.0);
    let bar = options.watch.bar(blocks.count() as u64, "blocks");
    for group in groups(&blocks, contacts) {
        let dofs: Vec<usize> = group
            .clone()
            .flat_map(|block| blocks.nodes_of(block))
            .flat_map(|&node| [0, 1, 2].map(|axis| 3 * node as usize + axis))
            .collect();
        // The group's part of the columns, [3D, dofs].
        let mut part = Vec::with_capacity(contacts * dofs.len());
        columns.each_column(|_, column| part.extend(dofs.iter().map(|&dof| column[dof])))?;
        let mut start = 0;
        for block in group {
            go_on(&format!(
                "{block} of {} blocks of the tables are made",
                blocks.count()
            ))?;
            let size = 3 * blocks.nodes_of(block).len();
            let here = start..start + size;
            start += size;
            let of_column = |row: usize| &part[row * dofs.len()..][here.clone()];
            let of_field = |fields: &[f32], row: usize| -> Vec<f32> {
                dofs[here.clone()]
                    .iter()
                    .map(|&dof| fields[row * width + dof])
                    .collect()
            };
            let mut sampled = Vec::with_capacity((samples.len() + amplitudes.len()) * size);
            let weight = 1.0 / (samples.len() as f32).sqrt();
            for forces in &samples {
                let at = sampled.len();
                sampled.resize(at + size, 0.0f32);
                for &(row, force) in forces {
                    for (u, a) in sampled[at..].iter_mut().zip(of_column(row as usize)) {
                        *u += weight * force * a;
                    }
                }
            }
            for (row, amplitude) in amplitudes.iter().enumerate() {
                sampled.extend(of_field(&fields, row).iter().map(|u| u * amplitude));
            }
            let found = leading_directions(&sampled, size, options.tolerance_mm, MOST)
                .map_err(|reason| anyhow!("{reason}"))?;
            let rank = found.rank;
            response.push(
                (0..contacts).map(|row| of_column(row).to_vec()),
                &found.values,
                rank,
            );
            for (rows, source) in [(&mut shapes, &fields), (&mut projection, &weighted)] {
                rows.push(
                    (0..amplitudes.len()).map(|row| of_field(source, row)),
                    &found.values,
                    rank,
                );
            }
            ranks.push(ranks[ranks.len() - 1] + rank);
            basis.extend(found.values.iter().map(|&value| f16::from_f32(value)));
            lost += found.lost_mm2;
            bar.inc(1);
        }
    }
    drop(bar);
    let rms = (lost / mesh.node_count() as f64).sqrt();
    stage.decided(&format!(
        "{} blocks with {} coordinates; what they leave out of typical pushes is {:.1e} mm in the mean square",
        blocks.count(),
        response.width,
        rms
    ));
    let prior = Prior {
        mesh,
        compliance,
        blocks: &blocks,
        ranks: &ranks,
        basis: &basis,
        response: &response,
    };
    let near_mm = 2.0 * NEAR * (sizes.area_mm2[1] / std::f64::consts::PI).sqrt();
    prior.write(&stage.folder.join("prior.safetensors"), near_mm)?;
    vibration::write(
        &stage.folder.join("vibration.safetensors"),
        modes,
        &force_to_mode,
        &shapes,
        &projection,
    )
}

/// Root mean square of each mode's amplitude over the samples, mm.
fn amplitudes(samples: &[Forces], force_to_mode: &[f32], count: usize) -> Vec<f32> {
    let mut squares = vec![0.0f64; count];
    for forces in samples {
        let mut z = vec![0.0f64; count];
        for &(row, force) in forces {
            for (z, to) in z.iter_mut().zip(&force_to_mode[row as usize * count..]) {
                *z += f64::from(force * to);
            }
        }
        squares
            .iter_mut()
            .zip(&z)
            .for_each(|(sum, z)| *sum += z * z);
    }
    squares
        .iter()
        .map(|sum| (sum / samples.len() as f64).sqrt() as f32)
        .collect()
}

/// Consecutive blocks whose columns fit into the memory together.
fn groups(blocks: &Blocks, contacts: usize) -> Vec<Range<usize>> {
    let mut groups: Vec<Range<usize>> = Vec::new();
    let mut used = usize::MAX;
    for block in 0..blocks.count() {
        let bytes = 12 * contacts * blocks.nodes_of(block).len();
        if used.saturating_add(bytes) > MEMORY {
            groups.push(block..block + 1);
            used = bytes;
        } else {
            used += bytes;
            if let Some(last) = groups.last_mut() {
                last.end = block + 1;
            }
        }
    }
    groups
}

/// The parts of the file.
struct Prior<'a> {
    mesh: &'a Mesh,
    compliance: &'a Compliance,
    blocks: &'a Blocks,
    ranks: &'a [usize],
    basis: &'a [f16],
    response: &'a Projected,
}

impl Prior<'_> {
    fn write(&self, path: &Path, near_mm: f64) -> Result<()> {
        let nodes = &self.compliance.nodes;
        let count = nodes.len();
        let stride = 3 * count;
        let points: Vec<[f64; 3]> = nodes
            .iter()
            .map(|&node| self.mesh.positions[node as usize].map(f64::from))
            .collect();
        let (mut offsets, mut near, mut values) = (vec![0usize], Vec::new(), Vec::new());
        for i in 0..count {
            for j in i..count {
                let squared: f64 = (0..3).map(|k| (points[i][k] - points[j][k]).powi(2)).sum();
                if squared > near_mm * near_mm {
                    continue;
                }
                near.push(j);
                for a in 0..3 {
                    for b in 0..3 {
                        values.push(self.compliance.block[(3 * i + a) * stride + 3 * j + b] as f32);
                    }
                }
            }
            offsets.push(near.len());
        }
        let ints = |values: &[usize]| -> Vec<u8> {
            values
                .iter()
                .flat_map(|&v| (v as i32).to_le_bytes())
                .collect()
        };
        let indices = |values: &[u32]| -> Vec<u8> {
            values
                .iter()
                .flat_map(|&v| (v as i32).to_le_bytes())
                .collect()
        };
        let halves =
            |values: &[f16]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
        let response: Vec<f16> = self
            .response
            .rows()
            .iter()
            .map(|&v| f16::from_f32(v))
            .collect();
        let metadata = BTreeMap::from([
            ("format".to_owned(), "upt-prior".to_owned()),
            ("version".to_owned(), "1".to_owned()),
            ("mesh_sha256".to_owned(), self.mesh.hash()),
        ]);
        write_file(
            path,
            &metadata,
            &[
                Tensor::new(
                    "basis",
                    Dtype::F16,
                    vec![self.basis.len()],
                    halves(self.basis),
                ),
                Tensor::new(
                    "block_nodes",
                    Dtype::I32,
                    vec![self.blocks.nodes.len()],
                    indices(&self.blocks.nodes),
                ),
                Tensor::new(
                    "block_offsets",
                    Dtype::I32,
                    vec![self.blocks.offsets.len()],
                    ints(&self.blocks.offsets),
                ),
                Tensor::new("contact_nodes", Dtype::I32, vec![count], indices(nodes)),
                Tensor::new(
                    "near_compliance",
                    Dtype::F32,
                    vec![near.len(), 9],
                    values.iter().flat_map(|v: &f32| v.to_le_bytes()).collect(),
                ),
                Tensor::new("near_nodes", Dtype::I32, vec![near.len()], ints(&near)),
                Tensor::new(
                    "near_offsets",
                    Dtype::I32,
                    vec![offsets.len()],
                    ints(&offsets),
                ),
                Tensor::new(
                    "rank_offsets",
                    Dtype::I32,
                    vec![self.ranks.len()],
                    ints(self.ranks),
                ),
                Tensor::new(
                    "response",
                    Dtype::F16,
                    vec![stride, self.response.width],
                    halves(&response),
                ),
            ],
        )
        .with_context(|| format!("{}: cannot be written", path.display()))
    }
}
