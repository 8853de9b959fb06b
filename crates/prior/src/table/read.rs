//! `prior.safetensors`, read and checked.
//!
//! Every length, index and order is checked here and nowhere else: kernels and solves index these
//! tables in each step without looking. A fault is an error that names the file, the tensor and the
//! element; no panic and no allocation out of proportion comes of a damaged file.

use std::sync::Arc;

use safetensors::tensor::Dtype;

use super::blocks::Blocks;
use super::{LearnedTables, NO_COLUMN, PriorTable};
use crate::compliance::Compliance;
use crate::numbers::{Numbers, fits};
use crate::response_table::Response;
use crate::stepped;
use crate::vibration::FreeVibration;
use bundle::{BundleFiles, Manifest, ManifestKind, Mesh, PriorEntry, TensorFile};
use field::error::Result;
use field::grid::{PointGrid, squared_distance};
use field::memory;

const WHAT: &str = "the linear response";
/// How far outside the domain a contact node borrows a column, in typical edges of the domain. A
/// collision field may reach a few nodes beyond it; what is farther is answered by nothing, and the
/// step reports it ([`super::super::SolveReport`]).
const REACH: f64 = 4.0;

impl PriorTable {
    /// Reads and checks the tables that the manifest's entry names.
    ///
    /// # Errors
    /// [`field::Error::Bundle`] of what does not fit the manifest, the mesh or another table,
    /// [`field::Error::OutOfMemory`].
    pub fn open(files: &BundleFiles, entry: &PriorEntry, mesh: &Mesh) -> Result<PriorTable> {
        let manifest = &files.manifest;
        let tables = files.tensors(&entry.file)?;
        // The residual modes may have a file of their own: a body without a predictor leaves them
        // out.
        let learned = (entry.residual.as_ref()).map(|name| files.tensors(name));
        let learned = learned.transpose()?;
        let learned = learned.as_ref().unwrap_or(&tables);
        let mut table = PriorTable::parse(&tables, learned, manifest, mesh)?;
        if let Some(name) = &entry.vibration {
            let mut vibration = FreeVibration::parse(
                &files.tensors(name)?,
                [3 * table.contact_nodes.len(), table.width()],
                manifest.material.damping_per_s,
                manifest.dt_s,
                match manifest.kind {
                    ManifestKind::Upt => false,
                    ManifestKind::Reduced => true,
                },
            )?;
            if let Some(name) = &entry.release {
                vibration.learn(&files.tensors(name)?, table.width())?;
            }
            table.vibration = Some(vibration);
        }
        Ok(table)
    }

    /// Reads the tables and checks every length, index and order once, here: kernels and solves rely on them without looking.
    /// The residual modes and what belongs to them are in `learned`, which may be the same file.
    fn parse(
        file: &TensorFile,
        learned: &TensorFile,
        manifest: &Manifest,
        mesh: &Mesh,
    ) -> Result<PriorTable> {
        let count = mesh.node_count();
        let contact_nodes = file.ascending("contact_nodes", count)?;
        if contact_nodes.is_empty() {
            return Err(file.bad("contact_nodes", "must not be empty"));
        }
        let dofs = 3 * contact_nodes.len();
        let block_nodes = file.indices("block_nodes", &[Some(count)], count)?;
        let mut seen = memory::filled(count, false, WHAT)?;
        for (at, &node) in block_nodes.iter().enumerate() {
            if std::mem::replace(&mut seen[node as usize], true) {
                return Err(file.bad(
                    "block_nodes",
                    format!("element {at}: node {node} is there twice"),
                ));
            }
        }
        let block_offsets = file.offsets("block_offsets", count)?;
        if block_offsets.last() != Some(&count) {
            return Err(file.bad("block_offsets", format!("must end with {count}")));
        }
        let rank_offsets = file.offsets("rank_offsets", 1 << 28)?;
        if rank_offsets.len() != block_offsets.len() {
            return Err(file.bad(
                "rank_offsets",
                format!(
                    "has {} elements, must have {}",
                    rank_offsets.len(),
                    block_offsets.len()
                ),
            ));
        }
        if let Some(at) = rank_offsets
            .windows(2)
            .position(|pair| !(pair[1] - pair[0]).is_multiple_of(8))
        {
            return Err(file.bad(
                "rank_offsets",
                format!("rank of block {at} is not a multiple of 8"),
            ));
        }
        // `Q`, and the numbers of all blocks' bases together.
        let width = *rank_offsets.last().unwrap_or(&0);
        let size: usize = block_offsets
            .windows(2)
            .zip(rank_offsets.windows(2))
            .map(|(nodes, ranks)| 3 * (nodes[1] - nodes[0]) * (ranks[1] - ranks[0]))
            .sum();
        // Three rows a node, in the order of the blocks: what every later table refers to.
        let places = basis_places(&block_nodes, &block_offsets, &rank_offsets)?;
        let compliance = Compliance::read(file, contact_nodes.len(), |i| {
            places[contact_nodes[i] as usize]
        })?;
        // Empty where the manifest names no modes: a bundle without a learned map has none.
        let optional = |name: &str, shape: [usize; 2]| {
            if shape[1] > 0 {
                learned.float(name, &[Some(shape[0]), Some(shape[1])])
            } else {
                Ok(Vec::new())
            }
        };
        let (modes, response_modes) = manifest
            .reduced
            .as_ref()
            .map_or((0, 0), |reduced| (reduced.modes, reduced.response_modes));
        // A contact outside of the domain is answered by the nearest column, and told of by a flag.
        let mut in_domain = memory::filled(count, false, WHAT)?;
        for &node in &mesh.domain.nodes {
            in_domain[node as usize] = true;
        }
        let response = if stepped::is_stepped(file, "response") {
            stepped::response(file, contact_nodes.len(), &rank_offsets)?
        } else if file.has(RANKS) {
            ragged(file, contact_nodes.len(), &rank_offsets)?
        } else {
            let shape = [Some(dofs), Some(width)];
            Response::Whole(Numbers::read(file, "response", &shape)?)
        };
        let basis = if stepped::is_stepped(file, "basis") {
            Numbers::of_f16(stepped::basis(file, &block_offsets, &rank_offsets, size)?)?
        } else {
            Numbers::read(file, "basis", &[Some(size)])?
        };
        let narrow = |values: Vec<usize>| {
            let narrow = values.iter().map(|&value| value as u32);
            memory::collected(values.len(), narrow, WHAT)
        };
        Ok(PriorTable {
            nearest_column: nearest_columns(mesh, &contact_nodes)?,
            in_domain,
            contact_nodes,
            sources: Vec::new(),
            compliance: Arc::new(compliance),
            blocks: Blocks {
                nodes: block_nodes,
                offsets: narrow(block_offsets)?,
                rank_offsets: narrow(rank_offsets)?,
                copies: None,
                numbers: Arc::new(basis),
                places,
            },
            response: Arc::new(response),
            learned: LearnedTables {
                residual: if modes > 0 {
                    learned.float("residual", &[Some(modes), Some(width)])?
                } else {
                    Vec::new()
                },
                force_to_z: optional("force_to_z", [dofs, response_modes])?,
                force_to_p: optional("force_to_p", [dofs, modes])?,
            },
            vibration: None,
        })
    }
}

/// How many coordinates of each block a contact node's rows hold, in eights.
const RANKS: &str = "response_ranks";

/// A response that holds of each block the leading coordinates alone, `[3D,Q]`: what a contact node does not reach is zero.
fn ragged(file: &TensorFile, columns: usize, rank_offsets: &[usize]) -> Result<Response> {
    let blocks = rank_offsets.len() - 1;
    let width = rank_offsets[blocks];
    let kept = file.raw(RANKS, Dtype::U8, &[Some(columns), Some(blocks)])?;
    let mut count = 0;
    for (at, &eights) in kept.iter().enumerate() {
        let block = at % blocks;
        if 8 * usize::from(eights) > rank_offsets[block + 1] - rank_offsets[block] {
            let (node, rank) = (at / blocks, rank_offsets[block + 1] - rank_offsets[block]);
            let problem = format!(
                "element [{node}, {block}] is {eights} times 8, more than the rank {rank} of its block"
            );
            return Err(file.bad(RANKS, problem));
        }
        count += 24 * usize::from(eights);
    }
    let stored = file.f16("response", &[Some(count)])?;
    fits(
        file,
        RANKS,
        (3 * columns).checked_mul(width),
        kept.len() + count,
    )?;
    Response::leading(stored, memory::copied(kept, WHAT)?, rank_offsets)
}

/// By node: where its three rows in the basis start, where the coordinates of its block start, and how many.
pub(super) fn basis_places(
    block_nodes: &[u32],
    block_offsets: &[usize],
    rank_offsets: &[usize],
) -> Result<Vec<(u32, u32, u32)>> {
    let mut places = memory::filled(block_nodes.len(), (0, 0, 0), WHAT)?;
    let mut start = 0;
    for (nodes, ranks) in block_offsets.windows(2).zip(rank_offsets.windows(2)) {
        let rank = ranks[1] - ranks[0];
        for &node in &block_nodes[nodes[0]..nodes[1]] {
            places[node as usize] = (start as u32, ranks[0] as u32, rank as u32);
            start += 3 * rank;
        }
    }
    Ok(places)
}

/// For each node the nearest of `contact_nodes` (ties: the smallest index), by a cell grid.
fn nearest_columns(mesh: &Mesh, contact_nodes: &[u32]) -> Result<Vec<u32>> {
    let points = contact_nodes.iter().flat_map(|&node| mesh.position(node));
    let points = memory::collected(3 * contact_nodes.len(), points, WHAT)?;
    let grid = PointGrid::try_new(points)?;
    let area: f64 = contact_nodes
        .iter()
        .map(|&node| mesh.surface.node_area[node as usize] as f64)
        .sum();
    // The side of a square of a contact node's mean area.
    let edge = (area / contact_nodes.len() as f64).sqrt();
    let columns = (0..mesh.node_count() as u32).map(|node| {
        let p = mesh.position(node);
        let column = grid.nearest(p);
        let d2 = squared_distance(p, mesh.position(contact_nodes[column as usize]));
        if d2.sqrt() <= REACH * edge {
            column
        } else {
            NO_COLUMN
        }
    });
    memory::collected(mesh.node_count(), columns, WHAT)
}
