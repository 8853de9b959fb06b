//! `cargo xtask header`, `cargo xtask bundle` and `cargo xtask view`: one program, with its set-up.

use std::path::Path;
use std::process::Command;

use anyhow::{Result, bail};

use crate::workspace::Workspace;
use crate::{ort, stages, venv};

/// Writes include/upt.h and the C# bindings from the library's source.
pub fn header(workspace: &Workspace, check: bool) -> Result<bool> {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(&workspace.root).args([
        "run",
        "--quiet",
        "--release",
        "-p",
        "upt-bindgen",
        "--",
    ]);
    if check {
        command.arg("--check");
    }
    Ok(command.status()?.success())
}

/// Runs the Python package's command line with the environment set up: `cargo xtask bundle -- export ...`.
pub fn bundle(workspace: &Workspace, module: &str, arguments: &[String]) -> Result<bool> {
    venv::create(workspace)?;
    let library = ort::host_library(workspace)?;
    venv::install_training(workspace)?;
    stages::build(workspace)?;
    let mut command = Command::new(workspace.python());
    command
        .current_dir(&workspace.root)
        .args(["-m", module])
        .args(arguments)
        .env("UPT_COMMAND", workspace.upt());
    ort::set_environment(&mut command, &library);
    let status = command.status()?;
    if !status.success() {
        bail!("python -m {module} {} failed", arguments.join(" "));
    }
    Ok(true)
}

/// Runs `upt view` until it is ended.
pub fn view(workspace: &Workspace, bundle: &Path) -> Result<bool> {
    venv::create(workspace)?;
    let library = ort::host_library(workspace)?;
    stages::build_for_demo(workspace)?;
    let mut command = Command::new(workspace.upt());
    command.current_dir(&workspace.root).arg("view").arg(bundle);
    ort::set_environment(&mut command, &library);
    Ok(command.status()?.success())
}
