//! What ONNX Runtime answers: a raw call of its API nothing, or a status with a message that must be released.

use std::ffi::CStr;

use crate::error::Error;

/// The message of a failed call.
///
/// # Safety
/// `status` comes from a call of the API just made, and is not used again.
pub(super) unsafe fn check(status: ort::sys::OrtStatusPtr) -> Result<(), String> {
    if status.0.is_null() {
        return Ok(());
    }
    let api = ort::api();
    // SAFETY: a status that is not null holds a message and is released once.
    unsafe {
        let text = CStr::from_ptr((api.GetErrorMessage)(status.0));
        let text = text.to_string_lossy().into_owned();
        (api.ReleaseStatus)(status.0);
        Err(text)
    }
}

/// What ONNX Runtime said, as `or`, or as lack of memory where it said so.
pub(super) fn of_onnx(text: String, or: impl FnOnce(String) -> Error) -> Error {
    let memory = ["std::bad_alloc", "Failed to allocate memory"];
    match memory.iter().any(|said| text.contains(said)) {
        true => Error::OutOfMemory(format!("ONNX Runtime: {text}")),
        false => or(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::{UPT_ERR_OUT_OF_MEMORY, UPT_ERR_PROVIDER};

    #[test]
    fn lack_of_memory_that_onnx_runtime_tells_is_lack_of_memory() {
        let told = |text: &str| of_onnx(text.into(), Error::Provider).status();
        let cpu = "cpu: Exception during initialization: std::bad_alloc";
        assert_eq!(told(cpu), UPT_ERR_OUT_OF_MEMORY);
        assert_eq!(told("cpu: no such operator"), UPT_ERR_PROVIDER);
    }
}
