//! `cargo xtask rivals`: what a developer would pick instead, on the same mesh and poses. Everything that it needs lies
//! in `target/rivals`, and neither the tests nor the library know of it.

use std::process::Command;

use anyhow::Result;

use crate::process::{output, run_checked, run_visibly};
use crate::workspace::{Workspace, program_in};
use crate::{ort, venv};

const FOLDER: &str = "target/rivals";
const PACKAGES: &str =
    "numpy==2.4.6 matplotlib==3.11.2 mujoco==4.0.0 newton==1.8.0 warp-lang==1.19.0 pybullet==3.2.7";
const JOLT: &str = "jolt-physics@1.1.0";

/// Sets the peers up, measures those that could be, and passes the arguments on to `xtask/rivals`.
pub fn run(workspace: &Workspace, arguments: &[String]) -> Result<bool> {
    let folder = workspace.path(FOLDER);
    std::fs::create_dir_all(&folder)?;
    let environment = format!("{FOLDER}/venv");
    venv::create(workspace, &environment)?;
    let python = program_in(&workspace.path(&environment), "python");
    let mut command = workspace.command(&python, venv::PIP_INSTALL);
    let label = "pip install (rivals)";
    run_checked(workspace, label, command.args(PACKAGES.split_whitespace()))?;
    let jolt = folder.join("package");
    if !jolt.join("package.json").exists()
        && let Err(error) = unpack_jolt(workspace)
    {
        eprintln!("rivals: no rows of Jolt: {error:#}");
    }
    let rapier = format!(
        "build --quiet --release --manifest-path xtask/rivals/rapier/Cargo.toml --target-dir {FOLDER}/rapier"
    );
    run_checked(
        workspace,
        "cargo build (rapier)",
        &mut workspace.cargo(&rapier),
    )?;
    let own = "build --quiet --release -p libupt -p upt-cli";
    run_checked(workspace, "cargo build (libupt)", &mut workspace.cargo(own))?;

    let mut study = Command::new(&python);
    study
        .current_dir(&folder)
        .arg(workspace.path("xtask/rivals"));
    ort::set_environment(workspace, &mut study)?;
    study
        .env("PYTHONPATH", workspace.path("python"))
        .env(
            "UPT_LIBRARY",
            workspace.release.join(format!(
                "{}upt{}",
                std::env::consts::DLL_PREFIX,
                std::env::consts::DLL_SUFFIX
            )),
        )
        .arg("--out")
        .arg(&folder)
        .arg("--upt")
        .arg(workspace.upt())
        .arg("--jolt")
        .arg(jolt)
        .arg("--rapier")
        .arg(
            folder
                .join("rapier/release")
                .join(format!("rivals-rapier{}", std::env::consts::EXE_SUFFIX)),
        )
        .args(arguments);
    run_visibly(&mut study)
}

/// npm checks the package's hash.
fn unpack_jolt(workspace: &Workspace) -> Result<()> {
    let place = format!("--pack-destination {FOLDER}");
    let archive = output(
        workspace
            .command("npm", "pack --silent")
            .arg(JOLT)
            .args(place.split_whitespace()),
    )?;
    let archive = workspace.path(FOLDER).join(archive.trim());
    let mut tar = workspace.command("tar", "xzf");
    run_checked(workspace, "tar", tar.arg(archive).arg("-C").arg(FOLDER))
}
