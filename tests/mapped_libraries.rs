//! What a process has mapped after it used the library: nothing of a GPU, and no ONNX Runtime before a model needs it.
#![cfg(target_os = "linux")]

use std::collections::BTreeSet;

use fixture::{BUNDLES, find_runtime, model, plain, rollout, scene};
use upt::{Model, ModelOptions};

/// File names of the shared libraries in this process.
fn mapped() -> BTreeSet<String> {
    std::fs::read_to_string("/proc/self/maps")
        .unwrap()
        .lines()
        .filter_map(|line| line.split_whitespace().nth(5)?.rsplit('/').next())
        .filter(|name| name.contains(".so"))
        .map(str::to_owned)
        .collect()
}

fn of_runtime(names: &BTreeSet<String>) -> Vec<&String> {
    names
        .iter()
        .filter(|name| name.contains("onnxruntime"))
        .collect()
}

/// One test: a library that was mapped stays.
/// Verifies REQ-019.
#[test]
fn a_process_maps_only_what_its_models_need() {
    let at_start = mapped();
    assert!(!at_start.is_empty(), "the C library at least");
    find_runtime();
    Model::open(&fixture::path("no-such-bundle"), &ModelOptions::default())
        .map(|_| ())
        .unwrap_err();
    assert_eq!(
        mapped(),
        at_start,
        "initialising and a bundle that is not there open nothing"
    );

    for name in BUNDLES {
        rollout(&scene(&model(name), &plain()), 3);
    }
    let names = mapped();
    assert_eq!(
        of_runtime(&names).len(),
        1,
        "ONNX Runtime and no provider library of its: {names:?}"
    );
    for part in [
        "cuda", "cudnn", "cublas", "cufft", "curand", "nvrtc", "nvinfer", "tensorrt", "nvonnx",
    ] {
        let found: Vec<_> = names.iter().filter(|name| name.contains(part)).collect();
        assert!(found.is_empty(), "nobody asked for a GPU: {found:?}");
    }
}
