//! TensorRT-RTX as a plugin provider: a shared library of its own that ONNX Runtime registers, then offers devices of.
//!
//! It is searched next to libupt, next to ONNX Runtime, then where `UPT_TENSORRT_RTX_PATH` says (the library or its
//! folder). Nothing is opened before a host asks for the provider.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::locate::own_folder;
use super::runtime::Runtime;

/// Name of the provider, of its registration, and prefix of its options.
pub(super) const NAME: &str = "NvTensorRTRTXExecutionProvider";
/// Library or folder, where it is neither next to libupt nor next to ONNX Runtime.
const VARIABLE: &str = "UPT_TENSORRT_RTX_PATH";
/// What the plugin needs from its own folder, in the order in which they are opened: how the names begin.
const COMPANIONS: [&str; 3] = if cfg!(windows) {
    ["cudart64_", "tensorrt_rtx_", "tensorrt_onnxparser_rtx_"]
} else {
    [
        "libcudart.so",
        "libtensorrt_rtx.so",
        "libtensorrt_onnxparser_rtx.so",
    ]
};

/// As the plugin's package has it. On macOS there is none, and the name is then not found.
fn file_name() -> &'static str {
    if cfg!(windows) {
        "onnxruntime_providers_nv_tensorrt_rtx.dll"
    } else {
        "libonnxruntime_providers_nv_tensorrt_rtx.so"
    }
}

/// Registers the plugin once a process; `Ok` when it offers a device.
///
/// # Errors
/// Why there is none: where it was searched, what the loader said, or that no card here is supported.
///
/// The outcome is kept, whichever it is: a second model gets the first one's answer, and nothing is
/// searched or opened again.
pub(super) fn available(runtime: &'static Runtime) -> Result<(), String> {
    static OUTCOME: OnceLock<Result<(), String>> = OnceLock::new();
    OUTCOME
        .get_or_init(|| register(runtime, &candidates(runtime.path())))
        .clone()
}

/// Where the plugin may be, in order. A relative folder of ONNX Runtime's is left out: that is the
/// plain name which the system's search path found, and says nothing about where the file is.
fn candidates(onnxruntime: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    if let Some(folder) = own_folder() {
        found.push(folder.join(file_name()));
    }
    if let Some(folder) = onnxruntime.parent().filter(|folder| folder.is_absolute()) {
        found.push(folder.join(file_name()));
    }
    if let Some(value) = std::env::var_os(VARIABLE).filter(|value| !value.is_empty()) {
        let path =
            std::path::absolute(PathBuf::from(&value)).unwrap_or_else(|_| PathBuf::from(&value));
        found.push(if path.is_dir() {
            path.join(file_name())
        } else {
            path
        });
    }
    found.dedup();
    found
}

/// Registers the first candidate that is a file. Its companions are opened before it: afterwards
/// the loader has them, wherever they lie.
fn register(runtime: &'static Runtime, candidates: &[PathBuf]) -> Result<(), String> {
    let Some(path) = candidates.iter().find(|path| path.is_file()) else {
        let tried: Vec<String> = candidates
            .iter()
            .map(|path| path.display().to_string())
            .collect();
        return Err(format!(
            "its plugin library was not found; tried {}. Install `onnxruntime-ep-nv-tensorrt-rtx` and set {VARIABLE} to its folder",
            tried.join(", ")
        ));
    };
    open_companions(path);
    runtime
        .environment
        .register_ep_library(NAME, path)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    let offered = runtime
        .environment
        .devices()
        .any(|device| device.ep().is_ok_and(|name| name == NAME));
    if offered {
        return Ok(());
    }
    Err(format!(
        "{} was loaded but offers no device: it needs an NVIDIA card of compute capability 7.5, 8.6, 8.9 or 12.x",
        path.display()
    ))
}

/// Opens the libraries that come in the plugin's folder, so that the loader finds them by their soname.
fn open_companions(plugin: &Path) {
    let Some(entries) = plugin
        .parent()
        .and_then(|folder| std::fs::read_dir(folder).ok())
    else {
        return;
    };
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort();
    // Of several versions the first that opens is enough. One that does not open is only noted: the
    // loader may find it elsewhere, and registering the plugin tells if not.
    for stem in COMPANIONS {
        let of_stem = |path: &&PathBuf| {
            path.file_name().is_some_and(|name| {
                let name = name.to_string_lossy();
                name.starts_with(stem) && (!cfg!(windows) || name.ends_with(".dll"))
            })
        };
        for file in files.iter().filter(of_stem) {
            // SAFETY: NVIDIA's libraries, which registering the plugin opens as well; they stay open.
            match unsafe { libloading::Library::new(file) } {
                Ok(library) => {
                    std::mem::forget(library);
                    break;
                }
                Err(error) => {
                    tracing::debug!(file = %file.display(), %error, "companion of the plugin")
                }
            }
        }
    }
}
