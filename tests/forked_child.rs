//! After a fork the child has none of the library's threads: its calls say so at once, and the parent goes on.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]
#![cfg(unix)]

use std::ptr::null_mut;

use fixture::host::{self, Host};
use upt::ffi::*;

/// Verifies REQ-016.
#[test]
fn calls_of_a_forked_child_are_refused_and_the_parent_goes_on() {
    let host = Host::new("tiny-upt", |options| options.threads = 2);
    let domain = host::indices(host.model, UPT_SET_DOMAIN_NODES);
    let vectors = [0.0f32, 0.0, -1.0];
    let input = upt_input::of_contacts(&domain[..1], &vectors);
    let submit = || unsafe { upt_scene_submit(host.scene, &input) };
    // The worker's and the pool's threads are there.
    assert_eq!(submit(), UPT_OK);
    assert_eq!(unsafe { upt_scene_wait(host.scene, u32::MAX) }, UPT_OK);
    // SAFETY: the child calls the library and ends without running what the parent's would.
    let child = unsafe { libc::fork() };
    if child == 0 {
        let refused = [
            submit(),
            unsafe { upt_scene_wait(host.scene, u32::MAX) },
            host.step(&domain[..1], [0.0, 0.0, -1.0]),
            unsafe { upt_scene_destroy(host.scene) },
            unsafe { upt_model_destroy(host.model) },
            unsafe { upt_set_log(None, null_mut(), UPT_LOG_OFF) },
            unsafe { upt_shutdown() },
        ];
        let all = refused.iter().all(|&status| status == UPT_ERR_STATE);
        let said = host::message().contains("forked");
        // SAFETY: ends the child at once.
        unsafe { libc::_exit(if all && said { 0 } else { 1 }) };
    }
    assert!(child > 0);
    let mut status = -1;
    // SAFETY: waits for the child that was made above.
    assert_eq!(unsafe { libc::waitpid(child, &mut status, 0) }, child);
    assert!(libc::WIFEXITED(status), "the child was killed: {status}");
    assert_eq!(
        libc::WEXITSTATUS(status),
        0,
        "a call of the child was not refused"
    );
    assert_eq!(submit(), UPT_OK);
    assert_eq!(unsafe { upt_scene_wait(host.scene, u32::MAX) }, UPT_OK);
}
