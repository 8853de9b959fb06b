//! `upt-study` as it is run: from simulated cases to rows and pages, and what is refused.

mod envelope;
mod loads;
mod report;
mod stress;
mod tools;

use std::path::Path;
use std::process::Output;

use fixture::program;

const MESH: &str = "tests/fixtures/box.mesh.safetensors";

/// Runs the command in the repository's root.
fn study(arguments: &[&str]) -> Output {
    let mut command = program(env!("CARGO_BIN_EXE_upt-study"), arguments);
    command.output().expect("upt-study starts")
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What a command that ends well prints as JSON.
fn json(arguments: &[&str]) -> serde_json::Value {
    let output = study(arguments);
    assert!(output.status.success(), "{}", told(&output));
    fixture::json(&output)
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
