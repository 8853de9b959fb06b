//! STL, text and binary: all solids of a file. Normals are not read; corners repeat for each triangle.
//!
//! A file is binary if its size fits its count of triangles, or if its beginning is no text. Programs that write a stream leave
//! the count at 0, and then the size says it.

use super::super::RawSurface;
use super::super::error::{Fault, fault};
use super::super::words::{real, short, text, without_mark};

/// Bytes before the triangles of a binary file, and of each triangle.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// Reads the triangles.
pub fn parse(bytes: &[u8]) -> Result<RawSurface, Fault> {
    match announced(bytes) {
        Some(count) if bytes.len() == HEAD + count.saturating_mul(TRIANGLE) => binary(bytes, count),
        _ if is_text(bytes) => lines(&text(bytes)),
        Some(0) if (bytes.len() - HEAD).is_multiple_of(TRIANGLE) => {
            binary(bytes, (bytes.len() - HEAD) / TRIANGLE)
        }
        // Some programs append data of their own.
        Some(count) if count <= (bytes.len() - HEAD) / TRIANGLE => binary(bytes, count),
        Some(count) => fault(format!(
            "the header announces {count} triangles, but the file holds {}: is it cut off?",
            (bytes.len() - HEAD) / TRIANGLE
        )),
        None => fault("the file is neither text nor long enough for a binary STL: is it cut off?"),
    }
}

/// The count of triangles of a binary file.
fn announced(bytes: &[u8]) -> Option<usize> {
    let word = bytes.get(HEAD - 4..HEAD)?;
    Some(u32::from_le_bytes(word.try_into().ok()?) as usize)
}

fn is_text(bytes: &[u8]) -> bool {
    let head = &without_mark(bytes)[..without_mark(bytes).len().min(1000)];
    let head = head.trim_ascii_start().to_ascii_lowercase();
    let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    !head.contains(&0) && (head.starts_with(b"solid") || has(b"facet"))
}

fn binary(bytes: &[u8], count: usize) -> Result<RawSurface, Fault> {
    let mut out = RawSurface::default();
    for triangle in bytes[HEAD..].chunks_exact(TRIANGLE).take(count) {
        let (numbers, _) = triangle[12..48].as_chunks::<4>();
        let (corners, _) = numbers.as_chunks::<3>();
        for corner in corners {
            let point = corner.map(|word| f64::from(f32::from_le_bytes(word)));
            out.positions.push(point);
        }
        let first = out.positions.len() as u32 - 3;
        out.faces.push([first, first + 1, first + 2]);
    }
    Ok(out)
}

fn lines(text: &str) -> Result<RawSurface, Fault> {
    let mut out = RawSurface::default();
    // Corners since the facet began, and its line.
    let mut facet: Option<(usize, usize)> = None;
    for (at, line) in text.lines().enumerate() {
        let at = at + 1;
        let mut words = line.split_ascii_whitespace();
        while let Some(word) = words.next() {
            match word.to_ascii_lowercase().as_str() {
                // A name follows, or nothing.
                "solid" | "endsolid" | "end" => break,
                "facet" => facet = Some((0, at)),
                "normal" | "outer" | "loop" => {}
                "vertex" => {
                    let mut coordinate = || match words.next() {
                        Some(word) => real(word, at),
                        None => fault(format!(
                            "line {at}: a vertex has three coordinates: is the file cut off?"
                        )),
                    };
                    let point = [coordinate()?, coordinate()?, coordinate()?];
                    out.positions.push(point);
                    match &mut facet {
                        Some((corners, _)) => *corners += 1,
                        None => return fault(format!("line {at}: a vertex outside of a facet")),
                    }
                }
                "endloop" => {}
                "endfacet" => {
                    let Some((corners, _)) = facet.take() else {
                        return fault(format!("line {at}: an endfacet without its facet"));
                    };
                    if corners != 3 {
                        return fault(format!(
                            "line {at}: a facet has {corners} corners, must have three"
                        ));
                    }
                    let first = out.positions.len() as u32 - 3;
                    out.faces.push([first, first + 1, first + 2]);
                }
                comment if comment.starts_with(['#', ';']) => break,
                // The numbers of the normal, which may be `nan`.
                _ if facet.is_some_and(|(corners, _)| corners == 0) => {}
                _ => {
                    return fault(format!(
                        "line {at}: `{}` where a facet or a vertex is due",
                        short(word)
                    ));
                }
            }
        }
    }
    match facet {
        Some((_, at)) => fault(format!(
            "line {at}: the file ends inside this facet: is it cut off?"
        )),
        None => Ok(out),
    }
}
