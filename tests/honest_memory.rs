//! What the statistics say a scene takes is what it takes, and destroying scenes gives it back. In a process of its own, with the
//! counts of glibc's allocator.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use fixture::host;
use upt::ffi::*;

/// Bytes that malloc has given out.
fn allocated() -> f64 {
    // SAFETY: only reads the allocator's counts.
    let info = unsafe { libc::mallinfo2() };
    (info.uordblks + info.hblkhd) as f64
}

/// Bytes of this process in memory.
fn resident() -> f64 {
    gauge::resident_bytes().unwrap() as f64
}

/// Scenes of a model that have made some steps in contact.
fn stepped(
    model: *mut upt_model,
    options: &upt_scene_options,
    count: usize,
) -> Vec<*mut upt_scene> {
    let domain = host::indices(model, UPT_SET_DOMAIN_NODES);
    let nodes = &domain[..6];
    let scenes: Vec<_> = (0..count).map(|_| host::create(model, options)).collect();
    for &scene in &scenes {
        for depth in 0..4 {
            let vectors = [0.0, 0.0, -0.3 * depth as f32].repeat(nodes.len());
            let input = upt_input::of_contacts(nodes, &vectors);
            let status = unsafe { upt_scene_step(scene, &input, std::ptr::null_mut(), 0) };
            assert!(
                matches!(status, UPT_OK | UPT_ERR_GUARD),
                "{}",
                host::message()
            );
        }
    }
    scenes
}

fn destroy(scenes: Vec<*mut upt_scene>) {
    for scene in scenes {
        assert_eq!(unsafe { upt_scene_destroy(scene) }, UPT_OK);
    }
}

/// One test: another one's allocations would be counted.
/// Verifies REQ-035.
#[test]
fn memory_is_stated_to_ten_percent_and_given_back() {
    fixture::find_runtime();
    let bundles = [
        "brain-coarse",
        "brain-coarse-reduced",
        "brain-fast",
        "brain-reduced",
    ];
    for name in bundles {
        let model = host::open(&fixture::shipped(name));
        for (cubic, points) in [(0, 0), (1, 500)] {
            let mut options = host::scene_options();
            options.cubic_sampling = cubic;
            // The first scene makes what the model keeps for all.
            destroy(stepped(model, &options, 1));
            let before = allocated();
            let scenes = stepped(model, &options, 8);
            let mut positions = vec![0.0f32; 3 * host::node_count(model)];
            let count = positions.len() as u64;
            let read = unsafe { upt_model_read_positions(model, positions.as_mut_ptr(), count) };
            assert_eq!(read, UPT_OK);
            for &scene in &scenes {
                let status = unsafe { upt_scene_attach_points(scene, positions.as_ptr(), points) };
                assert_eq!(status, UPT_OK, "{}", host::message());
                let nothing = std::ptr::null();
                let step = unsafe { upt_scene_step(scene, nothing, std::ptr::null_mut(), 0) };
                assert_eq!(step, UPT_OK);
            }
            drop(positions);
            let found = (allocated() - before) / scenes.len() as f64;
            let stated = host::stats(scenes[0]).memory_bytes as f64;
            println!("{name}, {points} points: {stated} bytes stated, {found:.0} found");
            assert!(
                (stated / found - 1.0).abs() < 0.1,
                "{name}: {stated} stated, {found} found"
            );
            destroy(scenes);
        }
        assert_eq!(unsafe { upt_model_destroy(model) }, UPT_OK);
    }
    let model = host::open(&fixture::shipped("brain-reduced"));
    let options = host::scene_options();
    destroy(stepped(model, &options, 1));
    let before = resident();
    let scenes = stepped(model, &options, 200);
    let most = resident();
    destroy(scenes);
    let after = resident();
    println!("resident: {before} before, {most} with 200 scenes, {after} after");
    assert!(most > 1.5 * before, "the scenes were there");
    // What allocators keep is no more than some scenes' worth.
    assert!(
        after - before < 0.02 * (most - before),
        "{after} bytes are resident, {before} were before"
    );
    assert_eq!(unsafe { upt_model_destroy(model) }, UPT_OK);
}
