//! `UPT_TRACE`: the spans of a process's steps as a file for profilers. A process of its own: the variable is read at the first call.
#![cfg(feature = "instruments")]
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header"
)]

use std::collections::HashSet;
use std::ffi::{CStr, c_char, c_void};
use std::path::Path;
use std::ptr::null_mut;
use std::sync::Mutex;

use fixture::host::{Host, ball};
use serde_json::Value;
use upt::ffi::*;

static TOLD: Mutex<Vec<String>> = Mutex::new(Vec::new());

unsafe extern "C" fn hear(_: i32, text: *const c_char, _: *mut c_void) {
    let text = unsafe { CStr::from_ptr(text) };
    TOLD.lock()
        .unwrap()
        .push(text.to_string_lossy().into_owned());
}

fn step(host: &Host, depth: f32) {
    let tool = ball(host, depth);
    let mut input: upt_input = unsafe { std::mem::zeroed() };
    input.struct_size = size_of::<upt_input>() as u32;
    (input.instruments, input.instrument_count) = (&tool, 1);
    assert_eq!(
        unsafe { upt_scene_step(host.scene, &input, null_mut(), 0) },
        UPT_OK
    );
}

fn events(file: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(file).unwrap();
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// Start and end of an event, µs.
fn times(event: &Value) -> (f64, f64) {
    let start = event["ts"].as_f64().unwrap();
    (start, start + event["dur"].as_f64().unwrap())
}

#[test]
fn each_step_is_there_with_what_it_did_inside_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("steps \"1\".json");
    // SAFETY: no other thread of this process runs yet.
    unsafe { std::env::set_var("UPT_TRACE", &file) };
    let host = Host::new("tiny-corrected", |options| {
        (options.corrections.mode, options.corrections.count) = (UPT_CORRECTIONS_COUNT, 3)
    });
    for number in 1..=4 {
        step(&host, 0.2 * number as f32);
        // Whole after each step, not only at the end.
        let events = events(&file);
        let steps: Vec<&Value> = events.iter().filter(|one| one["name"] == "step").collect();
        assert_eq!(steps.len(), number);
        let (begun, ended) = times(steps[number - 1]);
        let inside = events.iter().filter(|one| {
            let (start, end) = times(one);
            one["tid"] == steps[0]["tid"] && start >= begun - 0.01 && end <= ended + 0.01
        });
        let inside: HashSet<&str> = inside.filter_map(|one| one["name"].as_str()).collect();
        for name in ["search", "corrections", "guess", "iteration", "contact"] {
            assert!(inside.contains(name), "step {number}: {name} of {inside:?}");
        }
    }
    // What came out of a step stands beside its number.
    let of = |events: &[Value], number: usize| {
        let mut steps = events.iter().filter(|one| one["name"] == "step");
        steps.nth(number).unwrap()["args"]["of"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let last = of(&events(&file), 3);
    let told = fixture::host::stats(host.scene);
    let counts = format!(
        "step=3 contacts={} corrections={} ",
        told.contact_count, told.corrections
    );
    assert!(
        last.starts_with(&counts) && told.contact_count > 0,
        "{last}"
    );
    assert!(
        last.contains("error_mm=") && last.ends_with(&format!("flags={}", told.flags)),
        "{last}"
    );
    submitted_steps_are_there_on_the_workers_thread(&host, &file);
    // A trace makes no messages, and a receiver that wants few gets few.
    let level = UPT_LOG_WARN;
    assert_eq!(
        unsafe { upt_set_log(Some(hear), null_mut(), level) },
        UPT_OK
    );
    step(&host, 1.0);
    assert_eq!(*TOLD.lock().unwrap(), Vec::<String>::new());
    assert_eq!(unsafe { upt_set_log(None, null_mut(), level) }, UPT_OK);
    let named = |name: &str| {
        events(&file)
            .iter()
            .filter(|one| one["name"] == name)
            .count()
    };
    assert_eq!((named("step"), named("open")), (6, 1));
}

/// As the fifth step, with what it did inside of it.
fn submitted_steps_are_there_on_the_workers_thread(host: &Host, file: &Path) {
    let tool = ball(host, 0.9);
    let mut input: upt_input = unsafe { std::mem::zeroed() };
    input.struct_size = size_of::<upt_input>() as u32;
    (input.instruments, input.instrument_count) = (&tool, 1);
    assert_eq!(unsafe { upt_scene_submit(host.scene, &input) }, UPT_OK);
    assert_eq!(unsafe { upt_scene_wait(host.scene, 60_000) }, UPT_OK);
    let events = events(file);
    let steps: Vec<&Value> = events.iter().filter(|one| one["name"] == "step").collect();
    let (own, workers) = (&steps[0]["tid"], &steps[4]["tid"]);
    assert_ne!(own, workers);
    let inside: HashSet<&str> = events
        .iter()
        .filter(|one| one["tid"] == *workers)
        .filter_map(|one| one["name"].as_str())
        .collect();
    for name in ["step", "search", "corrections", "guess", "iteration"] {
        assert!(inside.contains(name), "{name} of {inside:?}");
    }
}
