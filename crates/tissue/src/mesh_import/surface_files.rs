//! Closed surfaces from STL, OBJ, PLY and OFF files. Points with exactly the same coordinates become one, as STL repeats them.

mod obj;
mod off;
mod ply;
mod stl;

use super::error::{Fault, fault};
use super::labels::Labels;
use super::words::bytes_of;
use super::{ImportError, RawSurface, far};
use std::collections::HashMap;
use std::path::Path;

/// Extensions of the files that [`read`] reads.
pub const EXTENSIONS: [&str; 4] = ["stl", "obj", "ply", "off"];

/// Reads a surface; `extension` is one of [`EXTENSIONS`].
pub fn read(path: &Path, extension: &str) -> Result<RawSurface, ImportError> {
    let bytes = bytes_of(path)?;
    parse(&bytes, extension).map_err(|fault| fault.of(path))
}

fn parse(bytes: &[u8], extension: &str) -> Result<RawSurface, Fault> {
    let surface = match extension {
        "stl" => stl::parse(bytes)?,
        "ply" => ply::parse(bytes)?.surface,
        "off" => off::parse(bytes)?,
        _ => {
            let obj = obj::parse(bytes)?;
            RawSurface {
                positions: obj.positions,
                faces: obj.faces,
            }
        }
    };
    if surface.faces.is_empty() {
        return fault("the file holds no faces");
    }
    whole(surface)
}

/// A surface without vertices that lie far off and without those that no face names, its coinciding points one.
pub(super) fn whole(surface: RawSurface) -> Result<RawSurface, Fault> {
    let count = surface.positions.len();
    let is_beyond = |face: &[u32; 3]| face.iter().any(|&node| node as usize >= count);
    if let Some(face) = surface.faces.iter().position(is_beyond) {
        return fault(format!(
            "triangle {face} names vertices {:?}, counted from 0, but there are {count}",
            surface.faces[face]
        ));
    }
    let used = || surface.faces.iter().flatten().copied();
    far::check_finite(&surface.positions, used())?;
    far::check(&surface.positions, used())?;
    Ok(merge_points(surface))
}

/// The triangles with the names of groups, objects and materials (OBJ), or the points with those of their colours (PLY).
pub(super) fn read_labels(path: &Path, extension: &str) -> Result<Labels, ImportError> {
    let bytes = bytes_of(path)?;
    let read = match extension {
        "obj" => obj::parse(&bytes).and_then(|obj| obj.labels(bytes.len())),
        _ => ply::parse(&bytes).and_then(|ply| ply.labels(bytes.len())),
    };
    read.map_err(|fault| fault.of(path))
}

/// Makes points with the same coordinates one, and leaves out those of no face.
fn merge_points(surface: RawSurface) -> RawSurface {
    let mut merged = vec![u32::MAX; surface.positions.len()];
    for &node in surface.faces.iter().flatten() {
        merged[node as usize] = 0;
    }
    let mut first_at: HashMap<[u64; 3], u32> = HashMap::new();
    let mut positions = Vec::new();
    for (point, place) in surface.positions.iter().zip(&mut merged) {
        if *place == 0 {
            // Adding zero makes -0 and 0 the same key.
            let key = point.map(|x| (x + 0.0).to_bits());
            *place = *first_at.entry(key).or_insert_with(|| {
                positions.push(*point);
                positions.len() as u32 - 1
            });
        }
    }
    let renumber = |node: u32| merged[node as usize];
    RawSurface {
        faces: (surface.faces.iter())
            .map(|face| face.map(renumber))
            .collect(),
        positions,
    }
}
