//! The version of a loaded ONNX Runtime, `"1.31.1"`, from the library's own entry point.

use std::ffi::{CStr, c_char, c_void};
use std::path::Path;

/// The head of ONNX Runtime's `OrtApiBase`, unchanged since its first release.
#[repr(C)]
struct ApiBase {
    get_api: unsafe extern "C" fn(u32) -> *const c_void,
    get_version_string: unsafe extern "C" fn() -> *const c_char,
}

/// Asks the library at `path`, which has been loaded before; `None` where it does not say.
pub(super) fn version_of(path: &Path) -> Option<String> {
    // SAFETY: the library is ONNX Runtime and stays loaded; `OrtGetApiBase` returns a pointer to a static
    // table, and its second entry returns static text.
    unsafe {
        let library = libloading::Library::new(path).ok()?;
        let entry: libloading::Symbol<unsafe extern "C" fn() -> *const ApiBase> =
            library.get(b"OrtGetApiBase\0").ok()?;
        let base = entry().as_ref()?;
        let text = (base.get_version_string)();
        (!text.is_null()).then(|| CStr::from_ptr(text).to_string_lossy().into_owned())
    }
}
