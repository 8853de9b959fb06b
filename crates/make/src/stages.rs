//! Stages of a run: a record of each in the work folder, keyed by everything that it was made from.
//!
//! A stage whose record has the same key and whose files have the recorded sizes is not made again. Records are written last, so
//! a killed stage leaves none.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::Watch;

/// Names the layout of what stages write; a change makes all of them anew.
const LAYOUT: &str = "upt make 5";

/// SHA-256 of the parts, each with its length before it.
pub fn key_of(parts: &[&[u8]]) -> String {
    let mut hash = Sha256::new();
    hash.update(LAYOUT);
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

/// What a finished stage leaves in addition to its files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    pub key: String,
    /// Bytes of each file.
    files: Vec<(String, u64)>,
    pub seconds: f64,
    /// What it decided and why.
    pub decided: Vec<String>,
}

/// A stage while it runs.
pub struct Stage {
    /// Where its files go.
    pub folder: PathBuf,
    decided: Vec<String>,
    watch: Watch,
}

impl Stage {
    /// Something that was decided, said at once and kept in the record.
    pub fn decided(&mut self, what: &str) {
        self.watch.tell(&format!("      {what}"));
        self.decided.push(what.to_owned());
    }
}

/// The work folder; one process at a time.
pub struct Work {
    folder: PathBuf,
    watch: Watch,
    _lock: File,
}

impl Work {
    /// Opens or makes the folder.
    pub fn open(folder: &Path, watch: &Watch) -> Result<Self> {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot be made", folder.display()))?;
        let path = folder.join("lock");
        let lock = File::create(&path)
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => bail!(
                "{}: another `upt make` is working here; wait for it, or choose another folder with --work",
                folder.display()
            ),
            // A file system without locks.
            Err(std::fs::TryLockError::Error(_)) => {}
        }
        Ok(Self {
            folder: folder.into(),
            watch: watch.clone(),
            _lock: lock,
        })
    }

    /// A file of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// A line for the user.
    pub fn tell(&self, text: &str) {
        self.watch.tell(&format!("      {text}"));
    }

    fn kept(&self, name: &str, key: &str) -> Option<Record> {
        let text = std::fs::read(self.folder.join(format!("{name}.stage.json"))).ok()?;
        let record: Record = serde_json::from_slice(&text).ok()?;
        let whole = |(file, bytes): &(String, u64)| {
            std::fs::metadata(self.folder.join(file)).is_ok_and(|found| found.len() == *bytes)
        };
        (record.key == key && record.files.iter().all(whole)).then_some(record)
    }

    /// Runs a stage that writes `files`, or takes what an earlier run left.
    pub fn stage(
        &mut self,
        name: &str,
        key: &str,
        files: &[&str],
        make: impl FnOnce(&mut Stage) -> Result<()>,
    ) -> Result<Record> {
        let key = key_of(&[name.as_bytes(), key.as_bytes()]);
        if let Some(record) = self.kept(name, &key) {
            self.watch.tell(&format!(
                "{name}: kept from an earlier run ({:.1} s saved)",
                record.seconds
            ));
            return Ok(record);
        }
        self.watch.tell(name);
        let path = self.folder.join(format!("{name}.stage.json"));
        // Whatever was made before belongs to another key.
        let _ = std::fs::remove_file(&path);
        let started = Instant::now();
        let mut stage = Stage {
            folder: self.folder.clone(),
            decided: Vec::new(),
            watch: self.watch.clone(),
        };
        make(&mut stage).with_context(|| {
            format!(
                "stage `{name}` (what is finished stays in {})",
                self.folder.display()
            )
        })?;
        let record = Record {
            key,
            files: files
                .iter()
                .map(|file| {
                    let path = self.folder.join(file);
                    let found = std::fs::metadata(&path)
                        .with_context(|| format!("{}: was not written", path.display()))?;
                    Ok(((*file).to_owned(), found.len()))
                })
                .collect::<Result<_>>()?,
            seconds: started.elapsed().as_secs_f64(),
            decided: stage.decided,
        };
        let text = serde_json::to_vec_pretty(&record)?;
        tissue::tensors::write_whole(&path, |file| std::io::Write::write_all(file, &text))
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        self.watch
            .tell(&format!("      done in {:.1} s", record.seconds));
        Ok(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_is_made_once_a_key_and_again_when_its_file_is_damaged() {
        let folder = tempfile::tempdir().unwrap();
        let mut made = 0;
        let mut run = |work: &mut Work, key: &str| {
            work.stage("one", key, &["out"], |stage| {
                made += 1;
                std::fs::write(stage.folder.join("out"), "text")?;
                Ok(())
            })
            .unwrap();
        };
        let mut work = Work::open(folder.path(), &Watch::default()).unwrap();
        run(&mut work, "a");
        run(&mut work, "a");
        run(&mut work, "b");
        std::fs::write(folder.path().join("out"), "te").unwrap();
        run(&mut work, "b");
        assert_eq!(made, 3);
    }

    #[test]
    fn a_stage_that_fails_leaves_no_record_and_a_second_process_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut work = Work::open(folder.path(), &Watch::default()).unwrap();
        assert!(Work::open(folder.path(), &Watch::default()).is_err());
        let failed = work.stage("one", "a", &["out"], |_| bail!("full"));
        assert!(failed.is_err());
        assert!(!folder.path().join("one.stage.json").exists());
    }
}
