//! `upt-study` as it is run: from simulated cases to rows and pages, and what is refused.

mod envelope;
mod loads;
mod report;
mod stress;
mod tools;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const MESH: &str = "tests/fixtures/box.mesh.safetensors";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Runs the command in the repository's root.
fn study(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_upt-study"));
    command.current_dir(root()).args(arguments);
    if std::env::var_os("ORT_DYLIB_PATH").is_none() {
        let library = root().join("target/ort/libonnxruntime.so");
        command.env("ORT_DYLIB_PATH", library);
    }
    command.output().expect("upt-study starts")
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What a command that ends well prints as JSON.
fn json(arguments: &[&str]) -> serde_json::Value {
    let output = study(arguments);
    assert!(output.status.success(), "{}", told(&output));
    serde_json::from_slice(&output.stdout).expect("it prints JSON")
}

/// Simulates a load on a mesh, such as `--tool press`.
fn simulate(folder: &Path, mesh: &str, load: &[&str]) -> String {
    let words: Vec<&str> = load
        .iter()
        .copied()
        .filter(|word| !word.starts_with("--"))
        .collect();
    let file = folder.join(format!("{}.trajectory.safetensors", words.join("-")));
    let file = file.to_str().expect("a name in UTF-8").to_owned();
    let output = study(&[&["simulate", "--mesh", mesh, "--out", &file], load].concat());
    assert!(output.status.success(), "{}", told(&output));
    file
}
