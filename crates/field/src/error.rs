//! The library's error: what went wrong, where, and what to do about it.
//!
//! Every variant maps to one status code of `docs/reference/abi.md`.

use std::path::PathBuf;

use topology::TopologyError;

use crate::status::*;

/// Everything that can fail in this library.
///
/// A call that returns an error has changed nothing: the handle is in the state it was in before.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Error {
    /// A size, index, enumerator or range is wrong.
    #[error("{0}")]
    Argument(String),
    /// The scene is in use by another thread or has a step in flight.
    #[error("{0}")]
    Busy(String),
    /// An input holds NaN or infinity.
    #[error("{0}")]
    NonFinite(String),
    /// The call does not fit the state of the scene or of the library.
    #[error("{0}")]
    State(String),
    /// This build or this bundle kind cannot do it.
    #[error("{0}")]
    Unsupported(String),
    /// There is no memory for what a call needs.
    #[error("{0}")]
    OutOfMemory(String),
    /// ONNX Runtime is missing, too old or broken; the message lists what was tried.
    #[error("ONNX Runtime: {0}")]
    Runtime(String),
    /// No provider of the list can run the model.
    #[error("provider: {0}")]
    Provider(String),
    /// A file cannot be read.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: String,
    },
    /// A bundle is invalid; names the file and the field.
    #[error("{file}: {message}")]
    Bundle {
        /// File of the bundle, for instance `bundle.json`.
        file: String,
        /// Field or tensor, what is wrong with it, and what to do.
        message: String,
    },
    /// A bundle's or a snapshot's version is not supported.
    #[error("{0}")]
    Version(String),
    /// A snapshot is damaged or of another model.
    #[error("snapshot: {0}")]
    Snapshot(String),
    /// The guard refused the new state; the last good state stays.
    #[error("guard: {0}")]
    Guard(String),
    /// A panic was caught: a bug in this library.
    #[error("internal error: {0}")]
    Panic(String),
}

/// The library's result.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// The status code of `docs/reference/abi.md`.
    ///
    /// ```
    /// let error = field::Error::Busy("a step is in flight".into());
    /// assert_eq!(error.status(), -5); // UPT_ERR_BUSY
    /// assert_eq!(error.to_string(), "a step is in flight");
    /// ```
    pub fn status(&self) -> i32 {
        match self {
            Error::Argument(_) => UPT_ERR_ARGUMENT,
            Error::Busy(_) => UPT_ERR_BUSY,
            Error::NonFinite(_) => UPT_ERR_NON_FINITE,
            Error::State(_) => UPT_ERR_STATE,
            Error::Unsupported(_) => UPT_ERR_UNSUPPORTED,
            Error::OutOfMemory(_) => UPT_ERR_OUT_OF_MEMORY,
            Error::Runtime(_) => UPT_ERR_RUNTIME,
            Error::Provider(_) => UPT_ERR_PROVIDER,
            Error::Io { .. } => UPT_ERR_IO,
            Error::Bundle { .. } => UPT_ERR_BUNDLE,
            Error::Version(_) => UPT_ERR_VERSION,
            Error::Snapshot(_) => UPT_ERR_SNAPSHOT,
            Error::Guard(_) => UPT_ERR_GUARD,
            Error::Panic(_) => UPT_ERR_PANIC,
        }
    }

    /// Says of a step's error how many later ones failed as well.
    pub fn and_more(self, later: u64) -> Self {
        let add = |text: String| format!("{text} ({later} later steps failed as well)");
        match self {
            Error::Guard(text) => Error::Guard(add(text)),
            Error::Runtime(text) => Error::Runtime(add(text)),
            Error::OutOfMemory(text) => Error::OutOfMemory(add(text)),
            Error::Panic(text) => Error::Panic(add(text)),
            other => other,
        }
    }

    /// Says which of a host's instruments an argument is of.
    pub fn of_instrument(self, index: usize) -> Self {
        match self {
            Error::Argument(text) => Error::Argument(format!("instruments[{index}]: {text}")),
            Error::NonFinite(text) => Error::NonFinite(format!("instruments[{index}]: {text}")),
            other => other,
        }
    }

    pub fn bundle(file: impl Into<String>, message: impl Into<String>) -> Self {
        Error::Bundle {
            file: file.into(),
            message: message.into(),
        }
    }

    pub fn io(path: impl Into<PathBuf>, cause: impl std::fmt::Display) -> Self {
        Error::Io {
            path: path.into(),
            cause: cause.to_string(),
        }
    }
}

impl From<TopologyError> for Error {
    fn from(error: TopologyError) -> Error {
        match error {
            TopologyError::Kept => Error::Snapshot(error.to_string()),
            TopologyError::NotFinite { .. } => Error::NonFinite(error.to_string()),
            TopologyError::Memory { .. } => Error::OutOfMemory(error.to_string()),
            other => Error::Argument(format!("cut: {other}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_argument_tells_its_instrument() {
        let error = Error::Argument("radius is 0".into()).of_instrument(3);
        assert_eq!(error.to_string(), "instruments[3]: radius is 0");
    }
}
