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
mod scripts;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use allocator::without;
use calls::{Call, Rig};
use fixture::host;
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
        "upt_model_create" => 2560,
        "upt_scene_create" => 2048,
        "upt_haptics_create" => 1536,
        "upt_scene_attach_points" => 1024,
        // A model is made for the body, of many hundred lists: those that are as long as the mesh are refused.
        "upt_scene_cut" | "upt_scene_remove" | "upt_scene_tear" | "upt_scene_scale_stiffness" => {
            8192
        }
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
        || call.contains("tear")
        || call.contains("scale")
    {
        11
    } else {
        1
    }
}

/// The same with a bundle in a run that is not nightly (`UPT_NIGHTLY=1`): of what ships, whose steps are long, a fifth of them, of others a third where
/// it would be every one.
fn stride_with(bundle: &Path, call: &str) -> usize {
    let nightly = std::env::var_os("UPT_NIGHTLY").is_some_and(|value| value == "1");
    let ships = bundle
        .parent()
        .is_some_and(|folder| folder.ends_with("onnx"));
    match stride(call) {
        stride if nightly => stride,
        stride if ships => 5 * stride,
        1 => 3,
        stride => stride,
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
        let stride = stride_with(bundle, name);
        for at in (0..).step_by(stride) {
            let what = format!("{name}, request {at}");
            let mut rig = Rig::new(bundle, options);
            go_on(&what, &mut rig, &calls[..index], &given);
            rig.given.clear();
            let (status, refused) = without(least(name), at, || call(&mut rig));
            if !refused {
                let count = at / stride;
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
    options.sleep = UPT_SWITCH_OFF;
    (options.check_inversion, options.cubic_sampling) = (1, 1);
    change(&mut options);
    options
}

/// A bundle, a scene's options and the calls that are made with it.
type Case = (PathBuf, upt_scene_options, &'static [Call]);

fn cases(grouped: &Path) -> Vec<Case> {
    let corrected = options(|options| {
        (options.corrections.mode, options.corrections.count) = (UPT_CORRECTIONS_COUNT, 3);
        options.corrections.target_mm = 1e-4;
        options.substeps = 2;
    });
    let plain = options(|options| options.corrections.mode = UPT_CORRECTIONS_NONE);
    let brain = fixture::shipped;
    vec![
        (fixture::path("tiny-corrected"), corrected, CORRECTED),
        (fixture::path("tiny-corrected"), corrected, CUT),
        (grouped.to_owned(), corrected, GROUPS),
        (fixture::path("tiny-corrected"), plain, DRIVEN),
        (fixture::path("tiny-upt-prior"), plain, DRIVEN),
        (fixture::path("tiny-upt-prior"), plain, PLAIN),
        (fixture::path("tiny-upt"), plain, PLAIN),
        // Tables of which each is as large as it gets.
        (brain("liver-coarse"), corrected, &CORRECTED[..5]),
        (brain("brain-coarse"), plain, &PLAIN[..2]),
    ]
}

/// The case that a process of its own is for.
const CASE: &str = "UPT_TEST_STARVED";

/// One test: the allocator is the process's. Each case has a process, as many at a time as there are cores.
/// Verifies REQ-014.
#[test]
fn no_memory_is_a_status_wherever_it_is_missing() {
    fixture::find_runtime();
    let grouped = fixture::with_groups("tiny-corrected");
    let cases = cases(grouped.path());
    let run = |(path, options, calls): &Case| {
        let refused = starve(path, *options, calls);
        println!("{}: {refused} requests refused", path.display());
        assert!(refused > 20, "a scene has states");
    };
    if let Ok(case) = std::env::var(CASE) {
        return run(&cases[case.parse::<usize>().unwrap()]);
    }
    let program = std::env::current_exe().unwrap();
    if Command::new(&program).arg("--list").output().is_err() {
        println!("cases run one after another: an emulated program cannot start itself");
        return cases.iter().for_each(run);
    }
    let (count, next) = (cases.len(), AtomicUsize::new(0));
    let work = || {
        loop {
            let case = next.fetch_add(1, Ordering::Relaxed);
            if case >= count {
                break;
            }
            let child = Command::new(&program)
                .args(["--exact", "--nocapture", NAME])
                .env(CASE, case.to_string())
                .output()
                .unwrap();
            let told = String::from_utf8_lossy(&child.stdout).into_owned()
                + &String::from_utf8_lossy(&child.stderr);
            println!("{told}");
            assert!(child.status.success(), "case {case}: {told}");
            assert!(told.contains("requests refused"), "case {case}: {told}");
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers.min(count) {
            scope.spawn(work);
        }
    });
}

/// Of the test above.
const NAME: &str = "no_memory_is_a_status_wherever_it_is_missing";
