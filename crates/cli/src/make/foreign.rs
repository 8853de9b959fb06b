//! Files that a kept library of Python reads: Abaqus and CalculiX (`.inp`, meshio), FEBio (`.feb`, XML), NIfTI label volumes
//! (nibabel, scikit-image). They become a `.vtu` or a `.ply` in the work folder, and go on from there like any other file.
//!
//! The interpreter is `UPT_PYTHON` where that is set, else one of an environment that this command makes once for a user.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use super::stages::Stage;

const SCRIPT: &str = include_str!("foreign.py");

/// The kind of a foreign file, what it becomes, and the packages that read it.
fn kind(input: &Path) -> Option<(&'static str, &'static str, &'static [&'static str])> {
    let name = input.file_name()?.to_string_lossy().to_lowercase();
    let ends = |end: &str| name.ends_with(end);
    if ends(".inp") {
        Some(("inp", "converted.vtu", &["meshio==5.3.5"]))
    } else if ends(".feb") {
        Some(("feb", "converted.vtu", &["meshio==5.3.5"]))
    } else if ends(".nii") || ends(".nii.gz") {
        Some((
            "nifti",
            "converted.ply",
            &["nibabel==5.3.2", "scikit-image==0.25.2"],
        ))
    } else {
        None
    }
}

/// The file itself, or what it was converted to.
pub fn convert(input: &Path, stage: &mut Stage) -> Result<PathBuf> {
    let Some((kind, name, packages)) = kind(input) else {
        return Ok(input.to_owned());
    };
    if !input.is_file() {
        bail!("{}: is no file", input.display());
    }
    let python = python(packages, stage)?;
    let out = stage.folder.join(name);
    let ran = Command::new(&python)
        .args(["-c", SCRIPT, kind])
        .arg(input)
        .arg(&out)
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

/// Where the user's own environment stands.
fn environment() -> Result<PathBuf> {
    let variable = |name: &str| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let cache = variable("XDG_CACHE_HOME")
        .or_else(|| variable("LOCALAPPDATA"))
        .or_else(|| Some(variable("HOME")?.join(".cache")));
    let cache = cache.context("there is no folder for a Python environment: set XDG_CACHE_HOME")?;
    Ok(cache.join("upt").join("python"))
}

fn python(packages: &[&str], stage: &mut Stage) -> Result<PathBuf> {
    if let Some(named) = std::env::var_os("UPT_PYTHON").filter(|value| !value.is_empty()) {
        return Ok(named.into());
    }
    let folder = environment()?;
    let python = if cfg!(windows) {
        folder.join("Scripts").join("python.exe")
    } else {
        folder.join("bin").join("python")
    };
    let run = |command: &mut Command, what: &str| -> Result<()> {
        let ran = command.output().with_context(|| {
            format!("{what}: Python 3 is not there; install it, or name one with UPT_PYTHON")
        })?;
        if !ran.status.success() {
            let said = String::from_utf8_lossy(&ran.stderr);
            let last = said.lines().last().unwrap_or("no message");
            bail!("{what}: {last}");
        }
        Ok(())
    };
    if !python.is_file() {
        stage.decided(&format!(
            "makes a Python environment in {}",
            folder.display()
        ));
        let start = if cfg!(windows) { "python" } else { "python3" };
        run(
            Command::new(start).args(["-m", "venv"]).arg(&folder),
            "python3 -m venv",
        )?;
    }
    run(
        Command::new(&python)
            .args([
                "-m",
                "pip",
                "install",
                "--quiet",
                "--disable-pip-version-check",
            ])
            .args(packages),
        &format!("pip install {}", packages.join(" ")),
    )?;
    Ok(python)
}
