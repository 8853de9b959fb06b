//! The frame of every exported function: panics stop here, failures become a status and the thread's message.
//!
//! REQ-012: A panic inside the library becomes a status; the scene refuses further calls, and others go on.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, Ordering};

use super::constants::{UPT_ERR_PANIC, UPT_ERR_STATE, upt_status};
use super::failure::{Answer, Failure, fail};
use super::log;
use crate::kernels::MaskExceptions;

thread_local! {
    /// NUL-terminated message of the last failed call of this thread.
    static LAST_ERROR: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Runs an exported function's body. `on_panic` marks the handle that can no longer be trusted.
pub(super) fn call(
    name: &str,
    on_panic: impl FnOnce(),
    body: impl FnOnce() -> Answer,
) -> upt_status {
    // A host that traps floating-point exceptions must not die of an inexact product in here.
    let _mode = MaskExceptions::enter();
    let _host = log::HostCall::enter();
    let body = || misplaced().map_or_else(body, |why| fail(UPT_ERR_STATE, why));
    let failure = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(status)) => return status,
        Ok(Err(failure)) => failure,
        Err(payload) => {
            on_panic();
            Failure {
                status: UPT_ERR_PANIC,
                message: format!("internal error: {}", panic_message(payload.as_ref())),
            }
        }
    };
    remember(name, &failure.message);
    failure.status
}

/// The process of the first call; 0 before it.
static PROCESS: AtomicU32 = AtomicU32::new(0);

/// Why a call from here cannot be answered: its locks may be held by threads that wait for it, or do not exist.
fn misplaced() -> Option<&'static str> {
    if log::in_receiver() {
        return Some("called from the log receiver, which must not call the library");
    }
    // WebAssembly has no processes, and asking panics.
    let here = match cfg!(target_family = "wasm") {
        true => 1,
        false => std::process::id(),
    };
    match PROCESS.compare_exchange(0, here, Ordering::Relaxed, Ordering::Relaxed) {
        Err(first) if first != here => Some(
            "the process was forked after the library was used, and the library's threads stayed in the parent; use it in one of the two processes, or load it after the fork",
        ),
        _ => None,
    }
}

fn panic_message(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("panic without a message")
}

/// Stores `name: message` for [`last_error`]. At thread exit, when the storage is gone, the message is dropped.
pub(super) fn remember(name: &str, message: &str) {
    let _ = LAST_ERROR.try_with(|last| {
        let mut last = last.borrow_mut();
        last.clear();
        last.extend_from_slice(name.as_bytes());
        last.extend_from_slice(b": ");
        last.extend(
            message
                .bytes()
                .map(|byte| if byte == 0 { b' ' } else { byte }),
        );
        last.push(0);
    });
}

/// The thread's message, or an empty string.
pub(super) fn last_error() -> *const c_char {
    LAST_ERROR
        .try_with(|last| {
            let last = last.borrow();
            if last.is_empty() {
                c"".as_ptr()
            } else {
                last.as_ptr().cast()
            }
        })
        .unwrap_or(c"".as_ptr())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    #[test]
    fn a_panic_becomes_a_status_and_marks_the_handle() {
        let mut marked = false;
        let status = call("upt_x", || marked = true, || panic!("index {} of {}", 4, 3));
        assert_eq!(status, UPT_ERR_PANIC);
        assert!(marked);
        // SAFETY: the library returns a C string that lives until this thread's next call.
        let message = unsafe { CStr::from_ptr(last_error()) };
        assert_eq!(message, c"upt_x: internal error: index 4 of 3");
    }

    #[test]
    fn messages_belong_to_their_thread() {
        call("upt_a", || (), || fail(-2, "here"));
        std::thread::spawn(|| {
            // SAFETY: the library returns a C string that lives until this thread's next call.
            assert_eq!(unsafe { CStr::from_ptr(last_error()) }, c"");
            call("upt_b", || (), || fail(-2, "nul \0 inside"));
            assert_eq!(
                // SAFETY: the library returns a C string that lives until this thread's next call.
                unsafe { CStr::from_ptr(last_error()) },
                c"upt_b: nul   inside"
            );
        })
        .join()
        .unwrap();
        // SAFETY: the library returns a C string that lives until this thread's next call.
        assert_eq!(unsafe { CStr::from_ptr(last_error()) }, c"upt_a: here");
    }
}
