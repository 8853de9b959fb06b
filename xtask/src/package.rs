//! `cargo xtask package`: a relocatable archive for C and C++ hosts, the Unity package, the wheel, and the npm package (`web.rs`). Beside each lie
//! its bills of materials and checksums (`sbom.rs`). `crates.rs` makes what Rust's registry takes: source, whose bill names what a build of it links.
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
use clap::{Args, ValueEnum};

use crate::ort::{self, Platform};
use crate::process::run_checked;
use crate::system::has_program;
use crate::workspace::{Workspace, copy, library};
use crate::{archive, crates, cross, sbom, venv, web, wheel};

#[derive(Args)]
pub struct Options {
    /// Make the Unity package (.tgz with the native plugins) instead of the archive.
    #[arg(long)]
    unity: bool,
    /// Make the Python wheel instead of the archive.
    #[arg(long, conflicts_with = "unity")]
    wheel: bool,
    /// Make the Godot addon, as the engine's Asset Library takes it, instead of the archive: for Linux x86-64, with Godot 4.3 or newer (GODOT), or fetched.
    #[arg(long, conflicts_with_all = ["unity", "wheel", "platform"])]
    godot: bool,
    /// For another platform, with its ONNX Runtime: built here, on Linux x86-64, for Windows, Linux arm64 and macOS (which never ran). `web`: the npm package.
    /// `crates`: the library and its layers as Rust's registry takes them. `sdist`: the source as Python's does. `windows-msvc` and `android-arm64`: no
    /// package, but how far the library gets, and what is missing.
    #[arg(long, value_parser = wanted)]
    platform: Option<Wanted>,
    /// Folder for the result.
    #[arg(long, default_value = "target/package")]
    out: PathBuf,
}

/// A platform of its own, any browser, or the source.
#[derive(Clone, Copy)]
enum Wanted {
    Native(Platform),
    Linked(cross::Linked),
    Web,
    Crates,
    Sdist,
}

fn wanted(text: &str) -> Result<Wanted, String> {
    match text {
        "web" => Ok(Wanted::Web),
        "crates" => Ok(Wanted::Crates),
        "sdist" => Ok(Wanted::Sdist),
        name => match cross::LINKED.iter().find(|one| one.name == name) {
            Some(&linked) => Ok(Wanted::Linked(linked)),
            None => Platform::from_str(name, false).map(Wanted::Native),
        },
    }
}

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let out = workspace.root.join(&options.out);
    std::fs::create_dir_all(&out)?;
    if let Some(Wanted::Crates) = options.platform {
        let made = crates::package(workspace, &out)?;
        for package in &made {
            println!("{}", package.display());
        }
        sbom::write(workspace, &made)?;
        return Ok(true);
    }
    venv::create(workspace, "target/venv")?;
    let platform = match options.platform {
        Some(Wanted::Web) => {
            return finish(workspace, web::package(workspace, &out)?);
        }
        Some(Wanted::Sdist) => {
            return finish(workspace, wheel::source(workspace, &out)?);
        }
        Some(Wanted::Linked(platform)) => return cross::linked(workspace, platform),
        Some(Wanted::Native(platform)) => platform,
        Some(Wanted::Crates) | None => Platform::host()?,
    };
    let made = match options {
        Options { wheel: true, .. } => wheel::make(workspace, platform, &out)?,
        Options { unity: true, .. } => unity(workspace, &out)?,
        Options { godot: true, .. } => godot(workspace, &out)?,
        _ => native(workspace, platform, &out)?,
    };
    finish(workspace, made)
}

/// What lies beside every package: what is in it, and its checksum.
fn finish(workspace: &Workspace, made: PathBuf) -> Result<bool> {
    println!("{}", made.display());
    sbom::write(workspace, &[made])?;
    Ok(true)
}

/// The workspace's.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What is the same on every platform: bundles, examples, licences.
fn shared(workspace: &Workspace, root: &Path, ort_folder: Option<&Path>) -> Result<()> {
    let share = root.join("share/upt");
    for bundle in workspace.bundles()? {
        let name = bundle.file_name().context("a bundle has a name")?;
        copy(&bundle, &share.join("bundles").join(name))?;
    }
    for example in ["examples/c", "examples/cpp"] {
        copy(&workspace.path(example), &share.join(example))?;
    }
    let doc = root.join("share/doc/upt");
    script(workspace, "xtask/package/documents.py", &doc)?;
    for name in ["LICENSE-APACHE", "LICENSE-MIT"] {
        copy(&workspace.path(name), &doc.join(name))?;
    }
    for name in ["LICENSE", "ThirdPartyNotices.txt"] {
        if let Some(folder) = ort_folder {
            copy(&folder.join(name), &doc.join("onnxruntime").join(name))?;
        }
    }
    script(workspace, LICENCES, &doc.join("THIRD-PARTY.txt"))
}

/// Writes the licences of all linked crates into a file; one that may not be linked stops the package.
const LICENCES: &str = "tests/style/licences.py --write";

fn script(workspace: &Workspace, words: &str, to: &Path) -> Result<()> {
    run_checked(workspace, words, workspace.python(words).arg(to))
}

/// The archive: of this platform (its library and command stripped, also of the number that tells builds in two folders apart), or of one that is built for here.
fn native(workspace: &Workspace, platform: Platform, out: &Path) -> Result<PathBuf> {
    ensure!(
        has_program("cmake"),
        "cmake is missing: it writes the find_package and pkg-config files (Debian: apt-get install cmake)"
    );
    let ort_folder = match platform.has_wheel() {
        true => Some(ort::fetch(workspace, platform, ort::VERSION)?),
        false => None,
    };
    let name = format!("libupt-{VERSION}-{}", platform.name());
    let root = out.join(&name);
    std::fs::remove_dir_all(&root).ok();
    let is_host = Platform::host()? == platform;
    let (windows, onnx) = (platform == Platform::WindowsX64, platform.library());
    let built = match is_host {
        true => workspace.build().map(|()| workspace.release.clone())?,
        false => cross::build(workspace, platform, "-p libupt -p upt-cli")?,
    };
    install(workspace, (!is_host).then_some(platform), &built, &root)?;
    let program = if windows { "upt.exe" } else { "upt" };
    let command = root.join("bin").join(program);
    copy(&built.join(program), &command)?;
    if is_host && cfg!(target_os = "linux") {
        let library = root.join("lib").join(library(platform)).canonicalize()?;
        let words = "--remove-section=.note.gnu.build-id";
        let mut strip = workspace.command("strip", words);
        run_checked(workspace, "strip", strip.args([&command, &library]))?;
    }
    if windows && !is_host {
        cross::import_library(workspace, &built, &root.join("lib"))?;
    }
    if matches!(platform, Platform::MacosArm64 | Platform::MacosX64) && !is_host {
        std::fs::write(root.join("NEVER-RUN.txt"), NEVER_RUN)?;
    }
    if let Some(ort_folder) = &ort_folder {
        #[cfg(unix)]
        if !windows {
            std::os::unix::fs::symlink(format!("../lib/{onnx}"), root.join("bin").join(onnx))?;
        }
        let folder = if windows { "bin" } else { "lib" };
        copy(&ort_folder.join(onnx), &root.join(folder).join(onnx))?;
    } else {
        println!(
            "left out: ONNX Runtime, which has no wheel for this platform; bundles without a network need none"
        );
    }
    shared(workspace, &root, ort_folder.as_deref())?;
    let file = out.join(format!("{name}.tar.gz"));
    archive::pack(out, &name, &file, archive::time(workspace))?;
    Ok(file)
}

/// What lies in the archive for macOS that is linked on Linux.
const NEVER_RUN: &str = "Library and command were linked for macOS on Linux, and have never run on a Mac: their authors have none.\n\
     `cargo xtask package` on a Mac makes the same archive there.\n";

/// Library, headers, CMake and pkg-config files, by CMake.
fn install(
    workspace: &Workspace,
    other: Option<Platform>,
    built: &Path,
    root: &Path,
) -> Result<()> {
    let name = other.map_or("", Platform::name);
    let build = format!("target/package-cmake/{name}");
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

/// The Godot addon, with libupt and a liver.
fn godot(workspace: &Workspace, out: &Path) -> Result<PathBuf> {
    let host = Platform::host()?;
    ensure!(
        host == Platform::LinuxX64,
        "the addon is made on Linux x86-64"
    );
    workspace.build()?;
    let mut command = workspace.bash("examples/godot/addon.sh");
    command
        .arg(out.join("godot"))
        .env("UPT_LIB_DIR", &workspace.release)
        .env("UPT_PYTHON", workspace.venv_program("python"))
        .env("SOURCE_DATE_EPOCH", archive::time(workspace).to_string());
    run_checked(workspace, "addon", &mut command)?;
    let name = format!("libupt-godot-{VERSION}-{}.zip", host.name());
    let file = out.join(&name);
    std::fs::copy(out.join("godot").join(&name), &file)?;
    let icon = "libupt-godot-icon.png";
    std::fs::copy(out.join("godot").join(icon), out.join(icon))?;
    Ok(file)
}

/// Folders of the plugins in the Unity package: platform, system, processor.
const PLUGINS: [(Platform, &str, &str); 4] = [
    (Platform::LinuxX64, "Linux", "x86_64"),
    (Platform::LinuxArm64, "Linux", "arm64"),
    (Platform::WindowsX64, "Windows", "x86_64"),
    (Platform::MacosArm64, "macOS", "arm64"),
];

/// The Unity package with the native plugins of this platform: libupt and ONNX Runtime.
fn unity(workspace: &Workspace, out: &Path) -> Result<PathBuf> {
    let host = Platform::host()?;
    let ort_folder = ort::fetch(workspace, host, ort::VERSION)?;
    workspace.build()?;
    let root = out.join("unity/package");
    std::fs::remove_dir_all(out.join("unity")).ok();
    copy(&workspace.path("unity-plugin"), &root)?;
    let plugins = root.join("Runtime/Plugins");
    let mut folders = PLUGINS;
    folders.sort_by_key(|(platform, ..)| *platform != host); // its own first: then their common folder stays
    for (platform, system, processor) in folders {
        let (outer, inner) = (plugins.join(system), plugins.join(system).join(processor));
        if platform == host {
            let (ours, theirs) = (library(host), host.library());
            copy(&workspace.release.join(ours), &inner.join(ours))?;
            copy(&ort_folder.join(theirs), &inner.join(theirs))?;
            continue;
        }
        // Unity warns about settings (.meta) of what is not there, so those of other platforms go.
        println!("left out (not this platform): {}", platform.name());
        std::fs::remove_dir_all(&inner).ok();
        std::fs::remove_file(inner.with_extension("meta")).ok();
        if std::fs::remove_dir(&outer).is_ok() {
            std::fs::remove_file(outer.with_extension("meta"))?;
        }
    }
    // Unity leaves folders whose names end in ~ alone, so these need no .meta files.
    for (name, place) in Workspace::bundle_files(&workspace.path("onnx/brain"))? {
        copy(&place, &root.join("Bundles~/brain").join(name))?;
    }
    let notice = root.join("Documentation~/third-party-crates.txt");
    script(workspace, LICENCES, &notice)?;
    let file = out.join(format!("org.libupt.soft-tissue-{VERSION}.tgz"));
    let (parent, time) = (out.join("unity"), archive::time(workspace));
    archive::pack(&parent, "package", &file, time)?;
    Ok(file)
}
