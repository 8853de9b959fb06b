//! `onnx/index.json`: the bundles that a clone does not hold, as they were when this program was built.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

/// The committed file.
const TEXT: &str = include_str!("../../../../onnx/index.json");

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Index {
    format: String,
    version: u32,
    /// By name.
    pub assets: BTreeMap<String, Asset>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asset {
    /// Of `bundle.json`, which holds those of the other files.
    pub sha256: String,
    /// All files, those of the body too.
    pub bytes: u64,
    /// A commit of the repository that holds the bundle below `onnx/`.
    pub commit: String,
    /// What it is.
    pub about: String,
}

impl Index {
    pub(super) fn shipped() -> Result<Index> {
        let index: Index = serde_json::from_str(TEXT).context("onnx/index.json")?;
        ensure!(
            index.format == "upt-bundle-index" && index.version == 1,
            "onnx/index.json: has format {} {}, must be upt-bundle-index 1",
            index.format,
            index.version
        );
        Ok(index)
    }

    /// For messages.
    pub(super) fn names(&self) -> String {
        let names: Vec<&str> = self.assets.keys().map(String::as_str).collect();
        names.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_asset_states_hash_size_and_commit() {
        let index = Index::shipped().unwrap();
        assert!(!index.assets.is_empty());
        let is_hex = |text: &str, digits: usize| {
            text.len() == digits && text.bytes().all(|byte| byte.is_ascii_hexdigit())
        };
        for (name, asset) in &index.assets {
            assert!(is_hex(&asset.sha256, 64), "{name}");
            assert!(is_hex(&asset.commit, 40), "{name}");
            assert!(asset.bytes > 1_000_000 && !asset.about.is_empty(), "{name}");
        }
    }
}
