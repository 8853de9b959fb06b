//! Tetrahedra whose file names sets of nodes, elements and faces: Abaqus, CalculiX (`abaqus`) and FEBio (`febio`).

mod abaqus;
mod announced;
mod febio;
mod keywords;
mod model;
mod sets;

use super::ImportError;
use super::body::Read;
use super::error::Fault;
use super::labels::Labels;
use super::words::{bytes_of, text};
use model::Model;
use std::path::Path;

fn parsed(path: &Path) -> Result<(Model, usize), ImportError> {
    let bytes = bytes_of(path)?;
    let text = text(&bytes);
    let read: Result<Model, Fault> = match super::extension_of(path).as_str() {
        "feb" => febio::parse(&text),
        _ => abaqus::parse(&text),
    };
    let checked = read.and_then(|mut model| {
        announced::check(&model, bytes.len())?;
        model.place_instances()?;
        Ok(model)
    });
    let model = checked.map_err(|fault| fault.of(path))?;
    Ok((model, bytes.len()))
}

/// Reads the tetrahedra of an `.inp` or `.feb` file.
pub(super) fn read(path: &Path) -> Result<Read, ImportError> {
    let (model, _) = parsed(path)?;
    model.tets().map_err(|fault| fault.of(path))
}

/// Reads its sets.
pub(super) fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    let (model, bytes) = parsed(path)?;
    sets::labels(&model, bytes).map_err(|fault| fault.of(path))
}
