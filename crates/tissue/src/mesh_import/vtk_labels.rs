//! Values of whole-numbered VTK arrays as names: `ARRAY=VALUE` of points and cells.

use super::labels::Labels;
use super::{ImportError, vtk};
use std::path::Path;
use vtkio::model::{Attribute, Attributes, CellType, DataSet, IOBuffer, PolyDataPiece};

/// Different values of an array that counts as labels, at most.
const MOST_VALUES: usize = 64;

/// Reads the arrays of a file.
pub fn read(path: &Path) -> Result<Labels, ImportError> {
    let format = |reason: String| ImportError::Format {
        path: path.into(),
        reason,
    };
    let file = vtk::open(path)?;
    let source = file.file_path.clone();
    let mut out = Labels::default();
    match file.data {
        DataSet::UnstructuredGrid { pieces, .. } => {
            for piece in pieces {
                let piece = piece
                    .into_loaded_piece_data(source.as_deref())
                    .map_err(|error| format(error.to_string()))?;
                let first = points(&mut out, piece.points, &piece.data);
                let types = piece.cells.types;
                let names = names(&piece.data.cell, types.len());
                let (nodes, mut ends) = piece.cells.cell_verts.into_xml();
                if ends.len() == types.len() + 1 {
                    ends.remove(0);
                }
                let mut start = 0;
                for ((kind, end), names) in types.iter().zip(ends).zip(names) {
                    let cell: Vec<u32> = nodes
                        .get(start as usize..end as usize)
                        .unwrap_or_default()
                        .iter()
                        .map(|node| first + *node as u32)
                        .collect();
                    start = end;
                    match (kind, cell.as_slice()) {
                        (CellType::Tetra, &[a, b, c, d]) => {
                            out.tets.push([a, b, c, d]);
                            out.of_tet.push(names);
                        }
                        (CellType::Triangle, &[a, b, c]) => {
                            out.faces.push([a, b, c]);
                            out.of_face.push(names);
                        }
                        _ => {}
                    }
                }
            }
        }
        DataSet::PolyData { pieces, .. } => {
            for piece in pieces {
                let piece = piece
                    .into_loaded_piece_data(source.as_deref())
                    .map_err(|error| format(error.to_string()))?;
                polygons(piece, &mut out);
            }
        }
        _ => {}
    }
    // A grid of tetrahedra alone: its points are looked up on its own boundary.
    if out.faces.is_empty() && !out.tets.is_empty() {
        out.faces = crate::mesh::boundary_faces(&out.tets)?;
    }
    Ok(out)
}

fn polygons(piece: PolyDataPiece, out: &mut Labels) {
    let first = points(out, piece.points, &piece.data);
    let Some(polygons) = piece.polys else { return };
    let (nodes, mut ends) = polygons.into_xml();
    if ends.first() == Some(&0) {
        ends.remove(0);
    }
    // Cell data count vertices and lines before polygons; such files have none of them here.
    let names = names(&piece.data.cell, ends.len());
    let mut start = 0;
    for (end, names) in ends.into_iter().zip(names) {
        let cell = nodes.get(start as usize..end as usize).unwrap_or_default();
        start = end;
        for side in 1..cell.len().saturating_sub(1) {
            let corners = [cell[0], cell[side], cell[side + 1]];
            out.faces.push(corners.map(|node| first + node as u32));
            out.of_face.push(names.clone());
        }
    }
}

/// Adds points with their names; returns the number of the first.
fn points(out: &mut Labels, points: IOBuffer, data: &Attributes) -> u32 {
    let first = out.positions.len();
    let points: Vec<f64> = points.cast_into().unwrap_or_default();
    out.positions.extend_from_slice(points.as_chunks::<3>().0);
    let count = out.positions.len() - first;
    out.of_point.extend(names(&data.point, count));
    first as u32
}

/// `ARRAY=VALUE` for each of `count` rows, by all arrays of one whole number a row with few values.
fn names(attributes: &[Attribute], count: usize) -> Vec<Vec<String>> {
    let mut names = vec![Vec::new(); count];
    let mut add = |name: &str, width: usize, data: &IOBuffer| {
        let values: Vec<f64> = data.cast_into().unwrap_or_default();
        if width != 1 || values.len() != count || values.iter().any(|v| v.fract() != 0.0) {
            return;
        }
        let mut seen: Vec<i64> = values.iter().map(|&v| v as i64).collect();
        seen.sort_unstable();
        seen.dedup();
        if seen.len() > MOST_VALUES {
            return;
        }
        for (list, value) in names.iter_mut().zip(values) {
            list.push(format!("{name}={value}"));
        }
    };
    for attribute in attributes {
        match attribute {
            Attribute::DataArray(array) => add(&array.name, array.num_comp(), &array.data),
            Attribute::Field { data_array, .. } => data_array
                .iter()
                .for_each(|array| add(&array.name, array.elem as usize, &array.data)),
        }
    }
    names
}
