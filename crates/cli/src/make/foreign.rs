//! Files that a kept library of Python reads: NIfTI label volumes (nibabel, SciPy). They become a `.ply` in the work folder, and go
//! on from there like any other file.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use super::stages::Stage;
use crate::python;

const SCRIPT: &str = include_str!("foreign.py");

/// The kind of a foreign file, what it becomes, and the packages that read it.
fn kind(input: &Path) -> Option<(&'static str, &'static str, &'static [&'static str])> {
    let name = input.file_name()?.to_string_lossy().to_lowercase();
    let ends = |end: &str| name.ends_with(end);
    if ends(".nii") || ends(".nii.gz") {
        Some((
            "nifti",
            "converted.ply",
            &["nibabel==5.3.2", "scipy>=1.14,<2"],
        ))
    } else {
        None
    }
}

/// The file itself, or what its labels (all, where none is given) were converted to.
pub fn convert(input: &Path, labels: &[i64], stage: &mut Stage) -> Result<PathBuf> {
    let Some((kind, name, packages)) = kind(input) else {
        if !labels.is_empty() {
            bail!(
                "{}: has no labels; --label is for label volumes",
                input.display()
            );
        }
        return Ok(input.to_owned());
    };
    if !input.is_file() {
        bail!("{}: is no file", input.display());
    }
    let python = python::with(packages, &mut |said| stage.decided(said))?;
    let out = stage.folder.join(name);
    let ran = Command::new(&python)
        .args(["-c", SCRIPT, kind])
        .arg(input)
        .arg(&out)
        .args(labels.iter().map(i64::to_string))
        .output()
        .with_context(|| format!("{}: cannot be started", python.display()))?;
    let said = String::from_utf8_lossy(&ran.stderr);
    if !ran.status.success() {
        let last = said.lines().last().unwrap_or("no message").to_owned();
        bail!("{}: cannot be read: {last}", input.display());
    }
    for line in String::from_utf8_lossy(&ran.stdout).lines() {
        stage.decided(line);
    }
    Ok(out)
}
