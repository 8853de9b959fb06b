//! The stability suite at a twentieth of its length, with a bundle of each kind: every verdict must be good.

use std::path::Path;
use std::process::Command;

/// At least `least` cases must run, and all end well.
fn ends_as_it_must(arguments: &[&str], least: usize) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rows = folder.path().join("rows.json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_upt"));
    command
        .current_dir(&root)
        .args(["stress", "--quick", "--json"])
        .arg(&rows)
        .args(arguments);
    if std::env::var_os("ORT_DYLIB_PATH").is_none() {
        command.env("ORT_DYLIB_PATH", root.join("target/ort/libonnxruntime.so"));
    }
    let output = command.output().expect("upt starts");
    let table = String::from_utf8_lossy(&output.stdout);
    let problems = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{table}{problems}");
    let text = std::fs::read_to_string(&rows).expect("rows were written");
    let rows: Vec<serde_json::Value> = serde_json::from_str(&text).expect("rows are JSON");
    let good = rows.iter().filter(|row| row["verdict"] == "good").count();
    assert!(good >= least, "only {good} cases ran: {table}");
}

#[test]
fn the_reference_solver_survives_every_stiff_case() {
    ends_as_it_must(&[], 8);
}

#[test]
fn a_reduced_bundle_survives_every_extreme_case() {
    ends_as_it_must(
        &["--no-reference", "--bundle", "onnx/brain-coarse-reduced"],
        40,
    );
}

#[test]
fn a_transformer_survives_every_extreme_case() {
    ends_as_it_must(&["--no-reference", "--bundle", "onnx/brain-coarse"], 40);
}
