//! A file and an entry more in `bundle.json`; everything else keeps its bytes and its place.

use std::path::Path;

use anyhow::{Context, Result};
use indexmap::IndexMap;
use serde_json::value::RawValue;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

/// The manifest's own digest.
const SEAL: &str = "manifest_sha256";

fn hex(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Lists `file`, sets the entry and the requirement `corrections`, and seals the manifest (`docs/reference/formats.md`, "The manifest's digest").
pub fn add(bundle: &Path, file: &str, entry: &Value) -> Result<()> {
    let path = bundle.join("bundle.json");
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    let mut fields: IndexMap<String, Box<RawValue>> =
        serde_json::from_str(&text).with_context(|| format!("{}", path.display()))?;
    let bytes = std::fs::read(bundle.join(file))?;
    let digest = hex(&bytes);
    let mut files: IndexMap<String, Value> = match fields.get("files") {
        Some(files) => serde_json::from_str(files.get())?,
        None => IndexMap::new(),
    };
    files.insert(
        file.to_owned(),
        json!({"bytes": bytes.len(), "sha256": digest}),
    );
    files.sort_keys();
    let raw = |value: &Value| -> Result<Box<RawValue>> {
        let text = serde_json::to_string_pretty(value)?.replace('\n', "\n  ");
        Ok(RawValue::from_string(text)?)
    };
    fields.insert("files".to_owned(), raw(&json!(files))?);
    let at = fields
        .get_index_of("prior")
        .map_or(fields.len(), |prior| prior + 1);
    if fields.contains_key("corrections") {
        fields.insert("corrections".to_owned(), raw(entry)?);
    } else {
        fields.shift_insert(at, "corrections".to_owned(), raw(entry)?);
    }
    let mut requires: Vec<String> = match fields.get("requires") {
        Some(requires) => serde_json::from_str(requires.get())?,
        None => Vec::new(),
    };
    if !requires.iter().any(|name| name == "corrections") {
        requires.push("corrections".to_owned());
        requires.sort();
        let at = fields
            .get_index_of("version")
            .map_or(0, |version| version + 1);
        let value = RawValue::from_string(serde_json::to_string(&requires)?)?;
        if fields.insert("requires".to_owned(), value).is_none() {
            fields.move_index(fields.len() - 1, at);
        }
    }
    let blank = "0".repeat(64);
    fields.insert(
        SEAL.to_owned(),
        RawValue::from_string(format!("\"{blank}\""))?,
    );
    let lines: Vec<String> = fields
        .iter()
        .map(|(name, value)| {
            Ok(format!(
                "  {}: {}",
                serde_json::to_string(name)?,
                value.get()
            ))
        })
        .collect::<Result<_>>()?;
    let text = format!("{{\n{}\n}}\n", lines.join(",\n"));
    let text = text.replace(&blank, &hex(text.as_bytes()));
    tissue::tensors::write_whole(&path, |file| {
        std::io::Write::write_all(file, text.as_bytes())
    })
    .with_context(|| format!("{}: cannot be written", path.display()))
}
