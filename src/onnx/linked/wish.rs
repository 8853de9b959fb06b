//! How a session is told which provider to use.

use ort::ep::ExecutionProviderDispatch;

/// How a session is told which provider to use.
pub(super) enum Wish {
    /// Nothing to tell: the CPU.
    Cpu,
    /// A provider of the library.
    Builtin(ExecutionProviderDispatch),
    /// The devices that a plugin provider offers, and its options.
    Plugin(&'static str, Vec<(String, String)>),
}
