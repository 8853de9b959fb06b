//! What a raw call of ONNX Runtime's API answers: nothing, or a status with a message that must be released.

use std::ffi::CStr;

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
