//! Compliance columns of the nodes that instruments may touch.
//!
//! Writes `columns [3D,3K]` (mm/mN, the field of a unit force at each contact degree of freedom),
//! `compliance [3D,3D]` and `contact_nodes [D]` as one safetensors file, streamed: memory is the
//! sparse factor and one batch of columns. An interrupted run leaves its columns in `*.partial`, and the same command goes on there. `python -m upt_training.reduced` builds bundles from it.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use serde_json::json;
use tissue::linear::{Factor, Lame, LinearError, Stiffness, remaining_columns};
use tissue::mesh::{Boundary, Mesh};

use crate::Watch;

/// What to solve, and where to write.
#[derive(Clone, Debug)]
pub struct Options {
    /// Mesh file (`*.mesh.safetensors`) with a domain and held nodes.
    pub mesh: PathBuf,
    /// Held node sets.
    pub boundary: Boundary,
    /// File to write.
    pub out: PathBuf,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Right-hand sides solved together.
    pub batch: usize,
    /// 0: all.
    pub threads: usize,
    pub watch: Watch,
}

/// Nodes of the domain's faces that are not held, ascending.
fn contact_nodes(mesh: &Mesh, held: &[u32]) -> Vec<u32> {
    let mut nodes: Vec<u32> = mesh
        .domain
        .iter()
        .flat_map(|&face| mesh.surface[face as usize])
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.retain(|node| held.binary_search(node).is_err());
    nodes
}

/// Header of a safetensors file whose tensors follow in the given order (name, dtype, shape).
pub fn header(tensors: &[(&str, &str, [usize; 2])], metadata: serde_json::Value) -> Vec<u8> {
    let mut object = serde_json::Map::new();
    object.insert("__metadata__".to_string(), metadata);
    let mut offset = 0usize;
    for (name, dtype, shape) in tensors {
        let end = offset + 4 * shape[0] * shape[1];
        let dims: Vec<usize> = if shape[1] == 1 {
            vec![shape[0]]
        } else {
            shape.to_vec()
        };
        object.insert(
            (*name).to_string(),
            json!({"dtype": dtype, "shape": dims, "data_offsets": [offset, end]}),
        );
        offset = end;
    }
    let mut text = serde_json::Value::Object(object).to_string().into_bytes();
    text.resize(text.len().next_multiple_of(8), b' ');
    let mut bytes = (text.len() as u64).to_le_bytes().to_vec();
    bytes.extend(text);
    bytes
}

pub fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

/// A file of columns that is being written.
struct Partial {
    path: PathBuf,
    head: usize,
    /// Columns that are there, whole batches.
    done: usize,
    out: BufWriter<File>,
}

impl Partial {
    /// Opens the file behind its last whole batch if it begins with `head`; begins it anew otherwise. `row` is in bytes.
    fn open(
        path: &Path,
        head: &[u8],
        row: usize,
        rows: usize,
        batch: usize,
    ) -> std::io::Result<Self> {
        let mut file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        let length = file.metadata()?.len() as usize;
        let mut found = vec![0; head.len().min(length)];
        file.read_exact(&mut found)?;
        let done = if found == head {
            (length - head.len()) / (row * batch.max(1)) * batch.max(1)
        } else {
            0
        };
        let done = done.min(rows);
        if done == 0 {
            file.set_len(0)?;
            file.rewind()?;
            file.write_all(head)?;
        } else {
            file.set_len((head.len() + done * row) as u64)?;
            file.seek(SeekFrom::End(0))?;
        }
        Ok(Self {
            path: path.into(),
            head: head.len(),
            done,
            out: BufWriter::with_capacity(1 << 22, file),
        })
    }

    /// Reads the columns from the first on.
    fn reader(&self) -> std::io::Result<BufReader<File>> {
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(self.head as u64))?;
        Ok(BufReader::with_capacity(1 << 22, file))
    }
}

/// What was written.
pub struct Written {
    /// Columns, and the degrees of freedom of each.
    pub rows: usize,
    pub width: usize,
    pub factor_entries: usize,
    pub factor_seconds: f64,
    pub solve_seconds: f64,
}

/// Columns that are there.
#[derive(Clone, Copy, Debug)]
pub struct Made {
    /// All of them, and how many of them in this run.
    pub done: usize,
    pub here: usize,
    /// How many there will be.
    pub rows: usize,
    /// Time for those of this run, s.
    pub seconds: f64,
}

/// Solves for the columns and writes the file. `go_on` hears of the columns before each batch, and may end it there: what is written
/// stays, and the next call goes on from it.
pub fn write_columns(
    args: &Options,
    go_on: &mut dyn FnMut(Made) -> anyhow::Result<()>,
) -> anyhow::Result<Written> {
    let mesh = Mesh::read(&args.mesh)?;
    let held = mesh.held_nodes(args.boundary);
    let nodes = contact_nodes(&mesh, &held);
    if nodes.is_empty() {
        bail!(
            "{}: the set `domain` has no free node, so nothing can be touched",
            args.mesh.display()
        );
    }
    let lame = Lame::from_young(args.young, args.poisson)?;
    let started = Instant::now();
    let stiffness = Stiffness::assemble(&mesh, &held, lame)?;
    let factor = Factor::new(&stiffness, &mesh.positions, args.threads)?;
    let stats = factor.stats(&stiffness);
    let factor_seconds = started.elapsed().as_secs_f64();
    args.watch.tell(&format!(
        "{} free dofs, {} entries in the factor ({:.2} GiB), {factor_seconds:.1} s",
        stats.dofs,
        stats.factor_entries,
        stats.factor_bytes as f64 / (1u64 << 30) as f64
    ));

    let (rows, width) = (3 * nodes.len(), 3 * mesh.node_count());
    let metadata = json!({
        "format": "upt-compliance", "version": "1", "mesh_name": mesh.name, "mesh_sha256": mesh.hash(),
        "boundary": args.boundary.as_str(), "young_pa": args.young.to_string(), "poisson": args.poisson.to_string(),
    });
    // The compliance block is known last, so it follows the columns.
    let head = header(
        &[
            ("columns", "F32", [rows, width]),
            ("compliance", "F32", [rows, rows]),
            ("contact_nodes", "I32", [nodes.len(), 1]),
        ],
        metadata,
    );
    let temporary = args.out.with_extension("partial");
    let mut partial = Partial::open(&temporary, &head, 4 * width, rows, args.batch)
        .with_context(|| format!("{}: cannot be opened", temporary.display()))?;
    let done = partial.done;
    if done > 0 {
        args.watch.tell(&format!(
            "{}: {done} of {rows} columns are finished",
            temporary.display()
        ));
    }
    let bar = args.watch.bar(rows as u64, "columns");
    let started = Instant::now();
    let mut bytes = vec![0; 4 * width];
    let mut source = partial.reader()?;
    let mut made = Made {
        done,
        here: 0,
        rows,
        seconds: 0.0,
    };
    if done < rows {
        go_on(made)?;
    }
    let mut ended = None;
    let compliance = remaining_columns(
        &stiffness,
        &factor,
        &nodes,
        args.batch,
        done,
        |_, row| {
            source.read_exact(&mut bytes)?;
            for (value, chunk) in row.iter_mut().zip(bytes.as_chunks().0) {
                *value = f32::from_le_bytes(*chunk);
            }
            Ok(())
        },
        |first, fields| {
            partial.out.write_all(&floats(fields.iter().copied()))?;
            made.done = first + fields.len() / width;
            made.here = made.done - done;
            made.seconds = started.elapsed().as_secs_f64();
            bar.set_position(made.done as u64);
            if made.done < rows
                && let Err(error) = go_on(made)
            {
                ended = Some(error);
                return Err(LinearError::Stopped);
            }
            Ok(())
        },
    );
    if let Some(error) = ended {
        partial
            .out
            .flush()
            .with_context(|| format!("{}: writing failed", temporary.display()))?;
        return Err(error);
    }
    let compliance = compliance?;
    let mut out = partial.out;
    drop(bar);
    let solve_seconds = started.elapsed().as_secs_f64();
    out.write_all(&floats(compliance.block.iter().map(|&a| a as f32)))?;
    for node in &nodes {
        out.write_all(&(*node as i32).to_le_bytes())?;
    }
    out.into_inner()
        .map_err(|e| e.into_error())
        .and_then(|file| file.sync_all())
        .with_context(|| format!("{}: writing failed", temporary.display()))?;
    std::fs::rename(&temporary, &args.out)
        .with_context(|| format!("{}: cannot be renamed", temporary.display()))?;
    Ok(Written {
        rows,
        width,
        factor_entries: stats.factor_entries,
        factor_seconds,
        solve_seconds,
    })
}
