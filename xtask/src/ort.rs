//! `cargo xtask ort`: ONNX Runtime's shared library out of the `onnxruntime` wheel ([`ort_wheel`]), in `target/ort/<platform>/`.
//! For the host, `target/ort/libonnxruntime.so` (`.dylib`, `.dll`) is a copy of it.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;
pub use ort_wheel::{Platform, VERSION};

use crate::process::run_checked;
use crate::venv;
use crate::workspace::Workspace;

/// The folder `target/ort/<platform>` with the library, `LICENSE` and `ThirdPartyNotices.txt`;
/// downloads nothing when it is there already.
pub fn fetch(workspace: &Workspace, platform: Platform, version: &str) -> Result<PathBuf> {
    let folder = workspace.ort().join(platform.name());
    if !ort_wheel::is_there(&folder, platform, version) {
        venv::create(workspace)?;
    }
    let log = workspace.logs().join("ort.log");
    let mut run =
        |label: &str, command: &mut Command| run_checked(label, command, &log).map(|_| ());
    let library = ort_wheel::fetch(&folder, platform, version, &workspace.python(), &mut run)?;
    if Platform::host().is_ok_and(|host| host == platform) {
        place_for_host(workspace, &library, platform.library())?;
    }
    Ok(folder)
}

/// The host's library, for `ORT_DYLIB_PATH`.
pub fn host_library(workspace: &Workspace) -> Result<PathBuf> {
    let platform = Platform::host()?;
    fetch(workspace, platform, VERSION)?;
    Ok(workspace.ort().join(platform.library()))
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
    println!("{}", folder.join(platform.library()).display());
    Ok(())
}

/// Adds `ORT_DYLIB_PATH` to a command's environment.
pub fn set_environment(command: &mut Command, library: &Path) {
    command.env("ORT_DYLIB_PATH", library);
}
