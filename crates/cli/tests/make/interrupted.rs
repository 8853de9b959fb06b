//! Runs that end early: killed, or on a full disk.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::short_time::{begun, made};
use super::{HELD, command, plain, text, works};

/// Verifies REQ-092.
#[test]
fn killed_after_each_stage_it_leaves_nothing_or_a_bundle_that_works_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, out) = (folder.path().join("organ.obj"), folder.path().join("organ"));
    plain(&surface);
    let work = folder.path().join("organ.work");
    for stage in [
        "body", "columns", "modes", "tables", "coarse", "refine", "learn",
    ] {
        let record = work.join(format!("{stage}.stage.json"));
        let mut child = command(&surface, &out, &HELD)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let started = Instant::now();
        while !record.exists() && started.elapsed() < Duration::from_secs(900) {
            assert!(
                child.try_wait().unwrap().is_none() || record.exists(),
                "{stage}"
            );
            std::thread::sleep(Duration::from_millis(2));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(record.exists(), "{stage}");
        if out.exists() {
            works(&out);
        }
    }
    let output = command(&surface, &out, &HELD).output().unwrap();
    assert!(output.status.success(), "{}", text(&output));
    assert!(
        text(&output).contains("kept from an earlier run"),
        "{}",
        text(&output)
    );
    works(&out);
    let left: Vec<PathBuf> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "new" || e == "old"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// A limit on the size of files stands in for a disk that is full at some point.
#[cfg(unix)]
#[test]
fn a_full_disk_is_named_and_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, out) = (folder.path().join("organ.obj"), folder.path().join("organ"));
    plain(&surface);
    for kilobytes in [16, 200, 1500] {
        let upt = command(&surface, &out, &HELD);
        let mut shell = Command::new("bash");
        shell
            .args(["-c", "ulimit -f $0; trap '' XFSZ; exec \"$@\""])
            .arg(kilobytes.to_string())
            .arg(upt.get_program())
            .args(upt.get_args());
        let output = shell.output().unwrap();
        assert_eq!(
            output.status.code(),
            Some(2),
            "{kilobytes}: {}",
            text(&output)
        );
        let said = text(&output);
        assert!(
            said.contains("error: ")
                && (said.contains("cannot be written") || said.contains("too large")),
            "{kilobytes}: {said}"
        );
        if out.exists() {
            works(&out);
        }
    }
    // With room again it goes on: in full after a kill (above), here without time for what is optional.
    begun(&surface, &out);
    let output = made(&surface, &out, "0.001", &[]);
    assert!(output.status.success(), "{}", text(&output));
    works(&out);
}
