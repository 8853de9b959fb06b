//! `upt mesh` as a user calls it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn upt(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_upt"))
        .args(arguments)
        .output()
        .unwrap()
}

fn coarse() -> String {
    let path = root().join("onnx/meshes/brain-coarse.mesh.safetensors");
    path.display().to_string()
}

fn fixture(name: &str) -> String {
    let path = root().join("crates/tissue/tests/fixtures/import");
    path.join(name).display().to_string()
}

#[test]
fn info_of_the_committed_coarse_brain() {
    let output = upt(&["mesh", "info", &coarse(), "--json"]);
    assert!(output.status.success(), "{output:?}");
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(info["nodes"], 3152);
    assert_eq!(info["components"], 1);
    assert_eq!(info["euler_characteristic"], 2);
    assert_eq!(info["non_manifold_edges"].as_array().unwrap().len(), 0);
    assert!(info["min_dihedral_deg"].as_f64().unwrap() > 10.78);
    let critical = info["critical_step_s"].as_f64().unwrap();
    assert!((1.5e-4..4e-4).contains(&critical), "{critical}");
}

#[test]
fn a_stiffer_material_has_a_shorter_critical_step() {
    let step = |young: &str| {
        let output = upt(&["mesh", "info", &coarse(), "--json", "--young", young]);
        let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        info["critical_step_s"].as_f64().unwrap()
    };
    let ratio = step("3000") / step("12000");
    assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
}

#[test]
fn import_writes_a_mesh_that_info_reads() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("box.mesh.safetensors");
    let mesh = mesh.to_str().unwrap();
    let input = fixture("box-41-binary.msh");
    let output = upt(&[
        "mesh",
        "import",
        &input,
        mesh,
        "--fixed-sphere",
        "0,5,2.5,6",
        "--domain-sphere",
        "20,5,2.5,7",
    ]);
    assert!(output.status.success(), "{output:?}");
    let info = upt(&["mesh", "info", mesh]);
    let text = String::from_utf8(info.stdout).unwrap();
    assert!(text.contains("imported from box-41-binary.msh"), "{text}");
}

#[test]
fn faults_end_with_code_2_and_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("out.mesh.safetensors");
    let mesh = mesh.to_str().unwrap();
    for (input, wanted) in [("make.py", "unknown extension"), ("box.stl", "--nodes")] {
        let output = upt(&["mesh", "import", &fixture(input), mesh]);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(input) && text.contains(wanted), "{text}");
    }
    assert!(!Path::new(mesh).exists());
}
