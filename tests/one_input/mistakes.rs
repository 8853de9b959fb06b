//! What cannot be meant is refused by name, in steps, submitted steps and frames, and changes nothing.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use std::ptr::null;

use upt::ffi::*;

use crate::{BUNDLE, awake, ball, frame, state, step};
use fixture::host::{self, Host, message};

/// What is wrong with an input, how it is made wrong, the status, and the field that the message names.
type Mistake = (&'static str, fn(&mut upt_input), i32, &'static str);

const fn pull(node: u32, weight: f32, force: f32) -> upt_point_force {
    upt_point_force {
        struct_size: size_of::<upt_point_force>() as u32,
        nodes: [node, 1, 2, 3],
        weights: [weight, 0.0, 0.0, 0.0],
        force: [0.0, force, 0.0],
    }
}

static BEYOND: upt_point_force = pull(1_000_000, 0.0, 1.0);
static HALF: upt_point_force = pull(0, 0.5, 1.0);
static HUGE: upt_point_force = pull(0, 1.0, 1e7);

fn put(input: &mut upt_input, force: &'static upt_point_force) {
    (input.point_forces, input.point_force_count) = (force, 1);
}

/// Verifies REQ-011.
#[test]
fn mistakes_are_named_and_change_nothing() {
    static NODES: [u32; 2] = [1, 1];
    static FAR: [u32; 1] = [1 << 30];
    static VECTORS: [f32; 6] = [0.1; 6];
    static NAN: [f32; 3] = [0.0, f32::NAN, 0.0];
    let host = Host::new(BUNDLE, awake);
    let tools = [ball(&host, 1.0)];
    let mut rough = tools[0];
    rough.position[1] = f32::NAN;
    let mut foreign = tools[0];
    foreign.struct_size -= 4;
    let field = vec![f32::NAN; 3 * host.nodes];
    let leak = |list: &[upt_instrument]| upt_input::of_instruments(list);
    let general: &[Mistake] = &[
        (
            "size",
            |i| i.struct_size -= 8,
            UPT_ERR_STRUCT_SIZE,
            "input: struct_size",
        ),
        (
            "larger",
            |i| i.struct_size += 8,
            UPT_ERR_STRUCT_SIZE,
            "input: struct_size",
        ),
        (
            "no size",
            |i| i.struct_size = 0,
            UPT_ERR_STRUCT_SIZE,
            "input: struct_size",
        ),
        (
            "reserved",
            |i| i.reserved[2] = 1,
            UPT_ERR_ARGUMENT,
            "input.reserved",
        ),
        (
            "time",
            |i| i.time_s = f64::NAN,
            UPT_ERR_NON_FINITE,
            "time_s",
        ),
        (
            "NULL nodes",
            |i| i.contact_count = 1,
            UPT_ERR_NULL,
            "input.contact_nodes",
        ),
        (
            "NULL vectors",
            |i| (i.contact_nodes, i.contact_count) = (NODES.as_ptr(), 1),
            UPT_ERR_NULL,
            "input.contact_vectors",
        ),
        (
            "too many nodes",
            |i| (i.contact_nodes, i.contact_count) = (NODES.as_ptr(), u64::MAX / 2),
            UPT_ERR_ARGUMENT,
            "input.contact_count",
        ),
        (
            "twice",
            |i| *i = upt_input::of_contacts(&NODES, &VECTORS),
            UPT_ERR_ARGUMENT,
            "contact_nodes",
        ),
        (
            "far",
            |i| *i = upt_input::of_contacts(&FAR, &VECTORS[..3]),
            UPT_ERR_ARGUMENT,
            "contact_nodes",
        ),
        (
            "NaN",
            |i| *i = upt_input::of_contacts(&NODES[..1], &NAN),
            UPT_ERR_NON_FINITE,
            "contact_vectors",
        ),
        (
            "NULL pressures",
            |i| i.pressure_count = 1,
            UPT_ERR_NULL,
            "input.pressures",
        ),
        (
            "many pressures",
            |i| i.pressure_count = 33,
            UPT_ERR_ARGUMENT,
            "input.pressure_count",
        ),
        (
            "NULL forces at points",
            |i| i.point_force_count = 1,
            UPT_ERR_NULL,
            "input.point_forces",
        ),
        (
            "many forces at points",
            |i| i.point_force_count = 257,
            UPT_ERR_ARGUMENT,
            "input.point_force_count",
        ),
        (
            "a force at no node",
            |i| put(i, &BEYOND),
            UPT_ERR_ARGUMENT,
            "point_forces[0]: node 1000000",
        ),
        (
            "half a force",
            |i| put(i, &HALF),
            UPT_ERR_ARGUMENT,
            "point_forces[0]: the weights",
        ),
        (
            "a force of 1e7",
            |i| put(i, &HUGE),
            UPT_ERR_ARGUMENT,
            "point_forces[0].force[1]",
        ),
        (
            "NULL tools",
            |i| i.instrument_count = 1,
            UPT_ERR_NULL,
            "input.instruments",
        ),
        (
            "many tools",
            |i| i.instrument_count = 65,
            UPT_ERR_ARGUMENT,
            "input.instrument_count",
        ),
    ];
    let mut wrong: Vec<(&str, upt_input, i32, &str)> = general
        .iter()
        .map(|&(what, change, status, named)| {
            let mut input = upt_input::NOTHING;
            change(&mut input);
            (what, input, status, named)
        })
        .collect();
    let driven = leak(&tools);
    let nodes = upt_input::of_contacts(&NODES[..1], &VECTORS[..3]);
    let (roughly, foreignly) = ([rough], [foreign]);
    wrong.extend([
        (
            "tools and nodes",
            upt_input {
                contact_count: 1,
                ..driven
            },
            UPT_ERR_ARGUMENT,
            "input.instruments and input.contact_nodes",
        ),
        (
            "tools and a field",
            upt_input {
                collision: field.as_ptr(),
                ..driven
            },
            UPT_ERR_ARGUMENT,
            "input.instruments and input.collision",
        ),
        (
            "nodes and a field",
            upt_input {
                collision: field.as_ptr(),
                ..nodes
            },
            UPT_ERR_ARGUMENT,
            "input.contact_nodes and input.collision",
        ),
        (
            "tools and a state",
            upt_input {
                displacement: field.as_ptr(),
                ..driven
            },
            UPT_ERR_ARGUMENT,
            "displacement and instruments",
        ),
        (
            "NaN in the field",
            upt_input {
                collision: field.as_ptr(),
                ..upt_input::NOTHING
            },
            UPT_ERR_NON_FINITE,
            "collision",
        ),
        (
            "NaN in a tool",
            leak(&roughly),
            UPT_ERR_NON_FINITE,
            "instruments[0]",
        ),
        (
            "a tool of another size",
            leak(&foreignly),
            UPT_ERR_STRUCT_SIZE,
            "input.instruments",
        ),
    ]);
    step(&host, &driven);
    frame(&host, &driven, 0.01);
    let before = state(&host);
    let mut u = vec![0.0f32; 3 * host.nodes];
    let (to, floats) = (u.as_mut_ptr(), u.len() as u64);
    let check = |call: &str, what: &str, status: i32, expected: i32, named: &str| {
        assert_eq!(status, expected, "{call}, {what}: {}", message());
        let said = message();
        assert!(said.starts_with(&format!("{call}: ")), "{said}");
        assert!(said.contains(named), "{call}, {what}: {said}");
        assert_eq!(state(&host), before, "{call}, {what}");
        assert_eq!(host::stats(host.scene).step_count, 1, "{call}, {what}");
    };
    for (what, input, expected, named) in &wrong {
        let stepped = unsafe { upt_scene_step(host.scene, input, to, floats) };
        check("upt_scene_step", what, stepped, *expected, named);
        let sent = unsafe { upt_scene_submit(host.scene, input) };
        check("upt_scene_submit", what, sent, *expected, named);
        // A frame goes on from the loads of its step.
        if !named.starts_with("point_forces[") {
            let shown = unsafe { upt_scene_present(host.scene, input, 0.01, null(), to, floats) };
            check("upt_scene_present", what, shown, *expected, named);
        }
    }
    // A displacement that is not finite, where it may be given.
    let input = upt_input {
        displacement: field.as_ptr(),
        ..upt_input::NOTHING
    };
    let stepped = unsafe { upt_scene_step(host.scene, &input, to, floats) };
    check(
        "upt_scene_step",
        "NaN",
        stepped,
        UPT_ERR_NON_FINITE,
        "displacement",
    );
    let sent = unsafe { upt_scene_submit(host.scene, &input) };
    check(
        "upt_scene_submit",
        "NaN",
        sent,
        UPT_ERR_NON_FINITE,
        "displacement",
    );
    // A frame starts from the scene's own state, and says when itself.
    let input = upt_input {
        displacement: u.as_ptr(),
        ..upt_input::NOTHING
    };
    let shown = unsafe { upt_scene_present(host.scene, &input, 0.01, null(), to, floats) };
    check(
        "upt_scene_present",
        "a state",
        shown,
        UPT_ERR_ARGUMENT,
        "displacement",
    );
    let input = upt_input {
        time_s: 1.0,
        ..driven
    };
    let shown = unsafe { upt_scene_present(host.scene, &input, 0.01, null(), to, floats) };
    check(
        "upt_scene_present",
        "a time",
        shown,
        UPT_ERR_ARGUMENT,
        "time_s",
    );
    let mut view = upt_view::POINTS;
    view.kind = 9;
    let shown = unsafe { upt_scene_present(host.scene, &driven, 0.01, &view, to, floats) };
    check(
        "upt_scene_present",
        "a kind",
        shown,
        UPT_ERR_ARGUMENT,
        "view.kind",
    );
    for kind in [UPT_VIEW_NODES, UPT_VIEW_SURFACE] {
        view.kind = kind;
        let read = unsafe { upt_scene_read(host.scene, &view, to, floats) };
        let what = format!("kind {kind} of a state");
        let named = if kind == UPT_VIEW_NODES {
            "view.kind"
        } else {
            "surface"
        };
        check("upt_scene_read", &what, read, UPT_ERR_UNSUPPORTED, named);
    }
    view.kind = UPT_VIEW_NODES;
    let shown = unsafe { upt_scene_present(host.scene, &driven, 0.01, &view, to, floats) };
    let status = UPT_ERR_UNSUPPORTED;
    check("upt_scene_present", "nodes", shown, status, "view.kind");
    // What a view of nodes of another model has, or a list where the kind takes none.
    for (kind, nodes, named) in [
        (UPT_VIEW_NODES, &FAR[..], "nodes[0] is 1073741824"),
        (UPT_VIEW_POINTS, &FAR[..], "view.node_count"),
    ] {
        let mut view = upt_view::of_nodes(nodes);
        view.kind = kind;
        let shown = unsafe { upt_scene_decode(host.scene, &view, to, 3) };
        check("upt_scene_decode", "nodes", shown, UPT_ERR_ARGUMENT, named);
    }
    view.struct_size = 4;
    let shown = unsafe { upt_scene_present(host.scene, &driven, 0.01, &view, to, floats) };
    check(
        "upt_scene_present",
        "a size",
        shown,
        UPT_ERR_STRUCT_SIZE,
        "view: struct_size",
    );
    for when in [f64::NAN, -1e-3] {
        let shown = unsafe { upt_scene_present(host.scene, &driven, when, null(), to, floats) };
        assert!(matches!(shown, UPT_ERR_NON_FINITE | UPT_ERR_ARGUMENT));
        check("upt_scene_present", "when", shown, shown, "when is");
    }
}
