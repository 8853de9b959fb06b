//! `cargo xtask package`: a relocatable archive for C and C++ hosts, and the Unity package.
//!
//! ```text
//! libupt-VERSION-PLATFORM/
//!   bin/upt                            the command
//!   lib/libupt.so -> .so.0 -> .so.V    the library; libupt.a; libonnxruntime.so beside it
//!   lib/cmake/upt/, lib/pkgconfig/     find_package(upt), pkg-config upt
//!   include/upt.h, upt.hpp
//!   share/upt/bundles/, examples/
//!   share/doc/upt/                     licences, notices, README, CHANGELOG, docs/
//! ```

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::archive;
use crate::cross;
use crate::documents;
use crate::licences;
use crate::ort::{self, Platform};
use crate::process::{has_program, run_checked};
use crate::stages;
use crate::wheel;
use crate::workspace::Workspace;

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
    let out = if options.out.is_absolute() {
        options.out.clone()
    } else {
        workspace.root.join(&options.out)
    };
    std::fs::create_dir_all(&out)?;
    let made = if options.wheel {
        match options.platform {
            Some(platform) if platform != Platform::host()? => {
                wheel::make_for(workspace, platform, &out)?
            }
            _ => wheel::make(workspace, &out)?,
        }
    } else if options.unity {
        unity(workspace, &out)?
    } else {
        let host = Platform::host()?;
        match options.platform {
            Some(platform) if platform != host => foreign(workspace, platform, &out)?,
            _ => native(workspace, host, &out)?,
        }
    };
    println!("{}", made.display());
    Ok(true)
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
fn copy(from: &Path, to: &Path) -> Result<()> {
    let context = || format!("cannot copy {} to {}", from.display(), to.display());
    if from.is_dir() {
        std::fs::create_dir_all(to).with_context(context)?;
        for entry in std::fs::read_dir(from).with_context(context)? {
            let entry = entry?;
            copy(&entry.path(), &to.join(entry.file_name()))?;
        }
        return Ok(());
    }
    if let Some(folder) = to.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::copy(from, to).with_context(context)?;
    Ok(())
}

/// What is the same on every platform: bundles, examples, licences.
fn shared(workspace: &Workspace, root: &Path, ort_folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(workspace.path("onnx"))? {
        let path = entry?.path();
        if path.join("bundle.json").is_file() {
            copy(
                &path,
                &root
                    .join("share/upt/bundles")
                    .join(path.file_name().context("a bundle has a name")?),
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
    copy(
        &ort_folder.join("LICENSE"),
        &doc.join("onnxruntime/LICENSE"),
    )?;
    copy(
        &ort_folder.join("ThirdPartyNotices.txt"),
        &doc.join("onnxruntime/ThirdPartyNotices.txt"),
    )?;
    std::fs::write(doc.join("THIRD-PARTY.txt"), licences::notice(workspace)?)?;
    Ok(())
}

fn native(workspace: &Workspace, host: Platform, out: &Path) -> Result<PathBuf> {
    if !has_program("cmake") {
        bail!(
            "cmake is missing: it writes the find_package and pkg-config files (Debian: apt-get install cmake)"
        );
    }
    let ort_folder = ort::fetch(workspace, host, ort::VERSION)?;
    stages::build(workspace)?;
    let name = format!("libupt-{}-{}", version(workspace)?, host.name());
    let root = out.join(&name);
    std::fs::remove_dir_all(&root).ok();
    install(workspace, None, &workspace.release(), &root)?;
    let library = if cfg!(windows) {
        "onnxruntime.dll"
    } else if cfg!(target_os = "macos") {
        "libonnxruntime.dylib"
    } else {
        "libonnxruntime.so"
    };
    let folder = if cfg!(windows) { "bin" } else { "lib" };
    copy(&ort_folder.join(library), &root.join(folder).join(library))?;
    let program = format!("upt{}", std::env::consts::EXE_SUFFIX);
    copy(&workspace.upt(), &root.join("bin").join(program))?;
    #[cfg(unix)]
    std::os::unix::fs::symlink(format!("../lib/{library}"), root.join("bin").join(library))?;
    shared(workspace, &root, &ort_folder)?;
    archive(workspace, out, &name)
}

/// The archive for another platform: built here where that is possible, else laid out without libupt.
fn foreign(workspace: &Workspace, platform: Platform, out: &Path) -> Result<PathBuf> {
    let ort_folder = ort::fetch(workspace, platform, ort::VERSION)?;
    let name = format!("libupt-{}-{}", version(workspace)?, platform.name());
    let root = out.join(&name);
    std::fs::remove_dir_all(&root).ok();
    let (folder, library) = match platform {
        Platform::WindowsX64 => ("bin", "onnxruntime.dll"),
        Platform::MacosArm64 => ("lib", "libonnxruntime.dylib"),
        Platform::LinuxX64 | Platform::LinuxArm64 => ("lib", "libonnxruntime.so"),
    };
    if platform == Platform::MacosArm64 {
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
        let built = cross::build(workspace, platform, &["upt", "upt-cli"])?;
        install(workspace, Some(platform), &built, &root)?;
        if platform == Platform::WindowsX64 {
            copy(&built.join("upt.exe"), &root.join("bin/upt.exe"))?;
            cross::import_library(workspace, &built, &root.join("lib"))?;
        } else {
            copy(&built.join("upt"), &root.join("bin/upt"))?;
            #[cfg(unix)]
            std::os::unix::fs::symlink(
                format!("../lib/{library}"),
                root.join("bin").join(library),
            )?;
        }
    }
    copy(&ort_folder.join(library), &root.join(folder).join(library))?;
    shared(workspace, &root, &ort_folder)?;
    archive(workspace, out, &name)
}

/// Library, headers, CMake and pkg-config files, by CMake.
fn install(
    workspace: &Workspace,
    platform: Option<Platform>,
    built: &Path,
    root: &Path,
) -> Result<()> {
    let build = workspace.path(&format!(
        "target/package-cmake{}",
        platform.map_or_else(String::new, |platform| format!("-{}", platform.name()))
    ));
    let log = workspace.logs().join("package.log");
    let mut configure = Command::new("cmake");
    configure
        .arg("-S")
        .arg(workspace.path("cmake"))
        .arg("-B")
        .arg(&build)
        .arg(format!("-DUPT_LIB_DIR={}", built.display()))
        .arg(format!("-DCMAKE_INSTALL_PREFIX={}", root.display()))
        .arg("-DCMAKE_INSTALL_LIBDIR=lib");
    if let Some(platform) = platform {
        cross::configure(workspace, platform, &mut configure);
    }
    run_checked("cmake", &mut configure, &log)?;
    run_checked(
        "cmake --install",
        Command::new("cmake").arg("--install").arg(&build),
        &log,
    )?;
    Ok(())
}

/// A .tar.gz: the same commit gives the same bytes.
fn archive(workspace: &Workspace, out: &Path, name: &str) -> Result<PathBuf> {
    let file = out.join(format!("{name}.tar.gz"));
    archive::pack(out, name, &file, archive::time(&workspace.root))?;
    Ok(file)
}

/// The Unity package with the native plugins: this platform's libupt, and ONNX Runtime of every platform
/// whose libupt is there.
fn unity(workspace: &Workspace, out: &Path) -> Result<PathBuf> {
    let host = Platform::host()?;
    let ort_folder = ort::fetch(workspace, host, ort::VERSION)?;
    stages::build(workspace)?;
    let name = "package";
    let staging = out.join("unity");
    let root = staging.join(name);
    std::fs::remove_dir_all(&staging).ok();
    copy(&workspace.path("unity-plugin"), &root)?;
    let (folder, libraries): (&str, &[&str]) = match host {
        Platform::LinuxX64 => ("Linux/x86_64", &["libupt.so", "libonnxruntime.so"]),
        Platform::LinuxArm64 => ("Linux/arm64", &["libupt.so", "libonnxruntime.so"]),
        Platform::WindowsX64 => ("Windows/x86_64", &["upt.dll", "onnxruntime.dll"]),
        Platform::MacosArm64 => ("macOS/arm64", &["libupt.dylib", "libonnxruntime.dylib"]),
    };
    let plugins = root.join("Runtime/Plugins").join(folder);
    for library in libraries {
        let from = if library.contains("onnxruntime") {
            ort_folder.join(library)
        } else {
            workspace.release().join(library)
        };
        copy(&from, &plugins.join(library))?;
    }
    // Unity leaves folders whose names end in ~ alone, so these need no .meta files.
    for entry in std::fs::read_dir(workspace.path("onnx"))? {
        let path = entry?.path();
        if path.join("bundle.json").is_file()
            && path.file_name().is_some_and(|name| name == "brain-reduced")
        {
            copy(&path, &root.join("Bundles~/brain-reduced"))?;
        }
    }
    std::fs::write(
        root.join("Documentation~/third-party-crates.txt"),
        licences::notice(workspace)?,
    )?;
    without_empty_plugins(&root)?;
    let file = out.join(format!(
        "org.libupt.soft-tissue-{}.tgz",
        version(workspace)?
    ));
    archive::pack(&staging, name, &file, archive::time(&workspace.root))?;
    Ok(file)
}

/// Removes the settings of plugins that are not in the package, and folders that hold nothing else: Unity warns about
/// them otherwise.
fn without_empty_plugins(root: &Path) -> Result<()> {
    remove_orphans(root, &root.join("Runtime/Plugins"))
}

fn remove_orphans(root: &Path, folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            remove_orphans(root, &path)?;
            if std::fs::read_dir(&path)?.next().is_none() {
                std::fs::remove_dir(&path)?;
            }
        }
    }
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let asset = path.with_extension("");
        if path.extension().is_none_or(|extension| extension != "meta") || asset.exists() {
            continue;
        }
        std::fs::remove_file(&path)?;
        if asset.extension().is_some() {
            println!(
                "left out (not built on this platform): {}",
                asset.strip_prefix(root).unwrap_or(&asset).display()
            );
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
        without_empty_plugins(root).unwrap();
        for file in files {
            let stays = file.starts_with("Linux");
            assert_eq!(plugins.join(file).exists(), stays, "{file}");
        }
        assert!(!plugins.join("Windows").exists());
    }
}
