//! What instruments mean to the C ABI: one reader for all calls that take them, and counts that no array has.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use std::ptr::{null, null_mut};

use upt::ffi::*;

use fixture::host::{Host, ball, message};

fn contacts(host: &Host, tool: &upt_instrument) -> (i32, u64) {
    let mut count = 0;
    let none = null_mut::<u32>();
    let status = unsafe {
        upt_scene_contacts_from_instruments(host.scene, tool, 1, none, null_mut(), 0, &mut count)
    };
    (status, count)
}

/// A ball is a capsule without length, in steps and where contacts are asked for; so is a hull a shape.
#[test]
fn what_a_step_takes_gives_contacts_too() {
    let host = Host::new("tiny-reduced", |_| ());
    let mut ball = ball(&host, 1.0);
    let step = |tool: &upt_instrument| unsafe {
        let input = upt_input::of_instruments(std::slice::from_ref(tool));
        upt_scene_step(host.scene, &input, null_mut(), 0)
    };
    let (status, count) = contacts(&host, &ball);
    assert_eq!(status, UPT_OK, "{}", message());
    assert!(count > 0);
    assert_eq!(step(&ball), UPT_OK, "{}", message());
    let corners: Vec<f32> = (0..8)
        .flat_map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 3.0 } else { -3.0 }))
        .collect();
    let mut hull = null_mut();
    assert_eq!(
        unsafe { upt_hull_create(corners.as_ptr(), 8, null(), 0, &mut hull) },
        UPT_OK
    );
    (ball.shape, ball.radius, ball.hull) = (UPT_SHAPE_HULL, 0.0, hull.cast_const());
    let (status, count) = contacts(&host, &ball);
    assert_eq!(status, UPT_OK, "{}", message());
    assert!(count > 0);
    // Both refuse the same.
    (ball.shape, ball.hull, ball.friction) = (UPT_SHAPE_CAPSULE, null_mut(), -1.0);
    ball.radius = 3.0;
    let refused = (contacts(&host, &ball).0, message());
    assert_eq!(refused.0, UPT_ERR_ARGUMENT);
    assert_eq!(step(&ball), UPT_ERR_ARGUMENT);
    assert!(
        refused.1.contains("instruments[0]: friction"),
        "{}",
        refused.1
    );
    assert_eq!(unsafe { upt_hull_destroy(hull) }, UPT_OK);
}

/// A place for so many elements that is nowhere is an error, also where there is nothing to write.
#[test]
fn no_place_with_a_capacity_is_an_error() {
    let host = Host::new("tiny-reduced", |_| ());
    let find = |capacity: u64| {
        let mut needed = 7;
        let scene = host.scene;
        let status =
            unsafe { upt_scene_read_instrument_contacts(scene, null_mut(), capacity, &mut needed) };
        (status, needed)
    };
    for round in 0..2 {
        assert_eq!(find(0).0, UPT_OK);
        for capacity in [1, u64::MAX] {
            assert_eq!(find(capacity).0, UPT_ERR_NULL, "round {round}: {capacity}");
            assert!(message().contains("out is NULL"), "{}", message());
        }
        let tool = ball(&host, 1.0);
        let input = upt_input::of_instruments(std::slice::from_ref(&tool));
        let status = unsafe { upt_scene_step(host.scene, &input, null_mut(), 0) };
        assert_eq!(status, UPT_OK, "{}", message());
    }
    let mut needed = 0;
    let status = unsafe { upt_scene_save(host.scene, null_mut(), u64::MAX, &mut needed) };
    assert_eq!(status, UPT_ERR_NULL);
}
