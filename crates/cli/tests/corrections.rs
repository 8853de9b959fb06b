//! `upt corrections` gives a bundle its coarse space, and the corrected bundle follows the reference solver.

use std::path::Path;

use fixture::{copy_of, find_runtime, program, said};
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{ContactNode, Solver, SolverOptions};
use upt::{Contact, Corrections, Model, ModelOptions, Scene, SceneOptions};

/// A copy of the fixture without corrections.
fn bundle() -> tempfile::TempDir {
    copy_of("tiny-reduced")
}

fn corrected() -> tempfile::TempDir {
    copy_of("tiny-corrected")
}

fn upt(arguments: &[&str]) -> (bool, String) {
    let output = program(env!("CARGO_BIN_EXE_upt"), arguments)
        .output()
        .unwrap();
    (output.status.success(), said(&output))
}

/// Mean squared error against the solver over a slow push that is held, mm².
fn error(folder: &Path, corrections: Corrections) -> f64 {
    let model = Model::open(folder, &ModelOptions::default()).unwrap();
    let options = SceneOptions {
        corrections,
        sleep: false,
        ..SceneOptions::default()
    };
    let scene = Scene::new(model, &options).unwrap();
    let mesh = Mesh::read(&folder.join("mesh.safetensors")).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default()).unwrap();
    let domain = scene.model().indices(upt::IndexSet::DomainNodes).to_vec();
    let nodes = domain[domain.len() / 2 - 2..domain.len() / 2 + 2].to_vec();
    let (mut want, mut got) = (
        vec![[0.0f32; 3]; mesh.node_count()],
        vec![0.0f32; 3 * mesh.node_count()],
    );
    let mut sum = 0.0;
    for frame in 1..=20 {
        let depth = 0.4 * f32::min(frame as f32, 12.0);
        let c = [0.1 * depth, 0.0, -depth];
        let contact: Vec<ContactNode> = nodes
            .iter()
            .map(|&node| ContactNode {
                node,
                displacement: c,
            })
            .collect();
        solver.step_frame(&contact, 0.05).unwrap();
        solver.displacement(&mut want);
        let vectors = c.repeat(nodes.len());
        scene
            .step(
                Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                },
                Some(&mut got),
            )
            .unwrap();
        let pairs = want.as_flattened().iter().zip(&got);
        let squares = pairs.map(|(a, b)| f64::from(a - b).powi(2));
        sum += squares.sum::<f64>() / mesh.node_count() as f64;
    }
    sum / 20.0
}

/// Verifies REQ-082.
#[test]
fn a_corrected_bundle_follows_the_solver_and_more_corrections_closer() {
    find_runtime();
    let folder = bundle();
    let path = folder.path().to_str().unwrap();
    let (done, text) = upt(&[
        "corrections",
        path,
        "--natural",
        "12",
        "--patches",
        "16",
        "--patch-modes",
        "8",
    ]);
    assert!(done, "{text}");
    let manifest = std::fs::read_to_string(folder.path().join("bundle.json")).unwrap();
    assert!(manifest.contains("\"recommended\": 3"), "{manifest}");
    let errors = [0, 2, 8].map(|count| match count {
        0 => error(folder.path(), Corrections::None),
        count => error(folder.path(), Corrections::Fixed(count)),
    });
    println!("MSE for k = 0, 2, 8: {errors:?} mm²");
    assert!(errors[1] < 0.1 * errors[0], "{errors:?}");
    assert!(errors[2] < 0.02 * errors[0], "{errors:?}");
    // The same command again gives the same bytes.
    let file = folder.path().join("corrections.safetensors");
    let before = std::fs::read(&file).unwrap();
    let (done, text) = upt(&[
        "corrections",
        path,
        "--natural",
        "12",
        "--patches",
        "16",
        "--patch-modes",
        "8",
    ]);
    assert!(done, "{text}");
    assert_eq!(before, std::fs::read(&file).unwrap());
}

#[test]
fn pushes_may_have_more_nodes_than_columns_that_are_solved_for_at_once() {
    let folder = bundle();
    let path = folder.path().join("bundle.json");
    let mut manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    // All 42 contact nodes, 126 columns: a batch is of 96.
    manifest["envelope"]["contact_area_mm2"] = serde_json::json!([9000.0, 9500.0]);
    manifest.as_object_mut().unwrap().remove("manifest_sha256");
    std::fs::write(&path, manifest.to_string()).unwrap();
    let folder = folder.path().to_str().unwrap();
    let arguments = ["--natural", "12", "--patches", "4", "--patch-modes", "4"];
    let (done, text) = upt(&[&["corrections", folder], &arguments[..]].concat());
    assert!(done && text.contains("16 modes"), "{text}");
}

#[test]
fn a_coarse_space_is_extended_by_what_data_has_outside_of_it() {
    let folder = corrected();
    let (path, data) = (folder.path(), tempfile::tempdir().unwrap());
    let names = [path, data.path()].map(|path| path.to_str().unwrap());
    let modes = || {
        let bytes = std::fs::read(path.join("corrections.safetensors")).unwrap();
        let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        let modes = tensors.tensor("modes").unwrap();
        (modes.shape()[0], modes.data().to_vec())
    };
    let before = modes();
    let entry = |text: &[u8]| -> serde_json::Value {
        serde_json::from_slice::<serde_json::Value>(text).unwrap()["corrections"].clone()
    };
    let manifest = std::fs::read(path.join("bundle.json")).unwrap();

    let (done, text) = upt(&["corrections", names[0], "--extend"]);
    assert!(!done && text.contains("--data"), "{text}");
    let (done, text) = upt(&["corrections", names[0], "--extend", "--data", names[1]]);
    assert!(!done && text.contains("upt dataset"), "{text}");
    assert_eq!(before, modes());

    let mesh = path.join("mesh.safetensors");
    let (done, text) = upt(&[
        "dataset",
        "--mesh",
        mesh.to_str().unwrap(),
        "--schemes",
        "probe",
        "--count",
        "1",
        "--seed",
        "5",
        "--out",
        names[1],
    ]);
    assert!(done, "{text}");
    let (done, text) = upt(&[
        "corrections",
        names[0],
        "--extend",
        "--data",
        names[1],
        "--data-modes",
        "3",
    ]);
    assert!(done, "{text}");
    let after = modes();
    assert_eq!(after.0, before.0 + 3, "{text}");
    let changed = std::fs::read(path.join("bundle.json")).unwrap();
    assert_eq!(entry(&manifest), entry(&changed));
    Model::open(path, &ModelOptions::default()).unwrap();
}

#[test]
fn whole_modes_are_a_file_more_until_the_space_changes() {
    find_runtime();
    let folder = corrected();
    let path = folder.path().to_str().unwrap();
    let file = folder.path().join("whole.safetensors");
    let entry = || {
        let text = std::fs::read(folder.path().join("bundle.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&text).unwrap();
        manifest["corrections"].clone()
    };
    let space = std::fs::read(folder.path().join("corrections.safetensors")).unwrap();
    let (done, text) = upt(&["corrections", path, "--keep", "--whole", "40"]);
    assert!(done && text.contains("whole modes"), "{text}");
    assert_eq!(entry()["whole"], "whole.safetensors");
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    let scene = Scene::new(std::sync::Arc::clone(&model), &SceneOptions::default()).unwrap();
    let loads = upt::Loads {
        gravity: [1.0, 0.0, 0.0],
        ..upt::Loads::default()
    };
    let input = upt::StepInput {
        loads,
        ..upt::StepInput::default()
    };
    scene.step(input, None).unwrap();
    assert_eq!(
        space,
        std::fs::read(folder.path().join("corrections.safetensors")).unwrap()
    );

    let (done, text) = upt(&["corrections", path, "--natural", "12", "--patch-modes", "0"]);
    assert!(done, "{text}");
    assert!(entry()["whole"].is_null() && !file.exists());
    Model::open(folder.path(), &ModelOptions::default()).unwrap();
}

#[test]
fn what_a_bundle_recommends_changes_key_by_key() {
    find_runtime();
    let folder = corrected();
    let path = folder.path().to_str().unwrap();
    let set = |more: &[&str]| upt(&[&["corrections", path, "--keep"], more].concat());
    let entry = || {
        let text = std::fs::read(folder.path().join("bundle.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&text).unwrap();
        manifest["corrections"].clone()
    };
    let (done, text) = set(&["--recommended", "10@0.02/4", "--calibration", "1.5"]);
    assert!(done, "{text}");
    let (done, text) = set(&["--frame-step-s", "0.02"]);
    assert!(done, "{text}");
    let wanted = serde_json::json!({
        "file": "corrections.safetensors", "recommended": 10, "target_mm": 0.02, "substeps": 4, "calibration": 1.5, "frame_step_s": 0.02,
    });
    assert_eq!(entry(), wanted);
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    assert_eq!(model.info().frame_step_s, 0.02);
    let (done, text) = set(&["--recommended", "5"]);
    assert!(done, "{text}");
    let wanted = serde_json::json!({
        "file": "corrections.safetensors", "recommended": 5, "calibration": 1.5, "frame_step_s": 0.02,
    });
    assert_eq!(entry(), wanted);
    // Steps of their own length need corrections, and there are limits.
    for (more, message) in [
        (["--recommended", "0"], "--frame-step-s"),
        (["--frame-step-s", "0.06"], "0.01 to 0.05"),
        (["--frame-step-s", "nan"], "0.01 to 0.05"),
    ] {
        let (done, text) = set(&more);
        assert!(!done && text.contains(message), "{text}");
        assert_eq!(entry(), wanted);
    }
}

#[test]
fn a_bundle_without_a_linear_response_is_refused_untouched() {
    let folder = copy_of("tiny-upt");
    let (done, text) = upt(&["corrections", folder.path().to_str().unwrap()]);
    assert!(!done && text.contains("linear response"), "{text}");
    assert!(!folder.path().join("corrections.safetensors").exists());
    let (done, text) = upt(&[
        "corrections",
        bundle().path().to_str().unwrap(),
        "--natural",
        "0",
    ]);
    assert!(!done && text.contains("--natural"), "{text}");
}
