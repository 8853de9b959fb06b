//! `upt prior` and `upt modes`: files of a small box, and columns that an interrupted run left behind.
#![cfg(feature = "linear")]

use std::path::{Path, PathBuf};
use std::process::Output;

const BATCH: usize = 12;

fn run(arguments: &[&str]) -> Output {
    fixture::program(env!("CARGO_BIN_EXE_upt"), arguments)
        .output()
        .expect("upt starts")
}

fn prior(out: &Path) -> String {
    let batch = BATCH.to_string();
    let output = run(&[
        "prior",
        "--mesh",
        "tests/fixtures/box.mesh.safetensors",
        "--batch",
        &batch,
        "--threads",
        "1",
        "--out",
        out.to_str().unwrap(),
    ]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{text}");
    text
}

/// Where the columns begin, the bytes of one, and where they end.
fn layout(bytes: &[u8]) -> (usize, usize, usize) {
    let head = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let header: serde_json::Value = serde_json::from_slice(&bytes[8..head]).unwrap();
    let shape = &header["columns"]["shape"];
    let (rows, width) = (shape[0].as_u64().unwrap(), shape[1].as_u64().unwrap());
    (head, 4 * width as usize, head + (4 * rows * width) as usize)
}

#[test]
fn an_interrupted_run_goes_on_behind_its_last_whole_batch() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, again): (PathBuf, PathBuf) = (
        folder.path().join("whole.safetensors"),
        folder.path().join("again.safetensors"),
    );
    prior(&whole);
    let bytes = std::fs::read(&whole).unwrap();
    let (head, row, end) = layout(&bytes);
    assert!(
        (end - head) / row > 3 * BATCH,
        "the box has too few columns"
    );

    // Two batches and a half of another column: the file was cut while it was written.
    let partial = again.with_extension("partial");
    let cut = head + 2 * BATCH * row + row / 2;
    std::fs::write(&partial, &bytes[..cut]).unwrap();
    let text = prior(&again);
    assert!(text.contains("24 of"), "{text}");
    let resumed = std::fs::read(&again).unwrap();
    assert!(resumed[..end] == bytes[..end], "the columns differ");
    assert_eq!(resumed.len(), bytes.len());
    let value = |from: &[u8], at: usize| f32::from_le_bytes(from[at..at + 4].try_into().unwrap());
    let nodes = 4 * (end - head) / row / 3;
    for at in (end..bytes.len() - nodes).step_by(4) {
        let (a, b) = (value(&bytes, at), value(&resumed, at));
        assert!((a - b).abs() <= 1e-6 * a.abs().max(1e-3), "{a}, {b}");
    }
    assert!(!partial.exists());

    // What another mesh or material left there is not used.
    let mut other = bytes[..cut].to_vec();
    other[head - 12] ^= 1;
    std::fs::write(&partial, other).unwrap();
    assert!(!prior(&again).contains("24 of"));
    assert!(std::fs::read(&again).unwrap() == bytes);
}

#[test]
fn modes_are_written_with_the_body_they_belong_to() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("modes.safetensors");
    let output = run(&[
        "modes",
        "--mesh",
        "tests/fixtures/box.mesh.safetensors",
        "--count",
        "8",
        "--json",
        "--out",
        out.to_str().unwrap(),
    ]);
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let hertz = [&value["hertz"][0], &value["hertz"][1]].map(|v| v.as_f64().unwrap());
    assert!(0.0 < hertz[0] && hertz[0] < hertz[1], "{value}");
    let bytes = std::fs::read(&out).unwrap();
    let head = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let header: serde_json::Value = serde_json::from_slice(&bytes[8..head]).unwrap();
    assert_eq!(header["modes"]["shape"][0], 8);
    assert_eq!(header["__metadata__"]["poisson"], "0.49");
    let most = run(&[
        "modes",
        "--mesh",
        "tests/fixtures/box.mesh.safetensors",
        "--count",
        "9999",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(most.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&most.stderr).contains("9999 natural modes"));
    assert!(std::fs::read(&out).unwrap() == bytes);
}
