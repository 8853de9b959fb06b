//! The labels of a file of any format.

use super::error::ImportError;
use super::labels::Labels;
use super::raw::extension_of;
use super::{gmsh, medit, named_tets, surface_files, tetgen, vtk};
use std::path::Path;

/// Reads the names that a file gives to parts of itself; formats without any have none.
///
/// # Errors
/// [`ImportError`] of the file.
pub fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    match extension_of(path).as_str() {
        extension @ ("obj" | "ply") => surface_files::read_labels(path, extension),
        "msh" => gmsh::read_labels(path),
        "vtk" | "vtu" | "vtp" => vtk::read_labels(path),
        "inp" | "feb" => named_tets::read_labels(path),
        "mesh" => medit::read_labels(path),
        "node" | "ele" => tetgen::read_labels(path),
        _ => Ok(Labels::default()),
    }
}
