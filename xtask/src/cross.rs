//! Other platforms from this machine: `cargo xtask package --platform`, and the stages that run their tests under Wine
//! and qemu. The building itself is `xtask/cross/`, the tests are `tests/cross/run.sh`.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, bail};

use crate::counts::{self, Outcome};
use crate::ort::{self, Platform};
use crate::process::run_checked;
use crate::workspace::Workspace;

/// What is particular to a platform that is built for from Linux x86-64.
struct Cross {
    triple: &'static str,
    /// The compiler's prefix, as in `x86_64-w64-mingw32-gcc`.
    prefix: &'static str,
    /// CMake's names of system and processor.
    system: [&'static str; 2],
    wheel: &'static str,
}

fn of(platform: Platform) -> Option<Cross> {
    match platform {
        Platform::WindowsX64 => Some(Cross {
            triple: "x86_64-pc-windows-gnu",
            prefix: "x86_64-w64-mingw32-",
            system: ["Windows", "x86_64"],
            wheel: "win_amd64",
        }),
        Platform::LinuxArm64 => Some(Cross {
            triple: "aarch64-unknown-linux-gnu",
            prefix: "aarch64-linux-gnu-",
            system: ["Linux", "aarch64"],
            wheel: "linux_aarch64",
        }),
        // Linked by LLVM's linker; CMake compiles nothing for it.
        Platform::MacosArm64 => Some(Cross {
            triple: "aarch64-apple-darwin",
            prefix: "",
            system: ["Darwin", "arm64"],
            wheel: "macosx_11_0_arm64",
        }),
        Platform::MacosX64 => Some(Cross {
            triple: "x86_64-apple-darwin",
            prefix: "",
            system: ["Darwin", "x86_64"],
            wheel: "macosx_10_12_x86_64",
        }),
        Platform::LinuxX64 => None,
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
        .env("UPT_CROSS_SYSTEM", cross.system[0])
        .env("UPT_CROSS_PROCESSOR", cross.system[1])
        .env("UPT_CROSS_PREFIX", cross.prefix);
}

/// Builds packages, as `-p libupt -p upt-cli` (library and command); the folder with what they make.
pub fn build(workspace: &Workspace, platform: Platform, packages: &str) -> Result<PathBuf> {
    let (Some(cross), Ok(Platform::LinuxX64)) = (of(platform), Platform::host()) else {
        let name = platform.name();
        bail!("{name} is not built for on this machine: run `cargo xtask package` there");
    };
    let triple = cross.triple;
    let words = format!("xtask/cross/cargo.sh {triple} build --release {packages}");
    let label = format!("cargo build for {}", platform.name());
    let mut command = workspace.bash(&words);
    command.env("UPT_PYTHON", workspace.venv_program("python"));
    run_checked(workspace, &label, &mut command)?;
    Ok(workspace.path(&format!("target/cross/build/{triple}/release")))
}

/// A platform whose C library is in no registry: what links for it, and why that is no package.
#[derive(Clone, Copy)]
pub struct Linked {
    pub name: &'static str,
    triple: &'static str,
    lacks: &'static str,
}

pub const LINKED: [Linked; 2] = [
    Linked {
        name: "windows-msvc",
        triple: "x86_64-pc-windows-msvc",
        lacks: "Microsoft's C runtime is in no package registry, and stand-ins for it are not for users; the package of windows-x64 has an upt.lib \
                for hosts of that toolchain",
    },
    Linked {
        name: "android-arm64",
        triple: "aarch64-linux-android",
        lacks: "Android's C library and unwinder are in no package registry: with Google's NDK, `cargo build --release -p libupt --target \
                aarch64-linux-android` and its clang as linker",
    },
];

/// How far the library gets; never a package.
pub fn linked(workspace: &Workspace, platform: Linked) -> Result<bool> {
    println!("no package for {}: {}", platform.name, platform.lacks);
    workspace.build()?;
    let mut command = workspace.bash("tests/cross/check.sh");
    command
        .arg(platform.triple)
        .env("UPT_LIB_DIR", &workspace.release);
    run_checked(workspace, "tests/cross/check.sh", &mut command)?;
    Ok(false)
}

/// `upt.lib`, which hosts of Microsoft's toolchain link against, into `folder`.
pub fn import_library(workspace: &Workspace, built: &Path, folder: &Path) -> Result<()> {
    let mut command = workspace.bash("xtask/cross/import_library.sh");
    run_checked(workspace, "dlltool", command.args([built, folder]))
}

/// `cargo xtask test --only windows`.
pub fn windows(workspace: &Workspace) -> Result<Outcome> {
    stage(workspace, "windows", Platform::WindowsX64)
}

/// `cargo xtask test --only arm64`.
pub fn arm64(workspace: &Workspace) -> Result<Outcome> {
    stage(workspace, "arm64", Platform::LinuxArm64)
}

/// `cargo xtask test --only linked`.
pub fn linked_stage(workspace: &Workspace) -> Result<Outcome> {
    if !matches!(Platform::host(), Ok(Platform::LinuxX64)) {
        return Ok(Outcome::skipped("is linked on Linux x86-64 only"));
    }
    counts::script(workspace, "linked", "tests/cross/check.sh", &[])
}

fn stage(workspace: &Workspace, name: &str, platform: Platform) -> Result<Outcome> {
    if !matches!(Platform::host(), Ok(Platform::LinuxX64)) {
        return Ok(Outcome::skipped("is built on Linux x86-64 only"));
    }
    let theirs = ort::fetch(workspace, platform, ort::VERSION)?;
    let ours = ort::host_library(workspace)?;
    let environment = [("UPT_CROSS_ORT", &*theirs), ("UPT_CROSS_HOST_ORT", &*ours)];
    let words = format!("tests/cross/run.sh {name}");
    counts::script(workspace, name, &words, &environment)
}
