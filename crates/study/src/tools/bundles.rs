//! Bundles that fit the cases.

use std::path::PathBuf;

use anyhow::{Result, bail};

use yardstick::bundle_folder::BundleFolder;
use yardstick::cases::ToolCases;

/// The bundles made for the cases' mesh, boundary and tissue; where bundles were named, another is an error.
pub fn fitting(
    named_paths: &[PathBuf],
    cases: &ToolCases,
    notes: &mut Vec<String>,
) -> Result<Vec<BundleFolder>> {
    let named = !named_paths.is_empty();
    let paths = match named {
        true => named_paths.to_vec(),
        false => upt_cli::doctor::bundles_below("onnx".as_ref()),
    };
    let mesh = &cases.list[0].trajectory.header.mesh_name;
    let mut fitting = Vec::new();
    for path in &paths {
        let bundle = BundleFolder::read(path)?;
        let Some(reason) = bundle.misfit(&cases.list[0].trajectory.header) else {
            fitting.push(bundle);
            continue;
        };
        if named {
            bail!("{reason}; name a bundle or a dataset that fits");
        }
        notes.push(reason);
    }
    if fitting.is_empty() {
        bail!("no bundle below onnx/ fits the mesh {mesh} of the cases; name one with --bundle");
    }
    Ok(fitting)
}
