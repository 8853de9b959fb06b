//! Every damage of a bundle is an error that names file and field, never a crash.

mod body;
mod manifest;
mod ragged;

use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use fixture::{BUNDLES, copy_of, find_runtime};
use upt::{Error, Model, ModelOptions};

fn open(path: &Path) -> Result<(), Error> {
    Model::open(path, &ModelOptions::default()).map(|_| ())
}

/// Opens a copy whose manifest was changed.
fn with_manifest(name: &str, change: impl Fn(&mut serde_json::Value)) -> Error {
    find_runtime();
    let folder = copy_of(name);
    let mut manifest = fixture::manifest(folder.path());
    change(&mut manifest);
    fixture::write_manifest(folder.path(), &mut manifest);
    open(folder.path()).unwrap_err()
}

/// Opens a copy in which a file was changed and its hash in the manifest renewed.
fn with_file(name: &str, file: &str, change: impl Fn(&mut Vec<u8>)) -> Result<(), Error> {
    find_runtime();
    let folder = copy_of(name);
    let mut bytes = std::fs::read(folder.path().join(file)).unwrap();
    change(&mut bytes);
    std::fs::write(folder.path().join(file), &bytes).unwrap();
    fixture::renew_hash(folder.path(), file, &bytes);
    open(folder.path())
}

/// Verifies REQ-001.
#[test]
fn missing_short_and_altered_files_are_named() {
    find_runtime();
    assert_eq!(open(Path::new("no/such/bundle")).unwrap_err().status(), -30);
    for bundle in BUNDLES {
        for file in ["latent.onnx", "mesh.safetensors"] {
            let folder = copy_of(bundle);
            let path = folder.path().join(file);
            let bytes = std::fs::read(&path).unwrap();
            std::fs::remove_file(&path).unwrap();
            let error = open(folder.path()).unwrap_err();
            assert_eq!(error.status(), -30);
            assert!(error.to_string().contains(file));
            std::fs::write(&path, &bytes[1..]).unwrap();
            let error = open(folder.path()).unwrap_err();
            assert_eq!(error.status(), -31);
            let mut altered = bytes.clone();
            altered[bytes.len() / 2] ^= 1;
            std::fs::write(&path, altered).unwrap();
            let error = open(folder.path()).unwrap_err();
            assert!(error.to_string().contains("SHA-256"), "{error}");
        }
    }
}

#[test]
fn files_in_memory_are_a_bundle_too() {
    let folder = fixture::shipped("liver-coarse");
    let files = || -> BTreeMap<String, Vec<u8>> {
        let entries = std::fs::read_dir(&folder).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        let read = |path: PathBuf| {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, std::fs::read(path).unwrap())
        };
        paths.map(read).collect()
    };
    let options = ModelOptions::default();
    let inside = Model::open_memory(files(), &options).unwrap();
    let outside = Model::open(&folder, &options).unwrap();
    assert_eq!(inside.hash, outside.hash);
    // The corrections' tables are read later.
    upt::Scene::new(inside, &upt::SceneOptions::default()).unwrap();
    for (status, damage) in [
        (-30, "is not among the files that were given"),
        (
            -31,
            "bundle.json field `files.prior.safetensors.bytes` says",
        ),
    ] {
        let mut files = files();
        match status {
            -30 => drop(files.remove("prior.safetensors")),
            _ => files.get_mut("prior.safetensors").unwrap().truncate(99),
        }
        let error = Model::open_memory(files, &options).err().unwrap();
        assert_eq!(error.status(), status);
        assert!(error.to_string().contains(damage), "{error}");
    }
}

#[test]
fn graphs_and_tensors_that_do_not_fit_are_refused() {
    for (bundle, file) in [
        ("tiny-reduced", "latent.onnx"),
        ("tiny-upt", "latent.onnx"),
        ("tiny-upt", "embed.onnx"),
    ] {
        let error = with_file(bundle, file, |bytes| bytes.truncate(40)).unwrap_err();
        assert!(matches!(error.status(), -31 | -21), "{error}");
        assert!(!error.to_string().is_empty());
    }
    // A graph of another model: names and shapes are checked.
    let other = std::fs::read(fixture::path("tiny-upt/latent.onnx")).unwrap();
    let error = with_file("tiny-reduced", "latent.onnx", |bytes| {
        bytes.clone_from(&other)
    })
    .unwrap_err();
    assert_eq!(error.status(), -31);
    assert!(error.to_string().contains("state"), "{error}");
    for (bundle, file) in [
        ("tiny-reduced", "prior.safetensors"),
        ("tiny-upt", "weights.safetensors"),
        ("tiny-upt", "mesh.safetensors"),
        ("tiny-upt-prior", "vibration.safetensors"),
        ("tiny-upt-prior", "anchors.safetensors"),
    ] {
        let error = with_file(bundle, file, |bytes| {
            let at = bytes.len() - 4;
            bytes[at..].copy_from_slice(&f32::NAN.to_le_bytes());
        })
        .unwrap_err();
        assert_eq!(error.status(), -31, "{file}: {error}");
    }
    // `weights [K,n]` is the file's first tensor: those of node 0 no longer add up to one.
    let error = with_file("tiny-upt-prior", "anchors.safetensors", |bytes| {
        let header = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        bytes[8 + header..][..4].copy_from_slice(&7.0f32.to_le_bytes());
    })
    .unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("anchors.safetensors") && text.contains("node 0"),
        "{text}"
    );
}

/// Verifies REQ-004.
#[test]
fn what_a_bundle_needs_of_a_newer_library_is_refused() {
    type Change = fn(&mut serde_json::Value);
    let changes: [(&str, Change); 4] = [
        ("gravity", |m| m["gravity"] = serde_json::json!(9.81)),
        ("upt.graph.shape", |m| {
            m["upt"]["graph"]["shape"] = "ball".into()
        }),
        ("files.mesh.safetensors.codec", |m| {
            m["files"]["mesh.safetensors"]["codec"] = "zstd".into()
        }),
        ("requires: plasticity", |m| {
            m["requires"] = serde_json::json!(["plasticity"])
        }),
    ];
    for (name, change) in changes {
        let error = with_manifest("tiny-upt", change);
        assert_eq!(error.status(), -32, "{error}");
        let text = error.to_string();
        assert!(
            text.contains("needs a newer libupt") && text.contains(name),
            "{text}"
        );
    }
}

/// Bit by bit, every byte of a manifest: none is taken for the one that was exported.
/// Verifies REQ-002.
#[test]
fn every_flip_of_a_manifest_is_refused() {
    find_runtime();
    for bundle in BUNDLES {
        let folder = copy_of(bundle);
        let path = folder.path().join("bundle.json");
        let good = std::fs::read(&path).unwrap();
        let mut file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
        // In place: a file that is written anew each time is flushed to the disk each time.
        let mut put = |at: usize, byte: u8| {
            file.seek(SeekFrom::Start(at as u64)).unwrap();
            file.write_all(&[byte]).unwrap();
        };
        for (at, &byte) in good.iter().enumerate() {
            put(at, byte ^ 1 << (at % 8));
            let error = open(folder.path()).unwrap_err();
            assert!(
                matches!(error.status(), -32..=-30),
                "{bundle}: byte {at}: {error}"
            );
            put(at, byte);
        }
        open(folder.path()).unwrap();
    }
}

/// Bundles that were made before there was a digest are taken.
#[test]
fn a_manifest_without_a_digest_is_taken() {
    find_runtime();
    let folder = copy_of("tiny-upt");
    let mut manifest = fixture::manifest(folder.path());
    let fields = manifest.as_object_mut().unwrap();
    assert!(fields.remove("manifest_sha256").is_some());
    std::fs::write(folder.path().join("bundle.json"), manifest.to_string()).unwrap();
    open(folder.path()).unwrap();
}

/// Verifies REQ-003.
#[cfg(unix)]
#[test]
fn only_regular_files_are_opened() {
    find_runtime();
    for file in ["bundle.json", "mesh.safetensors"] {
        let folder = copy_of("tiny-upt");
        let path = folder.path().join(file);
        std::fs::remove_file(&path).unwrap();
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        let error = open(folder.path()).unwrap_err();
        assert_eq!(error.status(), -30, "{error}");
        assert!(error.to_string().contains("not a regular file"), "{error}");
    }
    let model = fixture::model("tiny-upt");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipe.mesh.safetensors");
    let made = std::process::Command::new("mkfifo").arg(&path).status();
    assert!(made.unwrap().success());
    let options = upt::SceneOptions {
        mesh_path: Some(path),
        ..upt::SceneOptions::default()
    };
    let error = upt::Scene::new(model, &options).err().unwrap();
    assert_eq!(error.status(), -30, "{error}");
}
