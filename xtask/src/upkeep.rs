//! `cargo xtask header`, `api`, `bundle`, `soup`, `view`, `study` and `readme`: one program or one page, with its set-up.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::process::{run_checked, run_visibly};
use crate::workspace::{Workspace, write_between_markers};
use crate::{ort, venv};

/// Writes include/upt.h and the C# bindings from the library's source.
pub fn header(workspace: &Workspace, check: bool, release: bool) -> Result<bool> {
    let word = match (check, release) {
        (true, _) => "--check",
        (_, true) => "--release",
        _ => "",
    };
    run_visibly(&mut workspace.cargo(&format!("run --quiet --release -p upt-bindgen -- {word}")))
}

/// Writes the pages of docs/reference that are made of the languages' sources.
pub fn api(workspace: &Workspace, check: bool) -> Result<bool> {
    venv::create(workspace, "target/venv")?;
    let mut command = workspace.python("xtask/api/api.py");
    run_visibly(command.args(check.then_some("--check")))
}

/// Runs the Python package's command line with the environment set up: `cargo xtask bundle -- export ...`.
pub fn bundle(workspace: &Workspace, module: &str, arguments: &[String]) -> Result<bool> {
    venv::install(workspace, venv::TRAINING)?;
    let mut command = workspace.python("-m");
    workspace.with_parts(&mut command)?;
    run_visibly(command.arg(module).args(arguments))
}

/// Writes the file for IEC 62304; what it lacks is printed.
pub fn soup(workspace: &Workspace, out: &Path) -> Result<bool> {
    venv::create(workspace, "target/venv")?;
    run_visibly(workspace.python("xtask/soup/soup.py").arg(out))
}

/// Runs `upt view` until it is ended.
pub fn view(workspace: &Workspace, bundle: &Path) -> Result<bool> {
    workspace.build_for_demo()?;
    let mut command = workspace.command(workspace.upt(), "view");
    ort::set_environment(workspace, &mut command)?;
    run_visibly(command.arg(bundle))
}

/// Runs the study with all set-up.
pub fn study(workspace: &Workspace, arguments: &[String]) -> Result<bool> {
    run_checked(
        workspace,
        "cargo build",
        &mut workspace.cargo("build --release -p upt-study"),
    )?;
    let mut command = workspace.command(workspace.study(), "");
    ort::set_environment(workspace, &mut command)?;
    run_visibly(command.args(arguments))
}

/// The tables that `cargo xtask study report` wrote for documents, one after another, between the markers of a page.
pub fn readme(workspace: &Workspace, page: &Path, reports: &[PathBuf]) -> Result<bool> {
    let read = |path: &PathBuf| {
        let text = std::fs::read_to_string(path);
        text.with_context(|| format!("cannot read {}", path.display()))
    };
    let tables = reports.iter().map(read).collect::<Result<String>>()?;
    write_between_markers(&workspace.root.join(page), "readme", |_| Ok(tables))?;
    Ok(true)
}
