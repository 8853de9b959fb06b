//! VTK XML files whose arrays follow the XML as raw bytes (ParaView's default), turned into the
//! base64 form that `vtkio` reads.
//!
//! `<AppendedData encoding="raw">_` opens the block; `offset="n"` of an array points n bytes behind
//! the underscore. In base64 an array is its length header and its data in one run, but with a
//! compressor its block table and its data in two.

use base64::{Engine, engine::general_purpose::STANDARD};
use std::collections::BTreeMap;

/// The whole file as text, or `None` where it holds no raw appended data or is damaged.
pub fn to_base64(bytes: &[u8]) -> Option<String> {
    let find = |from: usize, wanted: &str| {
        let found = bytes[from..]
            .windows(wanted.len())
            .position(|window| window == wanted.as_bytes());
        found.map(|at| from + at)
    };
    let opening = find(0, "<AppendedData")?;
    let head = std::str::from_utf8(&bytes[..opening]).ok()?;
    let tag_end = find(opening, ">")?;
    let tag = std::str::from_utf8(&bytes[opening..tag_end]).ok()?;
    if !tag.contains("encoding=\"raw\"") {
        return None;
    }
    let first = find(tag_end, "_")? + 1;
    let close = b"</AppendedData>";
    let last = bytes
        .windows(close.len())
        .rposition(|window| window == close.as_slice())?;
    let data = bytes.get(first..last)?;
    let wide = head.contains("header_type=\"UInt64\"");
    let compressed = head.contains("compressor=\"");

    let mut encoded = String::new();
    let mut moved = BTreeMap::new();
    for offset in offsets(head)? {
        moved.insert(offset, encoded.len());
        let (table, body) = array(data.get(offset..)?, wide, compressed)?;
        if compressed {
            encoded += &STANDARD.encode(table);
            encoded += &STANDARD.encode(body);
        } else {
            encoded += &STANDARD.encode([table, body].concat());
        }
    }
    let mut text = String::with_capacity(head.len() + encoded.len() + 100);
    let mut parts = head.split("offset=\"");
    text += parts.next()?;
    for part in parts {
        let (number, rest) = part.split_once('"')?;
        let offset = moved.get(&number.parse::<usize>().ok()?)?;
        text += &format!("offset=\"{offset}\"{rest}");
    }
    text += &format!("<AppendedData encoding=\"base64\">_{encoded}</AppendedData></VTKFile>");
    Some(text)
}

/// The distinct offsets that the XML names, ascending.
fn offsets(head: &str) -> Option<Vec<usize>> {
    let mut found: Vec<usize> = head
        .split("offset=\"")
        .skip(1)
        .map(|part| part.split_once('"')?.0.parse().ok())
        .collect::<Option<_>>()?;
    found.sort_unstable();
    found.dedup();
    Some(found)
}

/// Splits what starts at an array's offset into its header and its data.
fn array(bytes: &[u8], wide: bool, compressed: bool) -> Option<(&[u8], &[u8])> {
    let width = if wide { 8 } else { 4 };
    let word = |index: usize| -> Option<usize> {
        let chunk = bytes.get(index * width..(index + 1) * width)?;
        let mut full = [0u8; 8];
        full[..width].copy_from_slice(chunk);
        usize::try_from(u64::from_le_bytes(full)).ok()
    };
    // Uncompressed: the number of bytes. Compressed: blocks, block size, size of the last, and the
    // compressed size of each block.
    let (header, length) = if compressed {
        let blocks = word(0)?;
        let mut length = 0usize;
        for block in 0..blocks {
            length = length.checked_add(word(3 + block)?)?;
        }
        ((3 + blocks) * width, length)
    } else {
        (width, word(0)?)
    };
    Some((
        bytes.get(..header)?,
        bytes.get(header..header.checked_add(length)?)?,
    ))
}
