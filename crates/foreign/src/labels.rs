//! Files that kept libraries of Python read: label volumes (nibabel, SimpleITK, SciPy). They become a `.ply` in a folder, and go on
//! from there like any other file.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::python;

const SCRIPT: &str = include_str!("labels.py");

/// The packages that read a label volume; none for other files.
fn packages(input: &Path) -> Option<[&'static str; 2]> {
    let name = input.file_name()?.to_string_lossy().to_lowercase();
    let ends = |ends: &[&str]| ends.iter().any(|end| name.ends_with(end));
    let reader = if ends(&[".nii", ".nii.gz"]) {
        "nibabel==5.3.2"
    } else if ends(&[".nrrd", ".mha"]) {
        "SimpleITK>=2.4,<3"
    } else {
        return None;
    };
    Some([reader, "scipy>=1.14,<2"])
}

/// What is heard of a conversion.
pub enum Said<'a> {
    /// What was found, or is done first.
    Line(&'a str),
    /// How far it is.
    Percent(u64),
}

/// The file itself, or what its labels (all, where none is given) were converted to, in `folder`.
///
/// # Errors
/// Names the file; without Python 3 says what to do.
pub fn convert(
    input: &Path,
    labels: &[i64],
    folder: &Path,
    hear: &mut dyn FnMut(Said<'_>),
) -> Result<PathBuf> {
    let Some(packages) = packages(input) else {
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
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be made", folder.display()))?;
    let python = python::with(&packages, &mut |line| hear(Said::Line(line)))?;
    let out = folder.join("converted.ply");
    let mut running = Command::new(&python)
        .args(["-c", SCRIPT])
        .arg(input)
        .arg(&out)
        .args(labels.iter().map(i64::to_string))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("{}: cannot be started", python.display()))?;
    // Both pipes are read at once, so that neither fills up.
    let errors = running.stderr.take();
    let errors = std::thread::spawn(move || {
        let mut said = Vec::new();
        errors.map(|mut pipe| pipe.read_to_end(&mut said));
        String::from_utf8_lossy(&said).into_owned()
    });
    let lines = running
        .stdout
        .take()
        .map(|pipe| BufReader::new(pipe).lines());
    for line in lines.into_iter().flatten().map_while(Result::ok) {
        match line.strip_prefix("progress ") {
            Some(percent) => hear(Said::Percent(percent.trim().parse().unwrap_or(0))),
            None => hear(Said::Line(&line)),
        }
    }
    let status = running.wait()?;
    let said = errors.join().unwrap_or_default();
    if !status.success() {
        let last = said.lines().last().unwrap_or("no message").to_owned();
        bail!("{}: cannot be read: {last}", input.display());
    }
    Ok(out)
}
