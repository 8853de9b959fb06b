//! Library-wide calls: start, end, version, messages, providers.

use core::ffi::{c_char, c_void};

use super::call::{call, last_error};
use super::constants::*;
use super::failure::{Answer, fail};
use super::structs::*;
use super::{convert, log, output, pointers};

/// Version of the C ABI that `upt_abi_version` returns. Bindings compare it at load.
pub const UPT_ABI_VERSION: u32 = 1;

/// Starts the library with options of your own. Optional: opening the first model starts it with the defaults.
///
/// - `options`: NULL means the defaults.
///
/// Threads: any.
/// Errors: `UPT_ERR_STATE` when the library was started with other options, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_init(options: *const upt_init_options) -> upt_status {
    call(
        "upt_init",
        || (),
        || {
            // SAFETY: NULL, or a struct whose first field is its size, as the header asks.
            let raw = unsafe { pointers::options(options, "options") }?;
            // SAFETY: the pointers in the struct are NULL or what the header asks for.
            crate::init(&unsafe { convert::init_options(&raw) }?)?;
            Ok(UPT_OK)
        },
    )
}

/// Shuts the library down. Call it before the process exits if you used a GPU provider.
///
/// Threads: any.
/// Errors: `UPT_ERR_STATE` while models or scenes exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_shutdown() -> upt_status {
    call(
        "upt_shutdown",
        || (),
        || {
            crate::shutdown()?;
            Ok(UPT_OK)
        },
    )
}

/// The library's version, for instance "0.1.0".
///
/// Threads: any.
#[unsafe(no_mangle)]
pub extern "C" fn upt_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// The `UPT_ABI_VERSION` of the library that is loaded. Stop if it differs from the header's.
///
/// Threads: any.
#[unsafe(no_mangle)]
pub extern "C" fn upt_abi_version() -> u32 {
    UPT_ABI_VERSION
}

/// The message of the calling thread's last failed call (UTF-8), or "". It stays valid until that thread's next call.
///
/// Threads: any.
#[unsafe(no_mangle)]
pub extern "C" fn upt_last_error() -> *const c_char {
    last_error()
}

/// The name of a status, for instance "UPT_ERR_BUSY"; "UPT_UNKNOWN" for other numbers.
///
/// Threads: any.
#[unsafe(no_mangle)]
pub extern "C" fn upt_status_name(status: upt_status) -> *const c_char {
    super::constants::name(status).as_ptr()
}

/// Sets the function that receives log messages; NULL removes it. When the call returns, the former receiver is no longer
/// running. It runs on the host's threads only, during a call or at its end; messages of the library's own threads wait
/// for the next call.
///
/// - `user`: passed to the receiver.
/// - `level`: `UPT_LOG_*`; less severe messages are not created.
///
/// Threads: any.
/// Errors: `UPT_ERR_ARGUMENT` for an unknown level, `UPT_ERR_STATE` from the receiver itself, or in a Rust program with a
/// `tracing` subscriber of its own.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_set_log(
    callback: upt_log_fn,
    user: *mut c_void,
    level: upt_log_level,
) -> upt_status {
    call(
        "upt_set_log",
        || (),
        || {
            if !(UPT_LOG_OFF..=UPT_LOG_TRACE).contains(&level) {
                return fail(
                    UPT_ERR_ARGUMENT,
                    format!("level is {level}; levels are 0 to 5"),
                );
            }
            log::set(callback, user, level)
        },
    )
}

/// Lists the providers as JSON: `[{"name":"cpu","available":true,"reason":""}]`. Loads ONNX Runtime.
///
/// - `out`: receives text with its NUL; NULL with capacity 0 only queries the size.
/// - `needed`: its size in bytes with the NUL, always written; may be NULL.
///
/// Threads: any.
/// Errors: `UPT_ERR_RUNTIME`, `UPT_ERR_ARGUMENT` if capacity is too small, `UPT_ERR_NULL`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_providers(
    out: *mut c_char,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call(
        "upt_providers",
        || (),
        || -> Answer {
            let text = crate::providers_json()?;
            // SAFETY: `out` has room for `capacity` elements and `needed` is NULL or writable, as the header asks.
            unsafe { output::copy_text(&text, out, capacity, needed) }
        },
    )
}
