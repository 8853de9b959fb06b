//! `cargo xtask sbom`: bills of materials and checksums beside packages (`xtask/package/sbom.py`).

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use crate::process::run_checked;
use crate::workspace::Workspace;
use crate::{archive, venv};

/// Where `cargo xtask package` leaves packages, unless it is told otherwise.
const FOLDER: &str = "target/package";

/// Endings of packages.
const PACKAGES: [&str; 4] = [".tar.gz", ".tgz", ".whl", ".crate"];

/// `PACKAGE.cdx.json` and `PACKAGE.spdx.json` of each, and `SHA256SUMS` of their folders.
pub fn write(workspace: &Workspace, packages: &[PathBuf]) -> Result<()> {
    venv::install(workspace, venv::SBOM)?;
    let mut command = workspace.python("xtask/package/sbom.py");
    command
        .args(packages)
        .env("SOURCE_DATE_EPOCH", archive::time(workspace).to_string());
    run_checked(workspace, "sbom", &mut command)
}

/// Those that are named, or all of the folder of packages.
pub fn run(workspace: &Workspace, named: &[PathBuf]) -> Result<bool> {
    let mut packages: Vec<PathBuf> = named.iter().map(|path| workspace.root.join(path)).collect();
    if packages.is_empty() {
        let folder = workspace.path(FOLDER);
        let entries = std::fs::read_dir(&folder).context("run `cargo xtask package` first")?;
        let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
        let is_package = |path: &PathBuf| {
            let name = path.to_string_lossy();
            PACKAGES.iter().any(|ending| name.ends_with(ending))
        };
        packages = files.filter(is_package).collect();
        packages.sort();
        let place = folder.display();
        ensure!(
            !packages.is_empty(),
            "{place} holds no package: run `cargo xtask package` first"
        );
    }
    write(workspace, &packages)?;
    for package in &packages {
        let place = package.display();
        println!("{place}.cdx.json\n{place}.spdx.json");
    }
    Ok(true)
}
