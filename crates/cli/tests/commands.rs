//! The command `upt` as a user runs it: exit codes, JSON, a simulation and its replay.
//!
//! ONNX Runtime is found by `ORT_DYLIB_PATH`, else in `target/ort/` where `cargo xtask ort` puts it.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use fixture::{json, program};

fn upt(arguments: &[&str]) -> Command {
    program(env!("CARGO_BIN_EXE_upt"), arguments)
}

fn run(arguments: &[&str]) -> Output {
    upt(arguments).output().expect("upt starts")
}

#[test]
fn doctor_opens_a_bundle_and_says_what_it_found() {
    let output = run(&["doctor", "--json", "tests/fixtures/tiny-upt"]);
    let findings = json(&output);
    assert_eq!(output.status.code(), Some(0), "{findings}");
    assert_eq!(findings["onnxruntime"]["loaded"], true);
    assert_eq!(findings["bundles"][0]["kind"], "upt");
    assert_eq!(
        findings["bundles"][0]["sha256"].as_str().map(str::len),
        Some(64)
    );
    assert!(
        findings["providers"]
            .as_array()
            .is_some_and(|list| list.len() >= 2)
    );
}

#[test]
fn doctor_fails_with_1_and_names_the_broken_bundle() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bundle.json"), "{}").unwrap();
    let output = run(&["doctor", "--json", folder.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        json(&output)["bundles"][0]["problem"]
            .as_str()
            .unwrap()
            .contains("bundle.json")
    );
}

#[test]
fn wrong_input_is_exit_code_2_with_a_message() {
    let output = run(&["rollout", "no-such-bundle", "no-such-trajectory"]);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        message.contains("no-such-bundle") && message.contains("bundle.json"),
        "{message}"
    );
    assert_eq!(run(&["no-such-command"]).status.code(), Some(2));
}

#[test]
fn loads_are_listed_and_their_names_are_values() {
    let tables = json(&run(&["loads", "--json"]));
    let names = |table: &str| -> Vec<String> {
        let rows = tables[table].as_array().expect("rows");
        let names = rows.iter().map(|row| row["name"].as_str().expect("a name"));
        names.map(str::to_owned).collect()
    };
    let page = String::from_utf8(run(&["loads"]).stdout).unwrap();
    for name in names("schemes").iter().chain(&names("programmes")) {
        assert!(page.contains(&format!("| `{name}`")), "{name}: {page}");
    }
    // A name of the table is taken, and the mesh is what is wrong; another name is refused with those that there are.
    for (option, name) in [("--scheme", "hard-ring"), ("--tool", "wobble")] {
        let with = |value: &str| {
            let output = run(&["simulate", "--mesh", "no-such", "--out", "x", option, value]);
            assert_eq!(output.status.code(), Some(2));
            String::from_utf8_lossy(&output.stderr).into_owned()
        };
        assert!(with(name).contains("no-such"), "{}", with(name));
        assert!(with("shove").contains(name), "{}", with("shove"));
    }
}

#[test]
fn a_closed_pipe_is_not_a_panic() {
    let mut child = upt(&["completions", "zsh"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!message.contains("panicked"), "{message}");
}

/// Simulates a contact on the fixture's mesh and replays it.
#[test]
fn a_contact_is_simulated_and_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let trajectory = path("push.trajectory.safetensors");
    let output = run(&[
        "simulate",
        "--mesh",
        "tests/fixtures/box.mesh.safetensors",
        "--scheme",
        "1",
        "--seed",
        "3",
        "--out",
        &trajectory,
    ]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );

    let bundle = "tests/fixtures/tiny-upt";
    let picture = path("push.png");
    let output = run(&[
        "rollout",
        bundle,
        &trajectory,
        "--json",
        "--png",
        &picture,
        "--vtu",
        &path("vtu"),
    ]);
    let rollout = json(&output);
    assert_eq!(rollout["steps"].as_array().unwrap().len(), 160);
    let mse = rollout["overall"]["mse_mm2"].as_f64().unwrap();
    assert!(
        mse > 0.0 && mse.is_finite(),
        "random weights cannot be right: {mse}"
    );
    assert_eq!(&std::fs::read(&picture).unwrap()[1..4], b"PNG");
    assert!(
        Path::new(&path("vtu/rollout.pvd")).exists()
            && Path::new(&path("vtu/frame-0160.vtu")).exists()
    );
}
