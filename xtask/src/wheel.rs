//! The Python package `python/`: its wheel, its sdist, and the stage that installs the wheel into an environment of its own and
//! tests it there.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::counts::{Outcome, check, counted, summary};
use crate::ort::Platform;
use crate::process::run_checked;
use crate::venv::{self, PIP_INSTALL};
use crate::workspace::{Workspace, library, program_in};
use crate::{archive, cross};

/// A wheel with the libupt of this platform or of another one, built here, in `out`.
pub fn make(workspace: &Workspace, platform: Platform, out: &Path) -> Result<PathBuf> {
    let host = Platform::host()? == platform;
    let built = match host {
        true => workspace.build().map(|()| workspace.release.clone())?,
        false => cross::build(workspace, platform, "-p libupt")?,
    };
    venv::create(workspace, "target/venv")?;
    let scratch = workspace.path("target/python/wheel");
    std::fs::remove_dir_all(&scratch).ok();
    let mut command = workspace
        .python("-m pip wheel --quiet --disable-pip-version-check --no-deps ./python --wheel-dir");
    command
        .arg(&scratch)
        .env("UPT_WHEEL_LIBRARY", built.join(library(platform)))
        .env("SOURCE_DATE_EPOCH", archive::time(workspace).to_string());
    if let (false, Some(tag)) = (host, cross::wheel_tag(platform)) {
        command.env("UPT_WHEEL_PLATFORM", tag);
    }
    run_checked(workspace, "pip wheel", &mut command)?;
    // The only file of the folder.
    let made = std::fs::read_dir(&scratch)?.next().context("no wheel")??;
    let place = out.join(made.file_name());
    std::fs::create_dir_all(out)?;
    std::fs::copy(made.path(), &place)?;
    // What its platform would find, read here: most of them never run it.
    let mut read = workspace.python("tests/cross/wheel_file.py");
    run_checked(workspace, "wheel_file.py", read.arg(&place))?;
    Ok(place)
}

/// The source of package and library, with an organ, in `out`.
pub fn source(workspace: &Workspace, out: &Path) -> Result<PathBuf> {
    venv::install(workspace, venv::SDIST)?;
    let mut command = workspace.python("-c");
    command
        .arg("import sys; from setuptools import build_meta; build_meta.build_sdist(sys.argv[1])")
        .arg(out)
        .current_dir(workspace.path("python"));
    run_checked(workspace, "sdist", &mut command)?;
    Ok(out.join(format!("libupt-{}.tar.gz", env!("CARGO_PKG_VERSION"))))
}

/// The sdist, unpacked where no clone is: cargo finds all of the library's source offline, and a wheel is made from it, in a nightly run with
/// a library that is built there.
fn source_stage(workspace: &Workspace, out: &Path) -> Result<Outcome> {
    let place = workspace.path("target/python/source");
    std::fs::remove_dir_all(&place).ok();
    std::fs::create_dir_all(&place)?;
    let file = source(workspace, out)?;
    let mut unpack = workspace.command("tar", "-xzf");
    unpack.arg(file).arg("-C").arg(&place);
    run_checked(workspace, "tar", &mut unpack)?;
    let version = format!("libupt-{}", env!("CARGO_PKG_VERSION"));
    let package = place.join(&version);
    let mut tree = workspace.cargo("tree --offline --quiet --package libupt");
    tree.current_dir(package.join("rust").join(&version));
    let found = check(workspace, "source of the sdist", &mut tree)?;
    let words = "-m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation . --wheel-dir ../wheel";
    let mut command = workspace.python(words);
    command.current_dir(&package);
    if std::env::var_os("UPT_NIGHTLY").is_none() {
        let built = workspace.release.join(library(Platform::host()?));
        command.env("UPT_WHEEL_LIBRARY", built);
    }
    let wheel = check(workspace, "wheel from the sdist", &mut command)?;
    Ok(found.and(wheel))
}

/// `cargo xtask test --only wheel`.
pub fn stage(workspace: &Workspace) -> Result<Outcome> {
    let out = workspace.path("target/package");
    let wheel = make(workspace, Platform::host()?, &out)?;
    venv::create(workspace, "target/venv-upt")?;
    let environment = workspace.path("target/venv-upt");
    let python = |words: &str| workspace.command(program_in(&environment, "python"), words);
    // The dependencies once, then the wheel as it is today.
    for more in ["", "--force-reinstall --no-deps"] {
        let mut command = python(&format!("{PIP_INSTALL} {more}"));
        command.arg(format!("{}[test]", wheel.display()));
        run_checked(workspace, "pip install (wheel)", &mut command)?;
    }
    let program = program_in(&environment, "mypy");
    let mut mypy = workspace.command(program, "--cache-dir ../target/mypy");
    mypy.current_dir(workspace.path("python"));
    let types = check(workspace, "mypy", &mut mypy)?;
    // From outside of python/, so that the installed package is tested; its ONNX Runtime is the one of its own environment.
    let mut command = python("-m pytest -q -p no:cacheprovider ../python");
    command
        .current_dir(workspace.path("target"))
        .env_remove("ORT_DYLIB_PATH")
        .env_remove("UPT_LIBRARY");
    let tests = counted(workspace, "pytest of the wheel", &mut command, summary)?;
    Ok(types.and(tests).and(source_stage(workspace, &out)?))
}
