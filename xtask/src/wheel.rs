//! The Python package `python/`: its wheel, and the stage that installs the wheel into an environment of its own and
//! tests it there.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::archive;
use crate::counts;
use crate::cross;
use crate::ort::Platform;
use crate::process::{run_checked, run_logged};
use crate::stages::{self, Outcome, check, joined};
use crate::venv;
use crate::workspace::Workspace;

/// What the tests need, beside the wheel's own dependencies.
const TEST_EXTRA: &str = "[test]";

/// A wheel with this machine's libupt, in `out`.
pub fn make(workspace: &Workspace, out: &Path) -> Result<PathBuf> {
    stages::build(workspace)?;
    let name = format!(
        "{}upt{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    with_library(workspace, out, &workspace.release().join(name), None)
}

/// A wheel with the libupt of another platform, built here.
pub fn make_for(workspace: &Workspace, platform: Platform, out: &Path) -> Result<PathBuf> {
    let built = cross::build(workspace, platform, &["upt"])?;
    let name = if platform == Platform::WindowsX64 {
        "upt.dll"
    } else {
        "libupt.so"
    };
    let tag = cross::wheel_tag(platform);
    with_library(workspace, out, &built.join(name), tag)
}

/// A wheel with a library that is built already; `platform` is its tag where the library is another platform's.
pub fn with_library(
    workspace: &Workspace,
    out: &Path,
    library: &Path,
    platform: Option<&str>,
) -> Result<PathBuf> {
    venv::create(workspace)?;
    let scratch = workspace.path("target/python/wheel");
    std::fs::remove_dir_all(&scratch).ok();
    let mut command = venv::pip(workspace);
    command
        .args([
            "wheel",
            "--quiet",
            "--disable-pip-version-check",
            "--no-deps",
            "--wheel-dir",
        ])
        .arg(&scratch)
        .arg(workspace.path("python"))
        .env("UPT_WHEEL_LIBRARY", library)
        .env(
            "SOURCE_DATE_EPOCH",
            archive::time(&workspace.root).to_string(),
        );
    if let Some(platform) = platform {
        command.env("UPT_WHEEL_PLATFORM", platform);
    }
    run_checked(
        "pip wheel",
        &mut command,
        &workspace.logs().join("wheel.log"),
    )?;
    let made = std::fs::read_dir(&scratch)?
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
        .with_context(|| format!("pip left no wheel in {}", scratch.display()))?;
    let place = out.join(made.file_name().context("a wheel has a name")?);
    std::fs::create_dir_all(out)?;
    std::fs::copy(&made, &place)?;
    Ok(place)
}

/// `cargo xtask test --only wheel`.
pub fn stage(workspace: &Workspace) -> Result<Outcome> {
    let wheel = make(workspace, &workspace.path("target/package"))?;
    let environment = workspace.path("target/venv-upt");
    venv::create_at(workspace, &environment)?;
    let python = Workspace::program_in(&environment, "python");
    let log = workspace.logs().join("pip-wheel.log");
    // The dependencies once, then the wheel as it is today.
    let with_tests = format!("{}{TEST_EXTRA}", wheel.display());
    for more in [&[][..], &["--force-reinstall", "--no-deps"]] {
        let mut command = Command::new(&python);
        command
            .args([
                "-m",
                "pip",
                "install",
                "--quiet",
                "--disable-pip-version-check",
            ])
            .args(more)
            .arg(&with_tests);
        run_checked("pip install (wheel)", &mut command, &log)?;
    }
    let types = check(
        workspace,
        "mypy",
        Command::new(Workspace::program_in(&environment, "mypy"))
            .args(["--cache-dir", "../target/mypy"])
            .current_dir(workspace.path("python")),
    )?;
    // From outside of python/, so that the installed package is tested; its ONNX Runtime is the one of its own environment.
    let mut command = Command::new(&python);
    command
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .arg(workspace.path("python"))
        .current_dir(workspace.path("target"))
        .env_remove("ORT_DYLIB_PATH")
        .env_remove("UPT_LIBRARY");
    let log = workspace.logs().join("pytest-wheel.log");
    let finished = run_logged("pytest of the wheel", &mut command, &log)?;
    let tests = Outcome::of(&finished, counts::pytest(&finished.text));
    Ok(joined(vec![types, tests]))
}
