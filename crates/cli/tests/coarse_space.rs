//! Both boundary conditions of a mesh file in `upt make`, and a coarse space that learns from simulated tools (`upt corrections --data`).

use std::path::Path;

use fixture::{manifest, program, said};
use tissue::mesh::box_phantom;

/// Runs `upt` and returns whether it succeeded, with all that it printed.
fn upt(arguments: &[&str]) -> (bool, String) {
    let output = program(env!("CARGO_BIN_EXE_upt"), arguments)
        .env("ORT_DYLIB_PATH", "/nowhere/libonnxruntime.so")
        .output()
        .unwrap();
    (output.status.success(), said(&output))
}

fn done(arguments: &[&str]) -> String {
    let (success, text) = upt(arguments);
    assert!(success, "{arguments:?}: {text}");
    text
}

#[test]
fn a_supported_body_becomes_a_bundle_that_learns_a_coarse_space_from_tools() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let mesh = box_phantom([60.0, 60.0, 30.0], [8, 8, 4]).unwrap();
    mesh.write(Path::new(&path("block.mesh.safetensors")))
        .unwrap();
    let (block, made) = (path("block.mesh.safetensors"), path("made"));
    let make = [
        "make",
        &block,
        "--out",
        &made,
        "--minutes",
        "0.01",
        "--cases",
        "1",
    ];
    let make = [
        &make[..],
        &["--natural", "12", "--patches", "12", "--boundary"],
    ]
    .concat();
    done(&[&make[..], &["supported"]].concat());
    let found = manifest(Path::new(&made));
    assert_eq!(found["boundary"], "supported");

    // The other boundary condition is another body: nothing that was made for this one is taken.
    let text = done(&[&make[..], &["fixed"]].concat());
    assert!(!text.contains("kept from an earlier run"), "{text}");
    assert_eq!(manifest(Path::new(&made))["boundary"], "fixed");
    done(&[&make[..], &["supported"]].concat());

    let data = |boundary: &str| {
        let out = path(boundary);
        done(&[
            "dataset",
            "--mesh",
            &block,
            "--boundary",
            boundary,
            "--tools",
            "press,two",
            "--count",
            "4",
            "--out",
            &out,
        ]);
        out
    };
    let learn = |data: &str, modes: &str| {
        let learn = [
            "corrections",
            &made,
            "--natural",
            "12",
            "--patch-modes",
            "0",
        ];
        upt(&[&learn[..], &["--data", data, "--data-modes", modes]].concat())
    };
    let supported = data("supported");
    let counts = ["4", "9"].map(|modes| {
        let (success, text) = learn(&supported, modes);
        assert!(success, "{text}");
        let (_, after) = text.split_once("corrections.safetensors: ").unwrap();
        after
            .split_once(" modes")
            .unwrap()
            .0
            .parse::<usize>()
            .unwrap()
    });
    assert_eq!(counts, [16, 21]);

    let (success, text) = learn(&data("fixed"), "4");
    assert!(!success && text.contains("boundary `fixed`"), "{text}");
    let (success, text) = learn(&path("nothing"), "4");
    assert!(!success && text.contains("upt dataset"), "{text}");
}

#[test]
fn a_body_without_the_asked_set_is_told_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("block.mesh.safetensors");
    let mut mesh = box_phantom([60.0, 60.0, 30.0], [4, 4, 2]).unwrap();
    mesh.supported.clear();
    mesh.write(&file).unwrap();
    let out = folder.path().join("made");
    let (success, text) = upt(&[
        "make",
        file.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
        "--boundary",
        "supported",
    ]);
    assert!(
        !success && text.contains("--boundary supported") && text.contains("--fixed"),
        "{text}"
    );
    assert!(!out.exists());
}
