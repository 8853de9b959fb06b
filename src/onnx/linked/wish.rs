//! What a session asks ONNX Runtime for.

use ort::ep::ExecutionProviderDispatch;

/// The provider that a session asks for.
pub(super) enum Wish {
    /// No provider is named: the CPU.
    Cpu,
    /// A provider of the library.
    Builtin(ExecutionProviderDispatch),
    /// The devices that a plugin provider offers, and its options.
    Plugin(&'static str, Vec<(String, String)>),
}
