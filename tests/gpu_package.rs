//! The scripts for a machine with a graphics card, rehearsed on the CPU: packed in pieces, checked, unpacked, run; the
//! report holds the rows of what ran and a reason for everything that did not.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn script(name: &str) -> Command {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("xtask/gpu")
        .join(name);
    let mut command = Command::new("bash");
    command.arg(path);
    command
}

fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}\n{}",
        output.status,
        text(&output.stdout),
        text(&output.stderr)
    );
    output
}

/// Cargo builds the package's examples together with its tests.
fn examples() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.parent().unwrap().with_file_name("examples")
}

fn pieces(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().flatten();
    let mut found: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            name.starts_with("upt-gpu.") && !name.ends_with(".sums")
        })
        .collect();
    found.sort();
    found
}

#[test]
fn the_rehearsal_reports_what_ran_and_what_did_not() {
    for tool in ["bash", "xz", "tar", "split", "sha256sum"] {
        if Command::new(tool).arg("--version").output().is_err() {
            println!("skipped: {tool} is not installed");
            return;
        }
    }
    if !examples().join("gpu-measure").exists() {
        println!("skipped: the example gpu-measure was not built with the tests");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    run(script("pack.sh")
        .arg(at("packed"))
        .arg("--rehearse")
        .env("ORT_DYLIB_PATH", fixture::runtime_path())
        .env("UPT_GPU_BINARIES", examples())
        .env("UPT_GPU_PIECE", "4M")
        .env("UPT_GPU_XZ", "0"));
    let pieces = pieces(&at("packed"));
    assert!(pieces.len() > 1, "{pieces:?}");
    for piece in &pieces {
        assert!(
            std::fs::metadata(piece).unwrap().len() <= 4 << 20,
            "{piece:?}"
        );
    }

    // A piece that was altered on the way is not unpacked.
    let unpack = || {
        let mut command = Command::new("bash");
        command.arg(at("packed").join("unpack.sh")).arg(at("there"));
        command
    };
    let whole = std::fs::read(&pieces[1]).unwrap();
    let mut altered = whole.clone();
    altered[100] ^= 1;
    std::fs::write(&pieces[1], &altered).unwrap();
    assert!(!unpack().output().unwrap().status.success());
    assert!(!at("there").join("upt").exists());
    std::fs::write(&pieces[1], &whole).unwrap();
    run(&mut unpack());

    run(Command::new("bash")
        .arg(at("there").join("upt/run.sh"))
        .arg(at("out"))
        .arg("--rehearse")
        .env("PYTHON", "no-such-python"));
    let text = std::fs::read_to_string(at("out").join("rows.jsonl")).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).unwrap());
    let (rows, refused): (Vec<Value>, Vec<Value>) =
        lines.partition(|line: &Value| line["not_measured"].is_null());
    for (bundle, variant, path) in [
        ("tiny-upt", "split", "split"),
        ("tiny-upt", "whole step", "whole"),
        ("tiny-reduced", "split", "split"),
    ] {
        let row = rows
            .iter()
            .find(|row| row["bundle"] == bundle && row["variant"] == variant)
            .unwrap_or_else(|| panic!("{bundle}, {variant}: {text}"));
        assert_eq!(row["step_path"], path);
        assert_eq!(row["ran_on"], "cpu");
        let [p50, p95, p99] = ["p50_ms", "p95_ms", "p99_ms"].map(|p| row[p].as_f64().unwrap());
        assert!(0.0 < p50 && p50 <= p95 && p95 <= p99, "{row}");
        assert!(
            row["deviation_from_cpu_f32"].as_f64().unwrap() < 1e-5,
            "{row}"
        );
    }
    assert!(
        rows.iter()
            .any(|row| row["scenes"] == 2 && row["nodes"] == "surface")
    );

    // Everything that did not run has a line with its reason.
    let mut missing = std::fs::read_to_string(at("out").join("missing")).unwrap();
    for line in refused {
        let text = |key: &str| line[key].as_str().unwrap().to_owned();
        missing.push_str(&format!("{}: {}\n", text("not_measured"), text("why")));
    }
    for what in [
        "cuda",
        "tensorrt",
        "tensorrt-rtx",
        "PyTorch",
        "TLED",
        "tiny-reduced, whole step",
        "float16",
        "the paper's split",
        "trajectory",
    ] {
        let line = missing.lines().find(|line| line.contains(what));
        let line = line.unwrap_or_else(|| panic!("{what}: {missing}"));
        let why = line.split_once(": ").map(|(_, why)| why);
        assert!(why.is_some_and(|why| !why.is_empty()), "{line}");
    }
}
