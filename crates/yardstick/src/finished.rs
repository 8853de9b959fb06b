//! Which cases of a dataset's folder (`upt dataset`) are finished.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Finished cases of a split of a dataset, the first `per_scheme` of each scheme.
pub fn finished(folder: &Path, split: &str, per_scheme: usize) -> Result<Vec<PathBuf>> {
    let file = folder.join("manifest.json");
    let text = std::fs::read(&file).with_context(|| {
        format!(
            "{}: cannot be read; `upt dataset` writes it",
            file.display()
        )
    })?;
    let manifest: serde_json::Value = serde_json::from_slice(&text)
        .with_context(|| format!("{}: is not JSON", file.display()))?;
    let cases = manifest["cases"]
        .as_array()
        .with_context(|| format!("{}: field `cases` is missing", file.display()))?;
    let mut taken: std::collections::BTreeMap<String, usize> = std::collections::BTreeMap::new();
    let mut paths = Vec::new();
    for case in cases {
        let text = |field: &str| case[field].as_str().unwrap_or("").to_owned();
        if text("split") != split || text("status") != "done" {
            continue;
        }
        let count = taken.entry(text("scheme")).or_default();
        if *count < per_scheme {
            *count += 1;
            paths.push(folder.join(text("file")));
        }
    }
    Ok(paths)
}
