//! What the log says of flags, and what its receiver must not do. A process of its own: there is one receiver.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use std::ffi::{CStr, c_char, c_void};
use std::ptr::{null_mut, without_provenance_mut};
use std::sync::Mutex;

use fixture::host::{self, Host};
use upt::ffi::*;

static HEARD: Mutex<Vec<(i32, String)>> = Mutex::new(Vec::new());
static INSIDE: Mutex<Vec<i32>> = Mutex::new(Vec::new());

unsafe extern "C" fn hear(level: i32, text: *const c_char, _: *mut c_void) {
    let text = unsafe { CStr::from_ptr(text) }
        .to_string_lossy()
        .into_owned();
    HEARD.lock().unwrap().push((level, text));
    let calls = [
        unsafe { upt_set_log(None, null_mut(), UPT_LOG_OFF) },
        unsafe { upt_scene_reset(without_provenance_mut(18)) },
        unsafe { upt_shutdown() },
    ];
    INSIDE.lock().unwrap().extend(calls);
}

/// Lines of level WARN since the last call.
fn warnings() -> Vec<String> {
    let heard = std::mem::take(&mut *HEARD.lock().unwrap());
    let warnings = heard
        .into_iter()
        .filter(|(level, _)| *level == UPT_LOG_WARN);
    warnings.map(|(_, text)| text).collect()
}

/// Verifies REQ-018.
#[test]
fn a_flag_is_told_when_it_rises_and_the_receiver_cannot_call_the_library() {
    assert_eq!(
        unsafe { upt_set_log(Some(hear), null_mut(), UPT_LOG_INFO) },
        UPT_OK
    );
    let host = Host::new("tiny-upt", |_| ());
    let domain = host::indices(host.model, UPT_SET_DOMAIN_NODES);
    let far = [0.0, 0.0, -16.0];
    assert!(
        !HEARD.lock().unwrap().is_empty(),
        "opening says what it opened"
    );
    warnings();

    for step in 0..5 {
        assert_eq!(host.step(&domain[..4], far), UPT_OK);
        let flags = host::stats(host.scene).flags;
        assert_ne!(flags & UPT_FLAG_PUSH, 0, "{flags}");
        let told = warnings();
        let push = told.iter().filter(|text| text.contains("a push is longer"));
        assert_eq!(push.count(), usize::from(step == 0), "{told:?}");
    }
    assert_eq!(host.step(&domain[..4], [0.0, 0.0, -0.1]), UPT_OK);
    warnings();
    assert_eq!(host.step(&domain[..4], far), UPT_OK);
    assert_eq!(warnings().len(), 1, "it has risen again");

    let inside = std::mem::take(&mut *INSIDE.lock().unwrap());
    assert!(inside.len() >= 3);
    assert!(
        inside.iter().all(|&status| status == UPT_ERR_STATE),
        "{inside:?}"
    );
    assert_eq!(
        unsafe { upt_set_log(None, null_mut(), UPT_LOG_OFF) },
        UPT_OK
    );
    assert_eq!(host.step(&domain[..4], [0.0, 0.0, -17.0]), UPT_OK);
    assert!(HEARD.lock().unwrap().is_empty(), "nobody listens");
}
