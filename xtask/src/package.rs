//! `cargo xtask package`: a relocatable archive for C and C++ hosts, and the Unity package.
//!
//! ```text
//! libupt-VERSION-PLATFORM/
//!   bin/upt                            the command
//!   lib/libupt.so -> .so.0 -> .so.V    the library; libupt.a; libonnxruntime.so next to it
//!   lib/cmake/upt/, lib/pkgconfig/     find_package(upt), pkg-config upt
//!   include/upt.h, upt.hpp
//!   share/upt/bundles/, examples/
//!   share/doc/upt/                     licences, notices, README, CHANGELOG, docs/
//! ```

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use walkdir::WalkDir;

use crate::ort::{self, Platform};
use crate::process::run_checked;
use crate::system::has_program;
use crate::workspace::Workspace;
use crate::{archive, cross, documents, licences, wheel};

#[derive(Args)]
pub struct Options {
    /// Make the Unity package (.tgz with the native plugins) instead of the archive.
    #[arg(long)]
    unity: bool,
    /// Make the Python wheel instead of the archive.
    #[arg(long, conflicts_with = "unity")]
    wheel: bool,
    /// For another platform, with its ONNX Runtime: built here for Windows and Linux arm64; for macOS laid out only.
    #[arg(long)]
    platform: Option<Platform>,
    /// Folder for the result.
    #[arg(long, default_value = "target/package")]
    out: PathBuf,
}

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let out = workspace.root.join(&options.out);
    std::fs::create_dir_all(&out)?;
    let platform = options.platform.map_or_else(Platform::host, Ok)?;
    let made = match (options.wheel, options.unity) {
        (true, _) => wheel::make(workspace, platform, &out)?,
        (_, true) => unity(workspace, &out)?,
        _ => native(workspace, platform, &out)?,
    };
    println!("{}", made.display());
    Ok(true)
}

/// libupt's name on a platform.
pub fn library(platform: Platform) -> &'static str {
    match platform {
        Platform::WindowsX64 => "upt.dll",
        Platform::MacosArm64 => "libupt.dylib",
        Platform::LinuxX64 | Platform::LinuxArm64 => "libupt.so",
    }
}

fn version(workspace: &Workspace) -> Result<String> {
    let text = std::fs::read_to_string(workspace.path("Cargo.toml"))?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("version = \""))
        .context("Cargo.toml: no workspace version")?;
    Ok(line.trim_end_matches('"').to_owned())
}

/// Copies a file or a folder; links are followed.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    for entry in WalkDir::new(from).follow_links(true) {
        let entry = entry?;
        let place = match entry.depth() {
            0 => to.to_owned(),
            _ => to.join(entry.path().strip_prefix(from)?),
        };
        let context = || {
            format!(
                "cannot copy {} to {}",
                entry.path().display(),
                place.display()
            )
        };
        if entry.file_type().is_dir() {
            std::fs::create_dir_all(&place).with_context(context)?;
        } else {
            std::fs::create_dir_all(place.parent().context("a file has a folder")?)?;
            std::fs::copy(entry.path(), &place).with_context(context)?;
        }
    }
    Ok(())
}

/// What is the same on every platform: bundles, examples, licences.
fn shared(workspace: &Workspace, root: &Path, ort_folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(workspace.path("onnx"))? {
        let entry = entry?;
        if entry.path().join("bundle.json").is_file() {
            copy(
                &entry.path(),
                &root.join("share/upt/bundles").join(entry.file_name()),
            )?;
        }
    }
    for example in ["examples/c", "examples/cpp"] {
        copy(
            &workspace.path(example),
            &root.join("share/upt").join(example),
        )?;
    }
    let doc = root.join("share/doc/upt");
    documents::copy(workspace, &doc)?;
    for name in ["LICENSE-APACHE", "LICENSE-MIT"] {
        copy(&workspace.path(name), &doc.join(name))?;
    }
    for name in ["LICENSE", "ThirdPartyNotices.txt"] {
        copy(&ort_folder.join(name), &doc.join("onnxruntime").join(name))?;
    }
    std::fs::write(doc.join("THIRD-PARTY.txt"), licences::notice(workspace)?)?;
    Ok(())
}

/// The archive: of this platform, of one that is built for here, or of macOS laid out without libupt.
fn native(workspace: &Workspace, platform: Platform, out: &Path) -> Result<PathBuf> {
    ensure!(
        has_program("cmake"),
        "cmake is missing: it writes the find_package and pkg-config files (Debian: apt-get install cmake)"
    );
    let ort_folder = ort::fetch(workspace, platform, ort::VERSION)?;
    let name = format!("libupt-{}-{}", version(workspace)?, platform.name());
    let root = out.join(&name);
    std::fs::remove_dir_all(&root).ok();
    let is_host = Platform::host()? == platform;
    let (windows, onnx) = (platform == Platform::WindowsX64, platform.library());
    if platform == Platform::MacosArm64 && !is_host {
        for header in ["include/upt.h", "include/upt.hpp"] {
            copy(&workspace.path(header), &root.join(header))?;
        }
        std::fs::write(
            root.join("INCOMPLETE.txt"),
            "This archive was laid out on another platform and holds no libupt.\n\
             On macOS: run `cargo build --release` and put libupt.dylib into lib/, or run `cargo xtask package` there.\n\
             The library has not been run on macOS by its authors.\n",
        )?;
    } else {
        let built = match is_host {
            true => workspace.build().map(|()| workspace.release.clone())?,
            false => cross::build(workspace, platform, "-p upt -p upt-cli")?,
        };
        install(workspace, (!is_host).then_some(platform), &built, &root)?;
        let program = if windows { "upt.exe" } else { "upt" };
        copy(&built.join(program), &root.join("bin").join(program))?;
        if windows && !is_host {
            cross::import_library(workspace, &built, &root.join("lib"))?;
        }
        #[cfg(unix)]
        if !windows {
            std::os::unix::fs::symlink(format!("../lib/{onnx}"), root.join("bin").join(onnx))?;
        }
    }
    let folder = if windows { "bin" } else { "lib" };
    copy(&ort_folder.join(onnx), &root.join(folder).join(onnx))?;
    shared(workspace, &root, &ort_folder)?;
    let file = out.join(format!("{name}.tar.gz"));
    archive::pack(out, &name, &file, archive::time(workspace))?;
    Ok(file)
}

/// Library, headers, CMake and pkg-config files, by CMake.
fn install(
    workspace: &Workspace,
    other: Option<Platform>,
    built: &Path,
    root: &Path,
) -> Result<()> {
    let suffix = other.map_or_else(String::new, |platform| format!("-{}", platform.name()));
    let build = format!("target/package-cmake{suffix}");
    let words = format!("-S cmake -B {build} -DCMAKE_INSTALL_LIBDIR=lib");
    let mut configure = workspace.command("cmake", &words);
    configure
        .arg(format!("-DUPT_LIB_DIR={}", built.display()))
        .arg(format!("-DCMAKE_INSTALL_PREFIX={}", root.display()));
    if let Some(platform) = other {
        cross::configure(workspace, platform, &mut configure);
    }
    run_checked(workspace, "cmake", &mut configure)?;
    let mut install = workspace.command("cmake", &format!("--install {build}"));
    run_checked(workspace, "cmake --install", &mut install)
}

/// The Unity package with the native plugins of this platform: libupt and ONNX Runtime.
fn unity(workspace: &Workspace, out: &Path) -> Result<PathBuf> {
    let host = Platform::host()?;
    let ort_folder = ort::fetch(workspace, host, ort::VERSION)?;
    workspace.build()?;
    let root = out.join("unity/package");
    std::fs::remove_dir_all(out.join("unity")).ok();
    copy(&workspace.path("unity-plugin"), &root)?;
    let plugins = root.join("Runtime/Plugins");
    let own = plugins.join(match host {
        Platform::LinuxX64 => "Linux/x86_64",
        Platform::LinuxArm64 => "Linux/arm64",
        Platform::WindowsX64 => "Windows/x86_64",
        Platform::MacosArm64 => "macOS/arm64",
    });
    for (folder, name) in [
        (&workspace.release, library(host)),
        (&ort_folder, host.library()),
    ] {
        copy(&folder.join(name), &own.join(name))?;
    }
    // Unity leaves folders whose names end in ~ alone, so these need no .meta files.
    copy(
        &workspace.path("onnx/brain-reduced"),
        &root.join("Bundles~/brain-reduced"),
    )?;
    let notice = licences::notice(workspace)?;
    std::fs::write(root.join("Documentation~/third-party-crates.txt"), notice)?;
    remove_orphans(&root, &plugins)?;
    let file = out.join(format!(
        "org.libupt.soft-tissue-{}.tgz",
        version(workspace)?
    ));
    archive::pack(
        &out.join("unity"),
        "package",
        &file,
        archive::time(workspace),
    )?;
    Ok(file)
}

/// Removes the settings of plugins that are not in the package, and folders that hold nothing else: Unity warns about
/// them otherwise.
fn remove_orphans(root: &Path, folder: &Path) -> Result<()> {
    // What is inside of a folder first: an empty folder goes, and its settings with it.
    for entry in WalkDir::new(folder).min_depth(1).contents_first(true) {
        let path = entry?.into_path();
        if path.is_dir() {
            remove_settings(root, &path)?;
            if std::fs::read_dir(&path)?.next().is_none() {
                std::fs::remove_dir(&path)?;
            }
        }
    }
    remove_settings(root, folder)
}

/// Settings in one folder without what they are for.
fn remove_settings(root: &Path, folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let asset = path.with_extension("");
        if path
            .extension()
            .is_some_and(|extension| extension == "meta")
            && !asset.exists()
        {
            std::fs::remove_file(&path)?;
            if asset.extension().is_some() {
                let name = asset.strip_prefix(root).unwrap_or(&asset);
                println!("left out (not built on this platform): {}", name.display());
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_without_their_library_leave_with_their_folders() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let plugins = root.join("Runtime/Plugins");
        let files = [
            "Linux.meta",
            "Linux/x86_64.meta",
            "Linux/x86_64/libupt.so",
            "Linux/x86_64/libupt.so.meta",
            "Windows.meta",
            "Windows/x86_64.meta",
            "Windows/x86_64/upt.dll.meta",
        ];
        for file in files {
            let path = plugins.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        remove_orphans(root, &plugins).unwrap();
        for file in files {
            let stays = file.starts_with("Linux");
            assert_eq!(plugins.join(file).exists(), stays, "{file}");
        }
        assert!(!plugins.join("Windows").exists());
    }
}
