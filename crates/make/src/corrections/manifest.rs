//! A file more in `bundle.json`, with what names it.

use std::path::Path;

use anyhow::Result;
use indexmap::IndexMap;
use serde_json::{Value, json};

use yardstick::manifest::{Manifest, hex};

/// Lists `file` and sets the entry `corrections`.
pub fn add(bundle: &Path, file: &str, entry: &Value) -> Result<()> {
    list(bundle, file, "corrections", |manifest| {
        manifest.set("corrections", entry, "prior")
    })
}

/// Takes a file off the list, and away from the bundle's folder.
pub fn forget(bundle: &Path, file: &str) -> Result<()> {
    let mut manifest = Manifest::read(bundle)?;
    let mut files: IndexMap<String, Value> = manifest.get("files")?.unwrap_or_default();
    if files.shift_remove(file).is_none() {
        return Ok(());
    }
    manifest.set("files", &json!(files), "")?;
    manifest.write()?;
    // Where other bundles share it, it lies in the body's folder, and stays.
    match std::fs::remove_file(bundle.join(file)) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
        _ => Ok(()),
    }
}

/// Lists `file`, changes the manifest, sets the requirement, and seals it.
pub fn list(
    bundle: &Path,
    file: &str,
    requirement: &str,
    change: impl FnOnce(&mut Manifest) -> Result<()>,
) -> Result<()> {
    let mut manifest = Manifest::read(bundle)?;
    let bytes = std::fs::read(bundle.join(file))?;
    let mut files: IndexMap<String, Value> = manifest.get("files")?.unwrap_or_default();
    files.insert(
        file.to_owned(),
        json!({"bytes": bytes.len(), "sha256": hex(&bytes)}),
    );
    files.sort_keys();
    manifest.set("files", &json!(files), "")?;
    change(&mut manifest)?;
    let mut requires: Vec<String> = manifest.get("requires")?.unwrap_or_default();
    if !requires.iter().any(|name| name == requirement) {
        requires.push(requirement.to_owned());
        requires.sort();
        manifest.set("requires", &json!(requires), "version")?;
    }
    manifest.write()
}
