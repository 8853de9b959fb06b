//! Deterministic safetensors writing: the same values always give the same bytes.
//!
//! The `safetensors` crate reads; it writes its metadata in hash-map order, so
//! two runs of one simulation would differ. Here keys are sorted, tensors keep
//! the caller's order, and a file appears whole or not at all (temp + rename).

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Element types that the project's files use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dtype {
    F16,
    F32,
    I32,
}

impl Dtype {
    fn name(self) -> &'static str {
        match self {
            Dtype::F16 => "F16",
            Dtype::F32 => "F32",
            Dtype::I32 => "I32",
        }
    }

    fn size(self) -> usize {
        match self {
            Dtype::F16 => 2,
            Dtype::F32 | Dtype::I32 => 4,
        }
    }
}

/// A named tensor as little-endian bytes.
pub struct Tensor {
    name: String,
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl Tensor {
    /// Panics when `bytes` does not hold `shape` elements of `dtype`.
    pub fn new(name: &str, dtype: Dtype, shape: Vec<usize>, bytes: Vec<u8>) -> Self {
        assert_eq!(
            bytes.len(),
            shape.iter().product::<usize>() * dtype.size(),
            "tensor `{name}`: bytes do not match shape {shape:?}"
        );
        Self {
            name: name.into(),
            dtype,
            shape,
            bytes,
        }
    }
}

/// Writes the tensors to `path` through a temporary file next to it.
pub fn write_file(
    path: &Path,
    metadata: &BTreeMap<String, String>,
    tensors: &[Tensor],
) -> std::io::Result<()> {
    let mut header = serde_json::Map::new();
    header.insert("__metadata__".into(), serde_json::json!(metadata));
    let mut start = 0;
    for tensor in tensors {
        let end = start + tensor.bytes.len();
        header.insert(
            tensor.name.clone(),
            serde_json::json!({
                "dtype": tensor.dtype.name(),
                "shape": tensor.shape,
                "data_offsets": [start, end],
            }),
        );
        start = end;
    }
    let mut header = serde_json::to_vec(&header)?;
    header.resize(header.len().next_multiple_of(8), b' ');
    write_whole(path, |file| {
        file.write_all(&(header.len() as u64).to_le_bytes())?;
        file.write_all(&header)?;
        for tensor in tensors {
            file.write_all(&tensor.bytes)?;
        }
        Ok(())
    })
}

/// Writes a file under a temporary name in the same folder, then renames it.
pub fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    let result = (|| {
        let mut file = std::io::BufWriter::new(std::fs::File::create(&temporary)?);
        fill(&mut file)?;
        file.flush()?;
        std::fs::rename(&temporary, path)
    })();
    if result.is_err() {
        // The partial file is of no use to anyone; the first error is what matters.
        let _ = std::fs::remove_file(&temporary);
    }
    result
}

/// Little-endian f32 values of a tensor's bytes.
pub fn f32_values(bytes: &[u8]) -> impl Iterator<Item = f32> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|chunk| f32::from_le_bytes(*chunk))
}

/// Little-endian i32 values of a tensor's bytes.
pub fn i32_values(bytes: &[u8]) -> impl Iterator<Item = i32> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|chunk| i32::from_le_bytes(*chunk))
}
