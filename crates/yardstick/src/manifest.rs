//! A bundle's `bundle.json`, changed and sealed again; what is not changed keeps its bytes and its place.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use indexmap::IndexMap;
use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_json::value::RawValue;
use sha2::{Digest, Sha256};

/// The manifest's own digest.
const SEAL: &str = "manifest_sha256";

/// Hex digits of the SHA-256 of `bytes`.
pub fn hex(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A manifest as it was read, its keys in their order.
pub struct Manifest {
    path: PathBuf,
    fields: IndexMap<String, Box<RawValue>>,
}

impl Manifest {
    /// Reads `bundle.json` of a bundle folder.
    ///
    /// # Errors
    /// Names the file.
    pub fn read(bundle: &Path) -> Result<Self> {
        let path = bundle.join("bundle.json");
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        let fields = serde_json::from_str(&text).with_context(|| format!("{}", path.display()))?;
        Ok(Self { path, fields })
    }

    /// A key's value; none where it is absent.
    ///
    /// # Errors
    /// Names file and key.
    pub fn get<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>> {
        let value = self.fields.get(name).map(|raw| raw.get());
        value
            .map(serde_json::from_str)
            .transpose()
            .with_context(|| format!("{}: field `{name}`", self.path.display()))
    }

    /// Sets a key; a new one comes behind `after`, or last.
    pub fn set(&mut self, name: &str, value: &Value, after: &str) -> Result<()> {
        let text = serde_json::to_string_pretty(value)?.replace('\n', "\n  ");
        let raw = RawValue::from_string(text)?;
        if self.fields.contains_key(name) {
            self.fields.insert(name.to_owned(), raw);
        } else {
            let end = self.fields.len();
            let at = self.fields.get_index_of(after).map_or(end, |at| at + 1);
            self.fields.shift_insert(at, name.to_owned(), raw);
        }
        Ok(())
    }

    /// Seals the manifest (`docs/reference/formats.md`, "The manifest's digest") and writes it whole.
    ///
    /// # Errors
    /// Names the file.
    pub fn write(mut self) -> Result<()> {
        let blank = "0".repeat(64);
        let seal = RawValue::from_string(format!("\"{blank}\""))?;
        self.fields.insert(SEAL.to_owned(), seal);
        let lines: Vec<String> = self
            .fields
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
        tissue::tensors::write_whole(&self.path, |file| {
            std::io::Write::write_all(file, text.as_bytes())
        })
        .with_context(|| format!("{}: cannot be written", self.path.display()))
    }
}
