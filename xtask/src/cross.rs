//! Other platforms from this machine: `cargo xtask package --platform`, and the stages that run their tests under Wine
//! and qemu. The building itself is `xtask/cross/`, the tests are `tests/cross/run.sh`.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, bail};

use crate::ort::{self, Platform};
use crate::process::run_checked;
use crate::stages::{self, Outcome};
use crate::workspace::Workspace;

/// What is particular to a platform that is built for from Linux x86-64.
struct Cross {
    triple: &'static str,
    /// The compiler's prefix, as in `x86_64-w64-mingw32-gcc`.
    prefix: &'static str,
    /// CMake's names.
    system: &'static str,
    processor: &'static str,
    wheel: &'static str,
}

fn of(platform: Platform) -> Option<Cross> {
    match platform {
        Platform::WindowsX64 => Some(Cross {
            triple: "x86_64-pc-windows-gnu",
            prefix: "x86_64-w64-mingw32-",
            system: "Windows",
            processor: "x86_64",
            wheel: "win_amd64",
        }),
        Platform::LinuxArm64 => Some(Cross {
            triple: "aarch64-unknown-linux-gnu",
            prefix: "aarch64-linux-gnu-",
            system: "Linux",
            processor: "aarch64",
            wheel: "linux_aarch64",
        }),
        Platform::LinuxX64 | Platform::MacosArm64 => None,
    }
}

/// The wheel's platform tag; on Linux the glibc is added when the library is known.
pub fn wheel_tag(platform: Platform) -> Option<&'static str> {
    of(platform).map(|cross| cross.wheel)
}

/// CMake's arguments and environment for the platform.
pub fn configure(workspace: &Workspace, platform: Platform, command: &mut Command) {
    let Some(cross) = of(platform) else { return };
    let file = workspace.path("xtask/cross/toolchain.cmake");
    command
        .arg(format!("-DCMAKE_TOOLCHAIN_FILE={}", file.display()))
        .env("UPT_CROSS_SYSTEM", cross.system)
        .env("UPT_CROSS_PROCESSOR", cross.processor)
        .env("UPT_CROSS_PREFIX", cross.prefix);
}

/// Builds `packages`, such as `upt` (the library) and `upt-cli` (the command); the folder with what they make.
pub fn build(workspace: &Workspace, platform: Platform, packages: &[&str]) -> Result<PathBuf> {
    let (Some(cross), Ok(Platform::LinuxX64)) = (of(platform), Platform::host()) else {
        bail!(
            "{} is not built for on this machine: run `cargo xtask package` there",
            platform.name()
        );
    };
    let mut command = Command::new("bash");
    command
        .arg(workspace.path("xtask/cross/cargo.sh"))
        .args([cross.triple, "build", "--release"])
        .args(packages.iter().flat_map(|name| ["-p", name]))
        .current_dir(&workspace.root);
    let label = format!("cargo build for {}", platform.name());
    let log = workspace.logs().join("cross-build.log");
    run_checked(&label, &mut command, &log)?;
    let folder = workspace.path("target/cross/build").join(cross.triple);
    Ok(folder.join("release"))
}

/// `upt.lib`, which hosts of Microsoft's toolchain link against, into `folder`.
pub fn import_library(workspace: &Workspace, built: &Path, folder: &Path) -> Result<()> {
    let mut command = Command::new("bash");
    command
        .arg(workspace.path("xtask/cross/import_library.sh"))
        .args([built, folder]);
    let log = workspace.logs().join("import-library.log");
    run_checked("dlltool", &mut command, &log)?;
    Ok(())
}

/// `cargo xtask test --only windows`.
pub fn windows(workspace: &Workspace) -> Result<Outcome> {
    stage(workspace, "windows", Platform::WindowsX64)
}

/// `cargo xtask test --only arm64`.
pub fn arm64(workspace: &Workspace) -> Result<Outcome> {
    stage(workspace, "arm64", Platform::LinuxArm64)
}

fn stage(workspace: &Workspace, name: &str, platform: Platform) -> Result<Outcome> {
    if !matches!(Platform::host(), Ok(Platform::LinuxX64)) {
        return Ok(Outcome::skipped("is built on Linux x86-64 only".into()));
    }
    let theirs = ort::fetch(workspace, platform, ort::VERSION)?;
    let ours = ort::host_library(workspace)?;
    stages::script_with(workspace, name, "tests/cross/run.sh", |command| {
        command
            .arg(name)
            .env("UPT_CROSS_ORT", &theirs)
            .env("UPT_CROSS_HOST_ORT", &ours);
    })
}
