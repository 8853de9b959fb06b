//! Tetrahedra of a VTK unstructured grid: legacy `.vtk` and XML `.vtu`, text, binary or appended.

use super::{ImportError, RawTets, vtk_raw};
use std::path::Path;
use vtkio::model::{CellType, DataSet, UnstructuredGridPiece};

/// Reads the linear tetrahedra; any other volume cell is an error, points, lines and faces are not.
pub fn read(path: &Path) -> Result<RawTets, ImportError> {
    if let Err(source) = std::fs::metadata(path) {
        return Err(ImportError::Io {
            path: path.into(),
            source,
        });
    }
    let format = |reason: String| ImportError::Format {
        path: path.into(),
        reason,
    };
    let file = match std::fs::read(path)
        .ok()
        .and_then(|b| vtk_raw::to_base64(&b))
    {
        Some(text) => vtkio::Vtk::parse_xml(text.as_bytes()),
        None => vtkio::Vtk::import(path),
    }
    .map_err(|error| format(error.to_string()))?;
    let source = file.file_path.clone();
    let DataSet::UnstructuredGrid { pieces, .. } = file.data else {
        return Err(format(
            "the data set is not an unstructured grid; convert it to one of tetrahedra".into(),
        ));
    };
    let mut out = RawTets::default();
    for piece in pieces {
        let piece = piece
            .into_loaded_piece_data(source.as_deref())
            .map_err(|error| format(error.to_string()))?;
        append(path, piece, &mut out)?;
    }
    Ok(out)
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
