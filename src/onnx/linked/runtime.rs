//! ONNX Runtime's environment: made once a process, never torn down, telemetry off.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use ort::environment::Environment;
use ort::logging::LogLevel;

use super::locate;
use super::status::of_onnx;
use super::version::version_of;
use crate::error::{Error, Result};
use crate::memory;

/// The loaded library.
pub struct Runtime {
    pub(super) environment: Environment,
    path: PathBuf,
    version: String,
}

static RUNTIME: OnceLock<Runtime> = OnceLock::new();
static LOADING: Mutex<()> = Mutex::new(());

impl Runtime {
    /// The process's runtime; the first call finds and loads the library.
    ///
    /// # Errors
    /// [`Error::Runtime`] lists every candidate that was tried and why it was not taken. A later call tries again.
    pub fn get(explicit: Option<&Path>) -> Result<&'static Runtime> {
        if let Some(runtime) = RUNTIME.get() {
            return Ok(runtime);
        }
        let _one_at_a_time = LOADING.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(runtime) = RUNTIME.get() {
            return Ok(runtime);
        }
        let runtime = load(explicit)?;
        tracing::info!(path = %runtime.path.display(), version = %runtime.version, "ONNX Runtime loaded");
        Ok(RUNTIME.get_or_init(|| runtime))
    }

    /// Whether the library has been loaded.
    pub fn is_loaded() -> bool {
        RUNTIME.get().is_some()
    }

    /// The process's one environment, for sessions other than the library's own (measurements of rivals).
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Lets the environment copy tensors between host and card: the CUDA provider's library, which lies next to ONNX
    /// Runtime, is registered once a process.
    pub(super) fn offer_cuda_copies(&self) -> std::result::Result<(), String> {
        static OUTCOME: OnceLock<std::result::Result<(), String>> = OnceLock::new();
        let register = || {
            let name = if cfg!(windows) {
                "onnxruntime_providers_cuda.dll"
            } else {
                "libonnxruntime_providers_cuda.so"
            };
            let path = self.path.with_file_name(name);
            if !path.is_file() {
                return Err(format!("{}: no such file", path.display()));
            }
            self.environment
                .register_ep_library("CUDAExecutionProvider", &path)
                .map_err(|error| format!("{}: {error}", path.display()))
        };
        OUTCOME.get_or_init(register).clone()
    }

    /// File that was loaded.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Version of the library, for instance `1.31.1`; its build description where it has no version.
    pub fn version(&self) -> &str {
        &self.version
    }
}

/// What the library takes while it makes its environment. Where that fails half way it cannot be made again in this process, so the room is
/// asked for first.
const ROOM: usize = 16 << 20;

fn load(explicit: Option<&Path>) -> Result<Runtime> {
    memory::probe(ROOM, "ONNX Runtime")?;
    let mut tried = Vec::new();
    for (path, why) in locate::candidates(explicit) {
        if path.is_absolute() && !path.exists() {
            tried.push(format!("{} ({why}): no such file", path.display()));
            continue;
        }
        let opened = catch_unwind(AssertUnwindSafe(|| open(&path)));
        match opened {
            Ok(Ok(runtime)) => return Ok(runtime),
            Ok(Err(cause)) => tried.push(format!("{} ({why}): {cause}", path.display())),
            Err(_) => tried.push(format!(
                "{} ({why}): it is not a working ONNX Runtime",
                path.display()
            )),
        }
    }
    let problem = format!(
        "no usable library (version 1.{} or newer); tried {}. Put {} into the folder of libupt, set ORT_DYLIB_PATH, \
         or fetch it with `cargo xtask ort`",
        ort::MINOR_VERSION,
        tried.join("; "),
        locate::plain_name()
    );
    Err(of_onnx(problem, Error::Runtime))
}

/// Microsoft's builds of ONNX Runtime from 1.29 on write a device identifier and upload a process event while the
/// environment is made, before the API can turn telemetry off; only this variable stops it. A host that wants telemetry
/// sets it to 0 itself.
fn refuse_telemetry() {
    const VARIABLE: &str = "ORT_DISABLE_TELEMETRY";
    if std::env::var_os(VARIABLE).is_none() {
        // SAFETY: sound unless another thread of the host reads or writes the environment without Rust's lock at this
        // moment; docs/reference/abi.md tells hosts that do so to set the variable themselves, and then nothing is written here.
        unsafe { std::env::set_var(VARIABLE, "1") };
    }
}

fn open(path: &Path) -> std::result::Result<Runtime, String> {
    refuse_telemetry();
    #[cfg(windows)]
    open_module(path)?;
    let builder = ort::init_from(path).map_err(|error| error.to_string())?;
    let environment = builder
        .with_name("upt")
        .with_telemetry(false)
        .with_logger(Arc::new(log))
        .build()
        .map_err(|error| error.to_string())?;
    environment.set_log_level(LogLevel::Warning);
    Ok(Runtime {
        environment,
        path: path.to_owned(),
        version: version_of(path).unwrap_or_else(|| ort::info().to_owned()),
    })
}

/// Opens the module, so that the system's own words are in the error: `ort` passes on only which call failed.
#[cfg(windows)]
fn open_module(path: &Path) -> std::result::Result<(), String> {
    // SAFETY: ONNX Runtime, which is opened in any case; it stays open.
    match unsafe { libloading::Library::new(path) } {
        Ok(module) => {
            std::mem::forget(module);
            Ok(())
        }
        Err(error) => {
            let cause = std::error::Error::source(&error);
            let mut text = cause.map_or_else(|| error.to_string(), ToString::to_string);
            if path.exists() {
                text.push_str(
                    "; the file is there, so a library that it needs is missing: \
                     install the Microsoft Visual C++ redistributable (x64)",
                );
            }
            Err(text)
        }
    }
}

fn log(level: LogLevel, _category: &str, _id: &str, place: &str, message: &str) {
    match level {
        LogLevel::Verbose => tracing::trace!(target: "onnxruntime", place, "{message}"),
        LogLevel::Info => tracing::debug!(target: "onnxruntime", place, "{message}"),
        LogLevel::Warning => tracing::warn!(target: "onnxruntime", place, "{message}"),
        LogLevel::Error | LogLevel::Fatal => {
            tracing::error!(target: "onnxruntime", place, "{message}")
        }
    }
}
