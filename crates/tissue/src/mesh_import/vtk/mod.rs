//! VTK files: tetrahedra of an unstructured grid, or the surface of polydata; `.vtk` (`legacy`), `.vtu` and `.vtp` (`xml`).
//!
//! Both readers give pieces: points, lists of cells, and arrays over points and cells. Counts that a file announces are held
//! against its length before anything is made for them.

mod cells;
mod cursor;
mod data;
mod kinds;
mod legacy;
mod lists;
mod packed;
mod xml;

use super::body::Read;
use super::error::{Fault, fault};
use super::labels::{Labels, Part, boundary};
use super::words::bytes_of;
use super::{ImportError, body::TetList};
pub use data::{Array, DataSet, Piece};
use std::path::Path;

/// Different values of an array that counts as labels, at most.
const MOST_VALUES: usize = 64;

fn open(path: &Path, with_arrays: bool) -> Result<(DataSet, usize), ImportError> {
    let bytes = bytes_of(path)?;
    let read = match is_xml(&bytes) {
        true => xml::parse(&bytes, with_arrays),
        false => legacy::parse(&bytes, with_arrays),
    };
    let data = read.map_err(|fault| fault.of(path))?;
    Ok((data, bytes.len()))
}

/// By the content: both kinds are seen with each other's extension.
fn is_xml(bytes: &[u8]) -> bool {
    super::words::without_mark(bytes)
        .trim_ascii_start()
        .starts_with(b"<")
}

/// Reads the tetrahedra, of which any other volume cell is an error and points, lines and faces are not; or the polygons and
/// triangle strips of polydata. A grid of triangles alone is a surface too.
pub fn read(path: &Path) -> Result<Read, ImportError> {
    let (data, _) = open(path, false)?;
    body(data).map_err(|fault| fault.of(path))
}

fn body(data: DataSet) -> Result<Read, Fault> {
    let mut positions: Vec<[f64; 3]> = Vec::new();
    let mut tets = TetList::default();
    let mut faces = Vec::new();
    let mut is_solid = false;
    for piece in data.pieces {
        let first = positions.len();
        positions.extend_from_slice(&piece.points);
        cells::walk(&piece, |cell| {
            let nodes = cell.nodes_from(first);
            if cell.is_tetrahedron()? {
                is_solid = true;
                tets.add(&nodes);
            } else {
                faces.extend(cell.triangles(&nodes, &positions));
            }
            Ok(())
        })?;
    }
    if is_solid {
        return tets.finish(positions, "");
    }
    if faces.is_empty() {
        return fault(match data.is_grid {
            true => "the grid holds no tetrahedra",
            false => "the polydata holds no polygons",
        });
    }
    super::surface_files::whole(super::RawSurface { positions, faces }).map(Read::from)
}

/// Values of whole-numbered arrays as names: `ARRAY=VALUE` of points and cells.
pub fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    let (data, bytes) = open(path, true)?;
    labels(data, bytes).map_err(|fault| fault.of(path))
}

fn labels(data: DataSet, bytes: usize) -> Result<Labels, Fault> {
    let mut out = Labels::of_file(bytes);
    for piece in data.pieces {
        let first = out.positions.len();
        out.positions.extend_from_slice(&piece.points);
        for (array, values) in piece.of_points.iter().filter_map(whole_numbers) {
            for (point, value) in values.iter().take(piece.points.len()).enumerate() {
                let name = out.name(&format!("{array}={value}"));
                out.add(name, Part::Point(first + point))?;
            }
        }
        let arrays: Vec<_> = piece.of_cells.iter().filter_map(whole_numbers).collect();
        cells::walk(&piece, |cell| {
            let nodes = cell.nodes_from(first);
            let mut parts = Vec::new();
            if cell.is_tetrahedron()? {
                if let Some(&corners) = nodes.first_chunk::<4>() {
                    parts.push(Part::Tet(out.tets.len()));
                    out.tets.push(corners);
                }
            } else {
                for face in cell.triangles(&nodes, &out.positions) {
                    parts.push(Part::Face(out.faces.len()));
                    out.faces.push(face);
                }
            }
            for (array, values) in &arrays {
                let Some(value) = values.get(cell.index) else {
                    continue;
                };
                let name = out.name(&format!("{array}={value}"));
                for &part in &parts {
                    out.add(name, part)?;
                }
            }
            Ok(())
        })?;
    }
    // A grid of tetrahedra alone: its points are looked up on its own boundary.
    if out.faces.is_empty() {
        out.faces = boundary(&out.tets);
    }
    Ok(out)
}

/// The values of an array that may be labels.
fn whole_numbers(array: &Array) -> Option<(&str, Vec<i64>)> {
    if array.values.iter().any(|value| value.fract() != 0.0) {
        return None;
    }
    let values: Vec<i64> = array.values.iter().map(|&value| value as i64).collect();
    let mut seen: std::collections::BTreeSet<i64> = std::collections::BTreeSet::new();
    let has_few = values.iter().all(|&value| {
        seen.insert(value);
        seen.len() <= MOST_VALUES
    });
    has_few.then_some((array.name.as_str(), values))
}
