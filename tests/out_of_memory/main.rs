//! No memory is a status. Each call is made with the first, the second, ... of its requests for memory refused once: it gives
//! `UPT_ERR_OUT_OF_MEMORY` and changes nothing, so that the call made again, and all calls after it, give the bits that they give
//! where nothing was refused.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

mod allocator;
mod calls;
mod cuts;
#[path = "../fixture/mod.rs"]
mod fixture;
#[path = "../host/mod.rs"]
mod host;
mod scripts;

use std::path::Path;

use allocator::without;
use calls::{Call, Rig};
use scripts::{CORRECTED, CUT, DRIVEN, GROUPS, PLAIN};
use upt::ffi::*;

/// Makes the calls of a rig from one of them on; each has to give what it gave before.
fn go_on(what: &str, rig: &mut Rig, calls: &[Call], given: &[Vec<u8>]) {
    for ((name, call), given) in calls.iter().zip(given) {
        rig.given.clear();
        let status = call(rig);
        assert_eq!(status, UPT_OK, "{what}, then {name}: {}", host::message());
        assert!(rig.given == *given, "{what}, then {name}: other bits");
    }
}

/// Least bytes of a request that is refused. Smaller ones are texts, nodes of maps, and values of one size: behind an `Arc`, for which
/// the standard library has no error, or what serde_json, safetensors and ort make of a file's header and names.
fn least(call: &str) -> usize {
    match call {
        "upt_model_open" => 2560,
        "upt_scene_create" => 2048,
        "upt_haptics_create" => 1536,
        "upt_scene_attach_points" => 1024,
        // A model is made for the body, of many hundred lists: those that are as long as the mesh are refused.
        "upt_scene_cut" | "upt_scene_remove" | "upt_scene_scale_stiffness" => 8192,
        _ if call.contains("cut") || call.contains("surface") => 8192,
        _ => 512,
    }
}

/// Which requests of a call are refused, every one or every eleventh: a model is made for a body that changes, and a solver for a group that moves, of
/// hundreds of lists.
fn stride(call: &str) -> usize {
    if call == "a step that leads a group" || call == "a step that lets a group go" {
        return 7;
    }
    if call.contains("cut")
        || call.contains("surface")
        || call.contains("remove")
        || call.contains("scale")
    {
        11
    } else {
        1
    }
}

/// Requests of all calls, refused one at a time. Returns how many were.
fn starve(bundle: &Path, options: upt_scene_options, calls: &[Call]) -> usize {
    let mut rig = Rig::new(bundle, options);
    let mut given = Vec::new();
    for (name, call) in calls {
        rig.given.clear();
        assert_eq!(call(&mut rig), UPT_OK, "{name}: {}", host::message());
        given.push(rig.given.clone());
    }
    drop(rig);
    let mut all = 0;
    for (index, (name, call)) in calls.iter().enumerate() {
        for at in (0..).step_by(stride(name)) {
            let what = format!("{name}, request {at}");
            let mut rig = Rig::new(bundle, options);
            go_on(&what, &mut rig, &calls[..index], &given);
            rig.given.clear();
            let (status, refused) = without(least(name), at, || call(&mut rig));
            if !refused {
                let count = at / stride(name);
                println!("{name}: {count} requests");
                all += count;
                break;
            }
            // A step that is made and only could not be told to a hand is told once more.
            let told_again = status == UPT_OK && rig.given == given[index];
            if !told_again {
                assert_eq!(status, UPT_ERR_OUT_OF_MEMORY, "{what}: {}", host::message());
            }
            let next = index + usize::from(told_again);
            go_on(&what, &mut rig, &calls[next..], &given[next..]);
        }
    }
    all
}

fn options(change: impl FnOnce(&mut upt_scene_options)) -> upt_scene_options {
    let mut options = host::scene_options();
    options.guard_policy = UPT_GUARD_REPORT;
    options.sleep = UPT_SWITCH_OFF as u8;
    (options.check_inversion, options.cubic_sampling) = (1, 1);
    change(&mut options);
    options
}

/// One test: the allocator is the process's.
/// Verifies REQ-014.
#[test]
fn no_memory_is_a_status_wherever_it_is_missing() {
    fixture::find_runtime();
    let corrected = options(|options| {
        options.corrections = 3;
        options.corrections_target_mm = 1e-4;
        options.substeps = 2;
    });
    let plain = options(|options| options.corrections = UPT_CORRECTIONS_NONE);
    let brain = |name: &str| {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("onnx")
            .join(name)
    };
    let grouped = fixture::with_groups("tiny-corrected");
    for (path, options, calls) in [
        (fixture::path("tiny-corrected"), corrected, CORRECTED),
        (fixture::path("tiny-corrected"), corrected, CUT),
        (grouped.path().to_path_buf(), corrected, GROUPS),
        (fixture::path("tiny-corrected"), plain, DRIVEN),
        (fixture::path("tiny-upt-prior"), plain, DRIVEN),
        (fixture::path("tiny-upt-prior"), plain, PLAIN),
        (fixture::path("tiny-upt"), plain, PLAIN),
        // Tables of which each is as large as it gets.
        (brain("liver-coarse"), corrected, &CORRECTED[..5]),
        (brain("brain-coarse"), plain, &PLAIN[..2]),
    ] {
        let refused = starve(&path, options, calls);
        println!("{}: {refused} requests refused", path.display());
        assert!(refused > 20, "a scene has states");
    }
}
