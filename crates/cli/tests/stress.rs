//! The stability suite at a twentieth of its length, with a bundle of each kind: every verdict must be good.

use std::path::Path;
use std::process::Command;

#[test]
fn every_stiff_and_extreme_case_ends_as_it_must() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rows = folder.path().join("rows.json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_upt"));
    command
        .current_dir(&root)
        .args([
            "stress",
            "--quick",
            "--bundle",
            "onnx/brain-coarse-reduced",
            "--bundle",
            "onnx/brain-coarse",
            "--json",
        ])
        .arg(&rows);
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
    assert!(good >= 90, "only {good} cases ran: {table}");
}
