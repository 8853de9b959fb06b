//! `cargo xtask ort`: ONNX Runtime's shared library out of the `onnxruntime` wheel ([`ort_wheel`]), in `target/ort/<platform>/`.
//! For the host, `target/ort/libonnxruntime.so` (`.dylib`, `.dll`) is a copy of it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
pub use ort_wheel::{Platform, VERSION};

use crate::process::run_checked;
use crate::venv;
use crate::workspace::Workspace;

/// The folder `target/ort/<platform>` with the library, `LICENSE` and `ThirdPartyNotices.txt`;
/// downloads nothing when it is there already.
pub fn fetch(workspace: &Workspace, platform: Platform, version: &str) -> Result<PathBuf> {
    static FETCHING: Mutex<()> = Mutex::new(());
    let _one = FETCHING.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = workspace.path("target/ort").join(platform.name());
    if !ort_wheel::is_there(&folder, platform, version) {
        venv::create(workspace, "target/venv")?;
    }
    let python = workspace.venv_program("python");
    let mut run = |label: &str, command: &mut Command| run_checked(workspace, label, command);
    let library = ort_wheel::fetch(&folder, platform, version, &python, &mut run)?;
    if Platform::host().is_ok_and(|host| host == platform) {
        place_for_host(
            &library,
            &workspace.path("target/ort").join(platform.library()),
        )?;
    }
    Ok(folder)
}

/// A copy, replaced by rename so that a running program keeps its own.
fn place_for_host(library: &Path, place: &Path) -> Result<()> {
    let is_same = || -> Option<bool> {
        let (from, to) = (library.metadata().ok()?, place.metadata().ok()?);
        Some(from.len() == to.len() && to.modified().ok()? >= from.modified().ok()?)
    };
    if is_same() != Some(true) {
        let temporary = place.with_extension(format!("{}.tmp", std::process::id()));
        std::fs::copy(library, &temporary)?;
        std::fs::rename(&temporary, place)?;
    }
    Ok(())
}

/// The host's library, for `ORT_DYLIB_PATH`.
pub fn host_library(workspace: &Workspace) -> Result<PathBuf> {
    let platform = Platform::host()?;
    fetch(workspace, platform, VERSION)?;
    Ok(workspace.path("target/ort").join(platform.library()))
}

/// Fetches the host's library and names it in a command's environment.
pub fn set_environment(workspace: &Workspace, command: &mut Command) -> Result<()> {
    command.env("ORT_DYLIB_PATH", host_library(workspace)?);
    Ok(())
}
