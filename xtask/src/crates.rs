//! `cargo xtask package --platform crates`: the library and its layers as a registry takes them (`.crate`), each with what its `include`
//! names. Nothing is uploaded.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::process::run_checked;
use crate::workspace::Workspace;

/// Below crates.io's own limit of 10 MB: a package that grew past this has caught files that nobody builds.
const LARGEST: u64 = 2_000_000;

/// Every package of the workspace that its manifest lets be published, in `out`.
pub fn package(workspace: &Workspace, out: &Path) -> Result<Vec<PathBuf>> {
    let names = published(workspace)?;
    let made = out.join("crates");
    let mut command = workspace.cargo("package --quiet --no-verify --allow-dirty --offline");
    command.arg("--target-dir").arg(&made);
    for name in &names {
        command.args(["--package", name]);
    }
    run_checked(workspace, "cargo package", &mut command)?;
    let mut packages = Vec::new();
    for name in names {
        let file = format!("{name}-{}.crate", env!("CARGO_PKG_VERSION"));
        let (from, to) = (made.join("package").join(&file), out.join(&file));
        std::fs::copy(&from, &to).with_context(|| format!("{}", from.display()))?;
        let bytes = to.metadata()?.len();
        ensure!(bytes < LARGEST, "{file} has {bytes} bytes");
        packages.push(to);
    }
    std::fs::remove_dir_all(made)?;
    Ok(packages)
}

/// Names of the packages without `publish = false`.
pub fn published(workspace: &Workspace) -> Result<Vec<String>> {
    let mut command = workspace.cargo("metadata --format-version 1 --no-deps --offline");
    let told = command.output().context("cargo metadata")?;
    let metadata: serde_json::Value = serde_json::from_slice(&told.stdout)?;
    let packages = metadata["packages"].as_array().context("no packages")?;
    let names: Vec<String> = packages
        .iter()
        .filter(|one| one["publish"].is_null())
        .filter_map(|one| one["name"].as_str().map(str::to_owned))
        .collect();
    ensure!(!names.is_empty(), "every package has `publish = false`");
    Ok(names)
}
