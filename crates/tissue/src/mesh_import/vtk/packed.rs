//! Arrays of VTK XML files that are packed: base64 or raw, whole or in compressed blocks.
//!
//! Whole, an array is its number of bytes and the bytes. In blocks it is a table (blocks, bytes of a block, bytes of the last one
//! if it is shorter, packed bytes of each) and the packed blocks. In base64 the first is one run of letters, the second are two.
//! Every count is held against what the file still holds, and all arrays together against [`Budget`].

use super::super::error::{Fault, fault};
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::io::Read;

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// How many bytes a file may still unpack to: far more than meshes do, far less than a file made to unpack without end.
pub struct Budget(usize);

impl Budget {
    pub fn of_file(bytes: usize) -> Self {
        Self(bytes.saturating_mul(16).saturating_add(128 << 20))
    }

    /// Takes so many bytes of it.
    pub fn spend(&mut self, bytes: usize) -> Result<(), Fault> {
        match self.0.checked_sub(bytes) {
            Some(left) => {
                self.0 = left;
                Ok(())
            }
            None => fault("its arrays unpack to far more bytes than the file's size allows"),
        }
    }
}

/// How blocks are packed.
#[derive(Clone, Copy)]
enum Compressor {
    Zlib,
    Lz4,
    Lzma,
}

/// How the arrays of a file are packed.
pub struct Packing {
    pub is_big: bool,
    /// Bytes of a word of the tables.
    word: usize,
    compressor: Option<Compressor>,
}

impl Packing {
    /// By the attributes of `<VTKFile>`.
    pub fn new(order: &str, header: &str, compressor: &str) -> Result<Self, Fault> {
        Ok(Self {
            is_big: order == "BigEndian",
            word: match header {
                "" | "UInt32" => 4,
                "UInt64" => 8,
                other => {
                    return fault(format!(
                        "header_type is `{other}`, must be UInt32 or UInt64"
                    ));
                }
            },
            compressor: match compressor {
                "" => None,
                "vtkZLibDataCompressor" => Some(Compressor::Zlib),
                "vtkLZ4DataCompressor" => Some(Compressor::Lz4),
                "vtkLZMADataCompressor" => Some(Compressor::Lzma),
                other => return fault(format!("the compressor `{other}` is not known")),
            },
        })
    }

    /// The array that begins here.
    pub fn unpack(
        &self,
        source: &[u8],
        is_base64: bool,
        budget: &mut Budget,
    ) -> Result<Vec<u8>, Fault> {
        let source = Source {
            bytes: source,
            is_base64,
        };
        if self.compressor.is_none() {
            let bytes = self.size(&source.run(0, self.word)?.0, 0)?;
            budget.spend(bytes)?;
            let whole = self.word.checked_add(bytes);
            let (mut run, _) = source.run(0, whole.unwrap_or(usize::MAX))?;
            run.drain(..self.word);
            return Ok(run);
        }
        // An array without a block may have no more than the first word.
        let blocks = self.size(&source.run(0, self.word)?.0, 0)?;
        if blocks == 0 {
            return Ok(Vec::new());
        }
        let words = blocks.saturating_add(3);
        let (table, end) = source.run(0, words.saturating_mul(self.word))?;
        let (size, last) = (self.size(&table, 1)?, self.size(&table, 2)?);
        let last = if last == 0 { size } else { last };
        let total = (blocks - 1)
            .checked_mul(size)
            .and_then(|bytes| bytes.checked_add(last))
            .unwrap_or(usize::MAX);
        budget.spend(total)?;
        let mut packed = 0usize;
        for block in 0..blocks {
            packed = packed.saturating_add(self.size(&table, 3 + block)?);
        }
        let (data, _) = source.run(end, packed)?;
        let mut out = Vec::new();
        let mut rest = data.as_slice();
        for block in 0..blocks {
            let (one, more) = rest.split_at(self.size(&table, 3 + block)?.min(rest.len()));
            rest = more;
            let size = if block + 1 == blocks { last } else { size };
            self.block(one, size, &mut out)
                .map_err(|reason| format!("block {block} of an array: {reason}"))?;
        }
        Ok(out)
    }

    /// A word of a table.
    fn size(&self, table: &[u8], index: usize) -> Result<usize, Fault> {
        let start = index * self.word;
        let Some(word) = table.get(start..start + self.word) else {
            return fault("an array ends inside its table: is the file cut off?");
        };
        let mut bytes = [0; 8];
        bytes[..self.word].copy_from_slice(word);
        if self.is_big {
            bytes[..self.word].reverse();
        }
        match usize::try_from(u64::from_le_bytes(bytes)) {
            Ok(size) => Ok(size),
            Err(_) => fault("an array is larger than memory"),
        }
    }

    /// Unpacks a block of a known size.
    fn block(&self, packed: &[u8], size: usize, out: &mut Vec<u8>) -> Result<(), String> {
        let start = out.len();
        // What a byte can unpack to at most.
        let most = match self.compressor {
            None => 1,
            Some(Compressor::Zlib) => 1100,
            Some(Compressor::Lz4) => 256,
            Some(Compressor::Lzma) => 16384,
        };
        if size > packed.len().saturating_mul(most) {
            return Err(format!(
                "announces {size} bytes, which {} packed ones cannot hold",
                packed.len()
            ));
        }
        let limit = size as u64;
        match self.compressor {
            None => out.extend_from_slice(packed),
            Some(Compressor::Zlib) => {
                let mut reader = flate2::read::ZlibDecoder::new(packed).take(limit);
                reader.read_to_end(out).map_err(|error| error.to_string())?;
            }
            Some(Compressor::Lz4) => {
                out.resize(start + size, 0);
                let filled = lz4_flex::block::decompress_into(packed, &mut out[start..])
                    .map_err(|error| error.to_string())?;
                out.truncate(start + filled);
            }
            Some(Compressor::Lzma) => {
                let data = lzma_data(packed).ok_or("is no XZ stream of LZMA2 alone")?;
                // What lies farther back than the beginning is nowhere, so that the dictionary is as large as the block at most.
                let dictionary =
                    u32::try_from(size.max(4096)).map_err(|error| error.to_string())?;
                let mut reader = lzma_rust2::Lzma2Reader::new(data, dictionary, None).take(limit);
                reader.read_to_end(out).map_err(|error| error.to_string())?;
            }
        }
        match out.len() - start {
            found if found == size => Ok(()),
            found => Err(format!("has {found} bytes, must have {size}")),
        }
    }
}

/// Bytes in which an array lies, as they are or as base64.
struct Source<'a> {
    bytes: &'a [u8],
    is_base64: bool,
}

impl Source<'_> {
    /// So many bytes of a run that begins at `from`, and where it ends.
    fn run(&self, from: usize, count: usize) -> Result<(Vec<u8>, usize), Fault> {
        let letters = match self.is_base64 {
            true => count.div_ceil(3).checked_mul(4),
            false => Some(count),
        };
        let end = letters.and_then(|letters| from.checked_add(letters));
        let Some(run) = end.and_then(|end| self.bytes.get(from..end)) else {
            return fault(format!(
                "an array announces {count} bytes but is shorter: is the file cut off?"
            ));
        };
        let end = from + run.len();
        if !self.is_base64 {
            return Ok((run.to_vec(), end));
        }
        match BASE64.decode(run) {
            Ok(mut bytes) if bytes.len() >= count => {
                bytes.truncate(count);
                Ok((bytes, end))
            }
            Ok(_) => fault("an array ends inside its base64: is the file cut off?"),
            Err(error) => fault(format!("an array is no base64: {error}")),
        }
    }
}

/// What follows the headers of an XZ stream whose first block has LZMA2 as its only filter.
fn lzma_data(stream: &[u8]) -> Option<&[u8]> {
    let rest = stream.strip_prefix(b"\xfd7zXZ\0")?.get(6..)?;
    let length = 4 * (usize::from(*rest.first()?) + 1);
    let head = rest.get(1..length)?;
    let (&flags, mut fields) = head.split_first()?;
    if flags & 0x3f != 0 {
        return None;
    }
    // Numbers of 7 bits a byte.
    let mut skip_number = || -> Option<u8> {
        let end = fields.iter().position(|byte| byte & 0x80 == 0)?;
        let first = fields[0];
        fields = &fields[end + 1..];
        Some(first)
    };
    for flag in [0x40, 0x80] {
        if flags & flag != 0 {
            skip_number()?;
        }
    }
    (skip_number()? == 0x21).then_some(())?;
    rest.get(length..)
}
