//! Tetrahedra of a VTK unstructured grid, or the surface of polydata: legacy `.vtk` and XML `.vtu`, `.vtp`, text, binary or
//! appended.

use super::{ImportError, RawSurface, RawTets, surface_files, vtk_raw};
use std::path::Path;
use vtkio::model::{CellType, DataSet, PolyDataPiece, UnstructuredGridPiece};

/// What a file holds.
pub enum Body {
    Tets(RawTets),
    Surface(RawSurface),
}

/// Reads the linear tetrahedra, of which any other volume cell is an error and points, lines and faces are not; or the polygons
/// and triangle strips of polydata.
pub fn read(path: &Path) -> Result<Body, ImportError> {
    let file = open(path)?;
    let format = |reason: String| ImportError::Format {
        path: path.into(),
        reason,
    };
    let source = file.file_path.clone();
    match file.data {
        DataSet::UnstructuredGrid { pieces, .. } => {
            let mut out = RawTets::default();
            for piece in pieces {
                let piece = piece
                    .into_loaded_piece_data(source.as_deref())
                    .map_err(|error| format(error.to_string()))?;
                append(path, piece, &mut out)?;
            }
            Ok(Body::Tets(out))
        }
        DataSet::PolyData { pieces, .. } => {
            let mut out = RawSurface::default();
            for piece in pieces {
                let piece = piece
                    .into_loaded_piece_data(source.as_deref())
                    .map_err(|error| format(error.to_string()))?;
                append_polygons(piece, &mut out).map_err(format)?;
            }
            if out.faces.is_empty() {
                return Err(format("the polydata holds no polygons".into()));
            }
            Ok(Body::Surface(surface_files::merge_points(out)))
        }
        _ => Err(format(
            "the data set is neither an unstructured grid nor polydata; convert it to tetrahedra or a closed surface".into(),
        )),
    }
}

/// The file as the crate `vtkio` understands it.
pub(super) fn open(path: &Path) -> Result<vtkio::Vtk, ImportError> {
    let bytes = std::fs::read(path).map_err(|source| ImportError::Io {
        path: path.into(),
        source,
    })?;
    let read = match vtk_raw::to_base64(&bytes) {
        Some(text) => vtkio::Vtk::parse_xml(text.as_bytes()),
        None => vtkio::Vtk::import(path),
    };
    read.map_err(|error| ImportError::Format {
        path: path.into(),
        reason: error.to_string(),
    })
}

/// Polygons as fans of triangles, strips as triangles that turn in turn.
fn append_polygons(piece: PolyDataPiece, out: &mut RawSurface) -> Result<(), String> {
    let first = out.positions.len() as u64;
    let points: Vec<f64> = piece
        .points
        .cast_into()
        .ok_or("the points are not numbers")?;
    let (points, rest) = points.as_chunks::<3>();
    if !rest.is_empty() {
        return Err("the points are not triples of coordinates".into());
    }
    out.positions.extend_from_slice(points);
    let node = |node: u64| (first + node).min(u64::from(u32::MAX)) as u32;
    for (cells, is_strip) in [(piece.polys, false), (piece.strips, true)] {
        let Some(cells) = cells else { continue };
        let (nodes, ends) = cells.into_xml();
        let mut start = 0;
        for (index, end) in ends.into_iter().enumerate() {
            if index == 0 && end == 0 {
                continue;
            }
            let cell = nodes
                .get(start as usize..end as usize)
                .ok_or_else(|| format!("polygon {index} reaches beyond the node list"))?;
            start = end;
            for side in 1..cell.len().saturating_sub(1) {
                let corners = match (is_strip, side % 2) {
                    (false, _) => [cell[0], cell[side], cell[side + 1]],
                    (true, 1) => [cell[side - 1], cell[side], cell[side + 1]],
                    (true, _) => [cell[side], cell[side - 1], cell[side + 1]],
                };
                out.faces.push(corners.map(node));
            }
        }
    }
    Ok(())
}

fn append(path: &Path, piece: UnstructuredGridPiece, out: &mut RawTets) -> Result<(), ImportError> {
    let format = |reason: String| ImportError::Format {
        path: path.into(),
        reason,
    };
    let first = out.positions.len() as u64;
    let points: Vec<f64> = piece
        .points
        .cast_into()
        .ok_or_else(|| format("the points are not numbers".into()))?;
    let (points, rest) = points.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(format("the points are not triples of coordinates".into()));
    }
    out.positions.extend_from_slice(points);
    let types = piece.cells.types;
    let (nodes, mut ends) = piece.cells.cell_verts.into_xml();
    if ends.len() == types.len() + 1 {
        ends.remove(0);
    }
    if ends.len() != types.len() {
        return Err(format(format!(
            "{} cells have {} types",
            ends.len(),
            types.len()
        )));
    }
    let mut start = 0;
    for (index, (kind, end)) in types.iter().zip(ends).enumerate() {
        let cell = nodes
            .get(start as usize..end as usize)
            .ok_or_else(|| format(format!("cell {index} reaches beyond the node list")))?;
        start = end;
        match kind {
            CellType::Tetra => {
                let &[a, b, c, d] = cell else {
                    return Err(format(format!(
                        "cell {index} is a tetrahedron of {} nodes",
                        cell.len()
                    )));
                };
                out.tets
                    .push([a, b, c, d].map(|node| (first + node).min(u64::from(u32::MAX)) as u32));
            }
            CellType::Vertex
            | CellType::PolyVertex
            | CellType::Line
            | CellType::PolyLine
            | CellType::Triangle
            | CellType::Quad => {}
            other => {
                return Err(ImportError::ElementKind {
                    path: path.into(),
                    element: index,
                    kind: format!("a VTK cell of type {other:?}"),
                });
            }
        }
    }
    if out.tets.is_empty() {
        return Err(format("the grid holds no tetrahedra".into()));
    }
    Ok(())
}
