//! `upt replay`: what was recorded comes out to the bit, also with other instructions; what was changed or cut off is named.

mod recorded;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use fixture::{said, shipped};

fn upt(file: &Path, more: &[&str], isa: Option<&str>) -> Output {
    of(&shipped("liver-coarse"), file, more, isa)
}

fn of(bundle: &Path, file: &Path, more: &[&str], isa: Option<&str>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_upt"));
    command
        .arg("replay")
        .arg(file)
        .arg("--bundle")
        .arg(bundle)
        .args(more);
    if let Some(isa) = isa {
        command.env("UPT_ISA", isa);
    }
    command.output().expect("upt starts")
}

/// A ball that goes down at a place of the surface, a cut, and gravity.
fn inputs() -> String {
    let mut text = String::from(
        r#"{"upt_replay":2,"bundle":"liver-coarse","portable":true,"scene":{"step_s":0.02,"corrections":{"fixed":3}}}"#,
    );
    fixture::find_runtime();
    let model = upt::Model::open(
        Path::new("../../onnx/liver-coarse"),
        &upt::ModelOptions::default(),
    );
    let model = model.expect("the bundle opens");
    let node = model.indices(upt::IndexSet::DomainNodes)[0] as usize;
    let [x, y, z] = [0, 1, 2].map(|axis| model.mesh.positions[3 * node + axis]);
    for t in 0..6 {
        let z = z + 6.0 - t as f32;
        text += &format!(
            "\n{{\"step\":{{\"instruments\":[{{\"shape\":{{\"kind\":\"sphere\",\"radius\":6}},\"position\":[{x},{y},{z}],\"friction\":0.3}}],\"loads\":{{\"gravity\":[0,0,-1]}}}}}}"
        );
        if t == 3 {
            let at = |a: f32, n: f32| format!("[{},{},{}]", x + a, y + 9.0, z + n);
            text += &format!(
                "\n{{\"cut\":{{\"stroke\":0,\"points\":2,\"poses\":[{},{},{},{}]}}}}",
                at(-20.0, 10.0),
                at(20.0, 10.0),
                at(-20.0, -12.0),
                at(20.0, -12.0)
            );
        }
    }
    text + "\n{\"end\":7}\n"
}

/// Verifies REQ-095.
#[test]
fn a_replay_is_verified_to_the_bit_and_changes_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| -> PathBuf { folder.path().join(name) };
    std::fs::write(place("inputs"), inputs()).unwrap();
    let nothing = upt(&place("inputs"), &["--verify"], None);
    assert!(!nothing.status.success() && said(&nothing).contains("no hash to compare"));
    let exam = place("exam");
    let made = upt(&place("inputs"), &["--write", exam.to_str().unwrap()], None);
    assert!(made.status.success(), "{}", said(&made));
    for isa in [None, Some("scalar")] {
        let same = upt(&exam, &["--verify", "--threads", "2"], isa);
        assert!(same.status.success(), "{isa:?}: {}", said(&same));
        assert!(said(&same).contains("6 steps, 6 hashes, all the same"));
    }
    // Without the cut the steps before it are the same, and the one after it is not.
    let text = std::fs::read_to_string(&exam).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let changed = |name: &str, lines: &[&str]| {
        std::fs::write(place(name), lines.join("\n")).unwrap();
        let output = upt(&place(name), &["--verify"], None);
        assert!(!output.status.success(), "{name}: {}", said(&output));
        said(&output)
    };
    let without: Vec<&str> = (lines.iter().copied())
        .filter(|line| !line.starts_with("{\"cut\""))
        .map(|line| match line {
            "{\"end\":7}" => "{\"end\":6}",
            line => line,
        })
        .collect();
    let told = changed("uncut", &without);
    assert!(told.contains("step 5: differs"), "{told}");
    let told = changed("short", &lines[..5]);
    assert!(told.contains("cut off after 5 lines"), "{told}");
    let told = changed("lost", &[&lines[..3], &lines[4..]].concat());
    assert!(
        told.contains("the end counts 7 lines, there are 6"),
        "{told}"
    );
    let told = changed("no", &["a trajectory"]);
    assert!(
        told.contains("line 1 is not the first line of a replay"),
        "{told}"
    );
    let other = lines[0].replacen("\"bundle_sha256\":\"", "\"bundle_sha256\":\"00", 1);
    let told = changed("other", &[&[other.as_str()], &lines[1..]].concat());
    assert!(told.contains("recorded with another bundle"), "{told}");
    let unknown = lines[1].replacen("friction", "fricton", 1);
    let told = changed("unknown", &[lines[0], &unknown, "{\"end\":1}"]);
    assert!(
        told.contains("line 2") && told.contains("fricton"),
        "{told}"
    );
}
