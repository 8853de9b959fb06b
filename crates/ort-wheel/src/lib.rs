//! ONNX Runtime's shared library out of the `onnxruntime` wheel.
//!
//! The wheel is downloaded by pip (so that proxies and mirrors work as the user set them up), checked against the table below,
//! and its library and licences laid down in a folder.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use sha2::{Digest, Sha256};

/// The version that the library is tested with.
pub const VERSION: &str = "1.31.1";

/// Platforms that libupt is built for.
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
    /// Without a wheel of the tested version.
    #[value(name = "macos-x64", alias = "macos-x86_64")]
    MacosX64,
}

impl Platform {
    /// That of this program.
    ///
    /// # Errors
    /// Where no wheel is known; says what to do.
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

    /// As the command line names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::LinuxX64 => "linux-x64",
            Self::LinuxArm64 => "linux-arm64",
            Self::WindowsX64 => "windows-x64",
            Self::MacosArm64 => "macos-arm64",
            Self::MacosX64 => "macos-x64",
        }
    }

    /// Whether ONNX Runtime has a wheel for it. Where it has none, bundles without a network run.
    pub fn has_wheel(self) -> bool {
        WHEELS.iter().any(|wheel| wheel.1 == self)
    }

    /// The wheel's platform tag.
    fn tag(self) -> &'static str {
        match self {
            Self::LinuxX64 => "manylinux_2_28_x86_64",
            Self::LinuxArm64 => "manylinux_2_28_aarch64",
            Self::WindowsX64 => "win_amd64",
            Self::MacosArm64 => "macosx_14_0_arm64",
            Self::MacosX64 => "macosx_14_0_x86_64",
        }
    }

    /// The library's name in the wheel.
    fn stored(self, version: &str) -> String {
        match self {
            Self::LinuxX64 | Self::LinuxArm64 => format!("libonnxruntime.so.{version}"),
            Self::WindowsX64 => "onnxruntime.dll".into(),
            Self::MacosArm64 | Self::MacosX64 => format!("libonnxruntime.{version}.dylib"),
        }
    }

    /// The name by which a program loads the library.
    pub fn library(self) -> &'static str {
        match self {
            Self::LinuxX64 | Self::LinuxArm64 => "libonnxruntime.so",
            Self::WindowsX64 => "onnxruntime.dll",
            Self::MacosArm64 | Self::MacosX64 => "libonnxruntime.dylib",
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

/// Whether `folder` holds the library of that version.
pub fn is_there(folder: &Path, platform: Platform, version: &str) -> bool {
    let stamp = std::fs::read_to_string(folder.join("version.txt"));
    stamp.is_ok_and(|found| found.trim() == version) && folder.join(platform.library()).is_file()
}

/// Puts the library, `LICENSE` and `ThirdPartyNotices.txt` into `folder`, by the pip and the zip reader of `python`; downloads
/// nothing where they are there. `run` starts pip, with what it does for its label.
///
/// # Errors
/// An unknown version, what `run` says, a wheel that is not the published one.
pub fn fetch(
    folder: &Path,
    platform: Platform,
    version: &str,
    python: &Path,
    run: &mut dyn FnMut(&str, &mut Command) -> Result<()>,
) -> Result<PathBuf> {
    let library = folder.join(platform.library());
    if is_there(folder, platform, version) {
        return Ok(library);
    }
    let expected = checksum(platform, version)?;
    let scratch = folder.join("unpacked");
    std::fs::remove_dir_all(&scratch).ok();
    std::fs::create_dir_all(&scratch).with_context(|| format!("{}", scratch.display()))?;
    let mut command = Command::new(python);
    let wanted = format!("onnxruntime=={version}");
    #[rustfmt::skip]
    command.args([
        "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps", "--only-binary=:all:",
        "--implementation", "cp", "--python-version", "3.11", "--abi", "cp311",
        "--platform", platform.tag(), &wanted, "-d",
    ]);
    let label = format!("pip download onnxruntime {version} ({})", platform.name());
    run(&label, command.arg(&scratch))?;
    let wheel = std::fs::read_dir(&scratch)?
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
        .with_context(|| format!("pip left no wheel in {}", scratch.display()))?;
    check(&wheel, expected)?;
    let mut command = Command::new(python);
    command.args(["-m", "zipfile", "-e"]).arg(&wheel);
    run("unpack the wheel", command.arg(&scratch))?;
    let root = scratch.join("onnxruntime");
    let stored = root.join("capi").join(platform.stored(version));
    for (from, to) in [
        (stored, platform.library()),
        (root.join("LICENSE"), "LICENSE"),
        (root.join("ThirdPartyNotices.txt"), "ThirdPartyNotices.txt"),
    ] {
        std::fs::rename(&from, folder.join(to))
            .with_context(|| format!("{} is not in the wheel", from.display()))?;
    }
    std::fs::remove_dir_all(&scratch)?;
    std::fs::write(folder.join("version.txt"), version)?;
    Ok(library)
}

fn checksum(platform: Platform, version: &str) -> Result<&'static str> {
    if !platform.has_wheel() {
        bail!(
            "ONNX Runtime has no wheel for {}: build it and set ORT_DYLIB_PATH to its library",
            platform.name()
        );
    }
    let mut of_platform = WHEELS.iter().filter(|wheel| wheel.1 == platform);
    let found = of_platform.clone().find(|wheel| wheel.0 == version);
    found.map(|wheel| wheel.2).with_context(|| {
        let known: Vec<&str> = of_platform.by_ref().map(|wheel| wheel.0).collect();
        format!(
            "no checksum is known for ONNX Runtime {version} on {}; known: {}",
            platform.name(),
            known.join(", ")
        )
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_platform_has_a_checksum_for_the_tested_version() {
        let mut with_wheel = Platform::value_variants().to_vec();
        with_wheel.retain(|&platform| platform.has_wheel());
        assert_eq!(with_wheel.len(), 4);
        for platform in with_wheel {
            let hash = checksum(platform, VERSION).unwrap();
            assert_eq!(hash.len(), 64, "{}", platform.name());
        }
    }

    #[test]
    fn an_unknown_version_names_those_that_are_known() {
        let error = checksum(Platform::LinuxX64, "0.1").unwrap_err();
        assert!(error.to_string().contains(VERSION), "{error}");
        let error = checksum(Platform::MacosX64, VERSION).unwrap_err();
        assert!(error.to_string().contains("has no wheel"), "{error}");
    }

    /// A download that is not the published wheel leaves no library behind, and a later fetch starts again.
    #[test]
    fn a_damaged_wheel_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let python = Path::new("python");
        let mut runs = 0;
        let mut fake = |_: &str, command: &mut Command| {
            runs += 1;
            let scratch = command.get_args().last().unwrap();
            std::fs::write(Path::new(scratch).join("x.whl"), b"not a wheel")?;
            Ok(())
        };
        for _ in 0..2 {
            let error = fetch(
                folder.path(),
                Platform::LinuxX64,
                VERSION,
                python,
                &mut fake,
            );
            let error = error.unwrap_err().to_string();
            assert!(error.contains("damaged"), "{error}");
        }
        assert_eq!(runs, 2);
        assert!(!is_there(folder.path(), Platform::LinuxX64, VERSION));
    }
}
