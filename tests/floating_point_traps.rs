//! A host that traps floating-point exceptions may call: inside they are masked, after each call its mode is what it was.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]
#![cfg(target_arch = "x86_64")]

use fixture::host::{self, Host};
use upt::ffi::*;
use upt::kernels::flush::read_mode;

/// MXCSR with invalid operations, divisions by zero and overflows trapped and no flag set.
const TRAPPING: u32 = 0x1f80 & !(0x80 | 0x200 | 0x400);

fn set_mode(word: u32) {
    // SAFETY: a word of defined bits.
    unsafe { core::arch::asm!("ldmxcsr [{}]", in(reg) &word, options(nostack, readonly)) };
}

/// Makes a call with the traps on; the test's own arithmetic runs without them.
fn trapped(name: &str, call: impl FnOnce() -> i32) -> i32 {
    let usual = read_mode() as u32;
    set_mode(TRAPPING);
    let status = call();
    let after = read_mode() as u32;
    set_mode(usual);
    assert_eq!(after, TRAPPING, "{name} changed the host's mode");
    status
}

/// Verifies REQ-015.
#[test]
fn every_call_of_a_host_that_traps_exceptions_returns() {
    for bundle in fixture::BUNDLES {
        fixture::find_runtime();
        let path = std::ffi::CString::new(fixture::path(bundle).to_str().unwrap()).unwrap();
        let mut model = std::ptr::null_mut();
        let status = trapped("upt_model_create", || unsafe {
            upt_model_create(path.as_ptr(), std::ptr::null(), &mut model)
        });
        assert_eq!(status, UPT_OK, "{}", host::message());
        let mut scene = std::ptr::null_mut();
        let mut options = host::scene_options();
        options.guard_policy = UPT_GUARD_REPORT;
        options.check_inversion = 1;
        let status = trapped("upt_scene_create", || unsafe {
            upt_scene_create(model, &options, &mut scene)
        });
        assert_eq!(status, UPT_OK, "{}", host::message());
        let host = Host {
            model,
            scene,
            nodes: host::node_count(model),
        };
        let domain = host::indices(model, UPT_SET_DOMAIN_NODES);
        let mut out = vec![0.0f32; 3 * host.nodes];
        let floats = out.len() as u64;
        let points = [10.0f32, 10.0, 10.0, 900.0, 5.0, 5.0];
        let attach = || unsafe { upt_scene_attach_points(scene, points.as_ptr(), 1) };
        assert_eq!(trapped("upt_scene_attach_points", attach), UPT_OK);
        for t in 0..20 {
            // A push that grows, one far beyond training, a release.
            let push = match t {
                0..=9 => [0.1, 0.0, -0.5 * t as f32],
                10 => [0.0, 0.0, -9e5],
                _ => [0.0; 3],
            };
            let nodes = if t > 10 { &domain[..0] } else { &domain[..4] };
            let status = trapped("upt_scene_step", || host.step(nodes, push));
            assert!(
                matches!(status, UPT_OK | UPT_ERR_GUARD),
                "{}",
                host::message()
            );
            let mut forces = vec![0.0f32; 3 * nodes.len()];
            let read = trapped("upt_scene_read", || unsafe {
                upt_scene_read(scene, std::ptr::null(), out.as_mut_ptr(), floats)
            });
            let sample = trapped("upt_scene_sample", || unsafe {
                upt_scene_sample(scene, f64::NAN, std::ptr::null(), out.as_mut_ptr(), floats)
                    + upt_scene_sample(scene, 0.3, std::ptr::null(), out.as_mut_ptr(), floats)
            });
            assert_eq!((read, sample), (UPT_OK, UPT_ERR_NON_FINITE));
            if host::stats(scene).contact_count == nodes.len() as u64 {
                let force = trapped("upt_scene_read_contact_force", || unsafe {
                    upt_scene_read_contact_force(scene, forces.as_mut_ptr(), forces.len() as u64)
                });
                assert_eq!(force, UPT_OK, "{}", host::message());
            }
        }
        let status = trapped("upt_scene_set_region", || unsafe {
            upt_scene_set_region(scene, domain.as_ptr(), 5)
        });
        assert_eq!(status, UPT_OK);
        let bad = [f32::NAN; 12];
        let status = trapped("upt_scene_submit", || unsafe {
            upt_scene_submit(scene, &upt_input::of_contacts(&domain[..4], &bad))
        });
        assert_eq!(status, UPT_ERR_NON_FINITE);
        let push = [1.0f32; 12];
        let status = trapped("upt_scene_submit", || unsafe {
            upt_scene_submit(scene, &upt_input::of_contacts(&domain[..4], &push))
        });
        assert_eq!(status, UPT_OK);
        let wait = || unsafe { upt_scene_wait(scene, u32::MAX) };
        assert_eq!(trapped("upt_scene_wait", wait), UPT_OK);
    }
}
