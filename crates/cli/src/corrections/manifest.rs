//! A file and an entry more in `bundle.json`.

use std::path::Path;

use anyhow::Result;
use indexmap::IndexMap;
use serde_json::{Value, json};

use crate::manifest::{Manifest, hex};

/// Lists `file`, sets the entry and the requirement `corrections`, and seals the manifest.
pub fn add(bundle: &Path, file: &str, entry: &Value) -> Result<()> {
    let mut manifest = Manifest::read(bundle)?;
    let bytes = std::fs::read(bundle.join(file))?;
    let mut files: IndexMap<String, Value> = manifest.get("files")?.unwrap_or_default();
    files.insert(
        file.to_owned(),
        json!({"bytes": bytes.len(), "sha256": hex(&bytes)}),
    );
    files.sort_keys();
    manifest.set("files", &json!(files), "")?;
    manifest.set("corrections", entry, "prior")?;
    let mut requires: Vec<String> = manifest.get("requires")?.unwrap_or_default();
    if !requires.iter().any(|name| name == "corrections") {
        requires.push("corrections".to_owned());
        requires.sort();
        manifest.set("requires", &json!(requires), "version")?;
    }
    manifest.write()
}
