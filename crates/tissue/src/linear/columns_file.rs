//! Reads parts of a file of compliance columns that `upt prior` wrote (docs/reference/formats.md).
//!
//! The file is half a gigabyte at 21,708 nodes, and a contact needs a tenth of it: columns are read by node.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::Compliance;
use crate::mesh::{Boundary, Mesh};
use crate::tensors::{f32_values, i32_values};

/// A file of columns that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ColumnsError {
    #[error("{path}: {source}")]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path}: `{field}` {reason}; write the file again with `upt prior`")]
    Field {
        path: PathBuf,
        field: String,
        reason: String,
    },
}

/// An open file: the contact nodes and their mutual compliance are in memory, the columns are not.
#[derive(Debug)]
pub struct ColumnsFile {
    path: PathBuf,
    /// Mutual compliance of the contact nodes.
    pub compliance: Compliance,
    /// Byte where `columns` starts, and its row length `3K`.
    start: u64,
    width: usize,
}

impl ColumnsFile {
    /// Opens the file and checks that it was made for this mesh, boundary condition and Poisson's ratio.
    ///
    /// # Errors
    /// [`ColumnsError`], naming the field that is missing or differs. Young's modulus too must agree, relatively to 1e-9.
    pub fn open(
        path: &Path,
        mesh: &Mesh,
        boundary: Boundary,
        young_pa: f64,
        poisson: f64,
    ) -> Result<Self, ColumnsError> {
        let io = |source| ColumnsError::Io {
            path: path.into(),
            source,
        };
        let field = |field: &str, reason: String| ColumnsError::Field {
            path: path.into(),
            field: field.into(),
            reason,
        };
        let mut file = File::open(path).map_err(io)?;
        let mut head = vec![0; 8];
        file.read_exact(&mut head).map_err(io)?;
        let length = u64::from_le_bytes(head[..8].try_into().unwrap_or_default());
        if length > 1 << 20 {
            return Err(field("header", format!("has {length} bytes")));
        }
        head.resize(8 + length as usize, 0);
        file.read_exact(&mut head[8..]).map_err(io)?;
        // The `safetensors` crate wants the whole file in memory to read its header.
        let header: HashMap<String, serde_json::Value> = serde_json::from_slice(&head[8..])
            .map_err(|error| field("header", format!("is not safetensors ({error})")))?;

        let known = |key: &str| header.get("__metadata__")?.get(key)?.as_str();
        let text = |key: &str| known(key).ok_or_else(|| field(key, "is missing".into()));
        for (key, wanted) in [
            ("mesh_sha256", mesh.hash()),
            ("boundary", boundary.as_str().to_string()),
        ] {
            let found = text(key)?;
            if found != wanted {
                return Err(field(key, format!("is `{found}`, not `{wanted}`")));
            }
        }
        for (key, wanted) in [("young_pa", young_pa), ("poisson", poisson)] {
            let found = text(key)?;
            if !(found.parse::<f64>()).is_ok_and(|v| (v - wanted).abs() <= 1e-9 * wanted.abs()) {
                return Err(field(key, format!("is {found}, not {wanted}")));
            }
        }

        let offset = 8 + length;
        let place = |name: &str, dtype: &str| -> Result<(u64, Vec<usize>), ColumnsError> {
            let entry = header.get(name).cloned().unwrap_or_default();
            let entry: Entry = serde_json::from_value(entry)
                .map_err(|error| field(name, format!("is no tensor ({error})")))?;
            if entry.dtype != dtype {
                return Err(field(name, format!("is {}, not {dtype}", entry.dtype)));
            }
            Ok((offset + entry.data_offsets[0], entry.shape))
        };
        let (start, shape) = place("columns", "F32")?;
        let (nodes_at, nodes_shape) = place("contact_nodes", "I32")?;
        let (block_at, block_shape) = place("compliance", "F32")?;
        let (count, width) = (nodes_shape.iter().product::<usize>(), 3 * mesh.node_count());
        if shape != [3 * count, width] || block_shape != [3 * count, 3 * count] {
            return Err(field(
                "columns",
                format!(
                    "has shape {shape:?} and `compliance` {block_shape:?} for {count} contact nodes"
                ),
            ));
        }
        let mut read = |at: u64, bytes: usize| -> Result<Vec<u8>, ColumnsError> {
            let mut out = vec![0; bytes];
            file.seek(SeekFrom::Start(at)).map_err(io)?;
            file.read_exact(&mut out).map_err(io)?;
            Ok(out)
        };
        let nodes = read(nodes_at, 4 * count)?;
        let block = read(block_at, 36 * count * count)?;
        Ok(Self {
            path: path.into(),
            compliance: Compliance {
                nodes: i32_values(&nodes).map(|node| node as u32).collect(),
                block: f32_values(&block).map(f64::from).collect(),
            },
            start,
            width,
        })
    }

    /// Hands every column `[3K]`, mm/mN, with its number to `take`, in order: one pass through the file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn each_column(&self, mut take: impl FnMut(usize, &[f32])) -> Result<(), ColumnsError> {
        let io = |source| ColumnsError::Io {
            path: self.path.clone(),
            source,
        };
        let mut file = File::open(&self.path).map_err(io)?;
        file.seek(SeekFrom::Start(self.start)).map_err(io)?;
        let mut file = std::io::BufReader::with_capacity(1 << 22, file);
        let mut bytes = vec![0; 4 * self.width];
        let mut column = vec![0.0f32; self.width];
        for at in 0..3 * self.compliance.nodes.len() {
            file.read_exact(&mut bytes).map_err(io)?;
            for (value, read) in column.iter_mut().zip(f32_values(&bytes)) {
                *value = read;
            }
            take(at, &column);
        }
        Ok(())
    }

    /// Columns `[3m, 3K]` of the nodes in `rows` (indices into the contact nodes), mm/mN.
    ///
    /// # Errors
    /// The file cannot be read.
    ///
    /// # Panics
    /// If a row is not below the number of contact nodes.
    pub fn columns(&self, rows: &[usize]) -> Result<Vec<f32>, ColumnsError> {
        let io = |source| ColumnsError::Io {
            path: self.path.clone(),
            source,
        };
        let mut file = File::open(&self.path).map_err(io)?;
        let mut bytes = vec![0; 12 * self.width];
        let mut out = Vec::with_capacity(3 * rows.len() * self.width);
        for &row in rows {
            assert!(row < self.compliance.nodes.len(), "row {row}");
            let at = self.start + 12 * (row * self.width) as u64;
            file.seek(SeekFrom::Start(at)).map_err(io)?;
            file.read_exact(&mut bytes).map_err(io)?;
            out.extend(f32_values(&bytes));
        }
        Ok(out)
    }
}

/// A tensor as the header lists it.
#[derive(serde::Deserialize)]
struct Entry {
    dtype: String,
    shape: Vec<usize>,
    data_offsets: [u64; 2],
}
