//! Finished rows on disk, by the content that they depend on: an interrupted report goes on where it was.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use super::row::Measurement;

/// Changes when a measurement comes to mean something else.
const VERSION: u32 = 1;

pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The folder is made when the first row is stored.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_path_buf(),
        }
    }

    /// A key over everything in `parts`; order matters.
    pub fn key(parts: &[&str]) -> String {
        let mut hash = Sha256::new();
        hash.update(VERSION.to_le_bytes());
        for part in parts {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part.as_bytes());
        }
        hash.finalize()
            .iter()
            .take(16)
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }

    /// A stored row, or none when there is none or it cannot be read.
    pub fn load(&self, key: &str) -> Option<Measurement> {
        let bytes = std::fs::read(self.folder.join(format!("{key}.json"))).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Stored whole or not at all.
    pub fn store(&self, key: &str, measurement: &Measurement) -> Result<()> {
        std::fs::create_dir_all(&self.folder)
            .with_context(|| format!("cannot make {}", self.folder.display()))?;
        let temporary = self
            .folder
            .join(format!("{key}.{}.tmp", std::process::id()));
        std::fs::write(&temporary, serde_json::to_vec(measurement)?)?;
        std::fs::rename(&temporary, self.folder.join(format!("{key}.json")))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_comes_back_under_its_key_only() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(&folder.path().join("rows"));
        let mut measurement = Measurement::default();
        measurement.row.method = "TLED".into();
        let key = Cache::key(&["a", "bc"]);
        assert!(cache.load(&key).is_none());
        cache.store(&key, &measurement).unwrap();
        assert_eq!(cache.load(&key).unwrap().row.method, "TLED");
        assert!(cache.load(&Cache::key(&["ab", "c"])).is_none());
    }
}
