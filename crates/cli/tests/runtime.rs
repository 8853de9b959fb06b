//! Which ONNX Runtime the command `upt` takes, and what it says without one.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use fixture::{copy_into, root, runtime_path, shipped};
use ort_wheel::{Platform, VERSION};

/// A copy of the command that lies in no build folder, with a cache of its own.
struct Installed {
    folder: tempfile::TempDir,
}

impl Installed {
    fn new() -> Installed {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(folder.path().join("bin")).unwrap();
        std::fs::copy(
            env!("CARGO_BIN_EXE_upt"),
            folder.path().join("bin").join("upt"),
        )
        .unwrap();
        Installed { folder }
    }

    /// Where `upt runtime` keeps the library.
    fn kept(&self) -> PathBuf {
        let cache = self.folder.path().join("cache").join("upt");
        cache.join("onnxruntime").join(VERSION)
    }

    fn run(&self, arguments: &[&str], library: &str) -> Output {
        self.run_in(&root(), arguments, library)
    }

    fn run_in(&self, folder: &Path, arguments: &[&str], library: &str) -> Output {
        let mut command = Command::new(self.folder.path().join("bin").join("upt"));
        command
            .current_dir(folder)
            .args(arguments)
            .env("ORT_DYLIB_PATH", library)
            .env("XDG_CACHE_HOME", self.folder.path().join("cache"))
            .env_remove("UPT_PYTHON");
        loop {
            match command.output() {
                // A test that runs at the same time has just started a process, which holds the copy open for writing until it runs its program.
                Err(error) if error.kind() == ErrorKind::ExecutableFileBusy => {
                    std::thread::yield_now();
                }
                started => return started.expect("upt starts"),
            }
        }
    }
}

fn host() -> Platform {
    Platform::host().expect("tests run where a wheel is known")
}

#[test]
fn a_library_that_was_fetched_is_taken_and_not_fetched_again() {
    let upt = Installed::new();
    std::fs::create_dir_all(upt.kept()).unwrap();
    let kept = upt.kept().join(host().library());
    std::fs::copy(runtime_path(), &kept).unwrap();
    std::fs::write(upt.kept().join("version.txt"), VERSION).unwrap();

    let ran = upt.run(&["doctor", "--json", "tests/fixtures/tiny-upt"], "");
    let findings: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!(
        findings["onnxruntime"]["path"],
        kept.display().to_string(),
        "{findings}"
    );

    // Nothing is downloaded: there is no Python environment in this cache.
    let ran = upt.run(&["runtime"], "");
    assert_eq!(ran.status.code(), Some(0));
    let said = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(said.trim(), kept.display().to_string());
    assert!(!upt.folder.path().join("cache/upt/python").exists());
}

/// A library of another version, or one whose download was interrupted, is not taken.
#[test]
fn half_a_library_is_not_taken() {
    let upt = Installed::new();
    std::fs::create_dir_all(upt.kept()).unwrap();
    let kept = upt.kept().join(host().library());
    std::fs::write(&kept, b"half").unwrap();
    let ran = upt.run(&["doctor", "--json", "tests/fixtures/tiny-upt"], "");
    let findings: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_ne!(
        findings["onnxruntime"]["path"],
        kept.display().to_string(),
        "{findings}"
    );
}

/// Without a terminal nobody is asked: the message says which command fetches it.
#[test]
fn without_a_library_the_command_that_fetches_it_is_named() {
    let upt = Installed::new();
    let bundle = "tests/fixtures/tiny-upt";
    if upt.run(&["doctor", bundle], "").status.success() {
        println!("not asked: this machine has an ONNX Runtime in the system's search path");
        return;
    }
    let ran = upt.run(&["view", bundle], "");
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(2), "{said}");
    assert!(said.contains("`upt runtime` fetches"), "{said}");
}

/// Who named a library is told of that library, and is not offered another.
#[test]
fn a_library_that_the_user_named_and_that_is_missing_is_told_by_its_name() {
    let upt = Installed::new();
    let library = "/nowhere/libonnxruntime.so";
    let ran = upt.run(&["view", "tests/fixtures/tiny-upt"], library);
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(2), "{said}");
    assert!(said.contains("/nowhere/libonnxruntime.so"), "{said}");
    assert!(!said.contains("upt runtime"), "{said}");
}

/// Who has only bundles of `upt make` needs no ONNX Runtime, and is told so; for a bundle with a network the way to it is named.
#[test]
fn doctor_asks_for_a_library_only_where_a_bundle_needs_it() {
    let upt = Installed::new();
    let ran = upt.run(&["doctor", "onnx/liver-coarse"], "");
    let said = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{said}");
    assert!(said.contains("ok  bundle onnx/liver-coarse"), "{said}");
    if said.contains("ok  ONNX Runtime") {
        println!("this machine has an ONNX Runtime in the system's search path");
        return;
    }
    assert!(said.contains("`upt runtime` fetches"), "{said}");
    assert!(!said.contains("BAD"), "{said}");
    let ran = upt.run(&["doctor", "tests/fixtures/tiny-upt"], "");
    let said = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(ran.status.code(), Some(1), "{said}");
    assert!(
        said.contains("BAD ONNX Runtime") && said.contains("`upt runtime`"),
        "{said}"
    );
}

/// In an archive (bin/upt, share/upt/bundles) its own bundles are looked at, from any folder.
#[test]
fn doctor_finds_the_bundles_of_its_archive() {
    let upt = Installed::new();
    let bundles = upt.folder.path().join("share/upt/bundles/liver");
    copy_into(&bundles, shipped("liver-coarse"));
    let elsewhere = tempfile::tempdir().unwrap();
    let ran = upt.run_in(elsewhere.path(), &["doctor"], "");
    let said = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{said}");
    assert!(said.contains("share/upt/bundles/liver"), "{said}");
}
