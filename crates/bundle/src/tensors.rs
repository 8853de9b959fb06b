//! A safetensors file, tensor by tensor, with dtype, shape and value checks that name file and tensor.

use std::collections::HashMap;

use half::f16;
use safetensors::tensor::{Dtype, Metadata, SafeTensors};

use field::error::{Error, Result};
use field::memory;

/// A parsed safetensors file.
pub struct TensorFile {
    /// Of the file, for messages.
    name: String,
    /// The whole file: tensors are views of it until they are copied.
    bytes: Vec<u8>,
    /// Where the data begins.
    start: usize,
    /// The header: name, dtype, shape and range of each tensor.
    metadata: Metadata,
}

impl TensorFile {
    /// Parses the header; `name` is for messages.
    pub fn parse(name: &str, bytes: Vec<u8>) -> Result<TensorFile> {
        // The library's lists of the header's entries cannot fail softly: what they take at most is asked for first.
        let stated = bytes
            .first_chunk()
            .map_or(0, |length| u64::from_le_bytes(*length));
        let header = usize::try_from(stated).map_or(bytes.len(), |stated| stated.min(bytes.len()));
        memory::probe(8 * header, "the header of a file")?;
        let (header, metadata) = SafeTensors::read_metadata(&bytes)
            .map_err(|error| Error::bundle(name, format!("not a safetensors file: {error}")))?;
        let start = header + 8;
        if start + metadata.data_len() != bytes.len() {
            return Err(Error::bundle(
                name,
                format!(
                    "header describes {} bytes of data, the file holds {}",
                    metadata.data_len(),
                    bytes.len() - start
                ),
            ));
        }
        Ok(TensorFile {
            name: name.to_owned(),
            bytes,
            start,
            metadata,
        })
    }

    /// File name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The `__metadata__` strings.
    pub fn text(&self) -> HashMap<String, String> {
        self.metadata.metadata().clone().unwrap_or_default()
    }

    /// Whether a tensor is there.
    pub fn has(&self, tensor: &str) -> bool {
        self.metadata.info(tensor).is_some()
    }

    /// Shape of a tensor.
    pub fn shape(&self, tensor: &str) -> Result<&[usize]> {
        self.metadata
            .info(tensor)
            .map(|info| info.shape.as_slice())
            .ok_or_else(|| self.bad(tensor, "is missing"))
    }

    /// Whether a tensor is stored as float16.
    pub fn is_f16(&self, tensor: &str) -> bool {
        self.metadata
            .info(tensor)
            .is_some_and(|info| info.dtype == Dtype::F16)
    }

    /// An error about a tensor of this file.
    pub fn bad(&self, tensor: &str, message: impl std::fmt::Display) -> Error {
        Error::bundle(&self.name, format!("tensor `{tensor}`: {message}"))
    }

    /// Raw bytes of a tensor of the wanted dtype and shape (`None`: any length in that dimension).
    pub fn raw(&self, tensor: &str, dtype: Dtype, shape: &[Option<usize>]) -> Result<&[u8]> {
        let info = self
            .metadata
            .info(tensor)
            .ok_or_else(|| self.bad(tensor, "is missing"))?;
        if info.dtype != dtype {
            return Err(self.bad(
                tensor,
                format!("has dtype {:?}, must be {dtype:?}", info.dtype),
            ));
        }
        let fits = info.shape.len() == shape.len()
            && info
                .shape
                .iter()
                .zip(shape)
                .all(|(have, want)| want.is_none_or(|want| want == *have));
        if !fits {
            let want: Vec<String> = shape
                .iter()
                .map(|n| n.map_or("n".to_owned(), |n| n.to_string()))
                .collect();
            return Err(self.bad(
                tensor,
                format!("has shape {:?}, must be [{}]", info.shape, want.join(", ")),
            ));
        }
        let (begin, end) = info.data_offsets;
        Ok(&self.bytes[self.start + begin..self.start + end])
    }

    /// A float32 tensor, all values finite.
    pub fn f32(&self, tensor: &str, shape: &[Option<usize>]) -> Result<Vec<f32>> {
        let raw = self.raw(tensor, Dtype::F32, shape)?;
        let values = raw
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let values = memory::collected(raw.len() / 4, values, tensor)?;
        match values.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(self.bad(tensor, format!("element {index} is not finite"))),
            None => Ok(values),
        }
    }

    /// A float16 tensor, all values finite.
    pub fn f16(&self, tensor: &str, shape: &[Option<usize>]) -> Result<Vec<f16>> {
        let raw = self.raw(tensor, Dtype::F16, shape)?;
        let values = raw
            .chunks_exact(2)
            .map(|b| f16::from_le_bytes([b[0], b[1]]));
        let values = memory::collected(raw.len() / 2, values, tensor)?;
        match values.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(self.bad(tensor, format!("element {index} is not finite"))),
            None => Ok(values),
        }
    }

    /// A float tensor of either width, widened to float32.
    pub fn float(&self, tensor: &str, shape: &[Option<usize>]) -> Result<Vec<f32>> {
        if self.is_f16(tensor) {
            let narrow = self.f16(tensor, shape)?;
            let wide = narrow.iter().map(|value| value.to_f32());
            memory::collected(narrow.len(), wide, tensor)
        } else {
            self.f32(tensor, shape)
        }
    }

    /// An int32 tensor of indices in `0..limit`.
    pub fn indices(&self, tensor: &str, shape: &[Option<usize>], limit: usize) -> Result<Vec<u32>> {
        let raw = self.raw(tensor, Dtype::I32, shape)?;
        let values = raw
            .chunks_exact(4)
            .map(|b| i32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let valid = |value: i32| value >= 0 && (value as usize) < limit;
        if let Some((at, value)) = values.clone().enumerate().find(|(_, v)| !valid(*v)) {
            return Err(self.bad(
                tensor,
                format!("element {at} is {value}, must be in 0..{limit}"),
            ));
        }
        memory::collected(raw.len() / 4, values.map(|value| value as u32), tensor)
    }

    /// As [`Self::indices`], strictly ascending.
    pub fn ascending(&self, tensor: &str, limit: usize) -> Result<Vec<u32>> {
        let values = self.indices(tensor, &[None], limit)?;
        match values.windows(2).position(|pair| pair[0] >= pair[1]) {
            Some(at) => Err(self.bad(
                tensor,
                format!("element {} is not larger than the one before", at + 1),
            )),
            None => Ok(values),
        }
    }

    /// CSR offsets: from 0, never falling, the last at most `limit`.
    pub fn offsets(&self, tensor: &str, limit: usize) -> Result<Vec<usize>> {
        let values = self.indices(tensor, &[None], limit + 1)?;
        if values.first() != Some(&0) {
            return Err(self.bad(tensor, "must begin with 0"));
        }
        match values.windows(2).position(|pair| pair[0] > pair[1]) {
            Some(at) => Err(self.bad(
                tensor,
                format!("element {} is smaller than the one before", at + 1),
            )),
            None => {
                let wide = values.iter().map(|&value| value as usize);
                memory::collected(values.len(), wide, tensor)
            }
        }
    }
}
