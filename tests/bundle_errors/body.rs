//! A bundle that shares its body with others: files that it lacks lie in the folder beside it that `body` names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::open;
use fixture::{self, copy_of, find_runtime};
use upt::{Model, ModelOptions};

/// What networks of one body have in common.
const SHARED: [&str; 2] = ["mesh.safetensors", "prior.safetensors"];

/// `net/` without the files of the body, and `tissue/` with them.
fn apart(body: &str) -> (tempfile::TempDir, PathBuf) {
    find_runtime();
    let folder = tempfile::tempdir().unwrap();
    let (net, tissue) = (folder.path().join("net"), folder.path().join("tissue"));
    std::fs::rename(copy_of("tiny-upt-prior").keep(), &net).unwrap();
    std::fs::create_dir(&tissue).unwrap();
    for file in SHARED {
        std::fs::rename(net.join(file), tissue.join(file)).unwrap();
    }
    let mut manifest = fixture::manifest(&net);
    manifest["body"] = body.into();
    fixture::write_manifest(&net, &mut manifest);
    (folder, net)
}

fn refused(net: &Path, status: i32, words: &[&str]) {
    let error = open(net).unwrap_err();
    let text = error.to_string();
    assert_eq!(error.status(), status, "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` in: {text}");
    }
}

/// Verifies REQ-003.
#[test]
fn a_bundle_takes_what_it_lacks_from_its_body() {
    let (folder, net) = apart("tissue");
    let options = ModelOptions::default();
    let shared = Model::open(&net, &options).unwrap();
    let whole = Model::open(&fixture::path("tiny-upt-prior"), &options).unwrap();
    assert_eq!(shared.mesh.sha256, whole.mesh.sha256);
    let steps = |model| fixture::rollout(&fixture::scene(&model, &fixture::plain()), 8);
    assert_eq!(steps(shared), steps(whole));

    // All files together are the same bundle, in a folder and in memory.
    let mut files = BTreeMap::new();
    for place in [&net, &folder.path().join("tissue")] {
        for entry in std::fs::read_dir(place).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            files.insert(name, std::fs::read(entry.path()).unwrap());
        }
    }
    Model::open_memory(files.clone(), &options).unwrap();
    for file in SHARED {
        std::fs::write(net.join(file), &files[file]).unwrap();
    }
    std::fs::remove_dir_all(folder.path().join("tissue")).unwrap();
    open(&net).unwrap();
    files.remove(SHARED[0]);
    let error = Model::open_memory(files, &options).err().unwrap();
    assert_eq!(error.status(), -30);
    let text = error.to_string();
    assert!(
        text.contains(SHARED[0]) && text.contains("`body`"),
        "{text}"
    );
}

/// Verifies REQ-001.
#[test]
fn a_body_that_is_missing_or_another_is_named() {
    let (folder, net) = apart("tissue");
    let tissue = folder.path().join("tissue");
    let mesh = tissue.join("mesh.safetensors");
    let own = std::fs::read(&mesh).unwrap();
    let mut other = own.clone();
    *other.last_mut().unwrap() ^= 1;
    std::fs::write(&mesh, &other).unwrap();
    refused(
        &net,
        -31,
        &["tissue", "SHA-256", "`files.mesh.safetensors.sha256`"],
    );
    std::fs::write(&mesh, &own[1..]).unwrap();
    refused(&net, -31, &["tissue", "`files.mesh.safetensors.bytes`"]);
    std::fs::remove_file(&mesh).unwrap();
    refused(&net, -30, &["mesh.safetensors", "`body`", "`tissue`"]);
    std::fs::create_dir(&mesh).unwrap();
    refused(&net, -30, &["mesh.safetensors", "not a regular file"]);
    std::fs::remove_dir_all(&tissue).unwrap();
    refused(&net, -30, &["mesh.safetensors", "`body`", "`tissue`"]);
}

/// Verifies REQ-003.
#[test]
fn a_body_lies_beside_its_bundle_and_nowhere_else() {
    for place in [
        "",
        ".",
        "..",
        "../tissue",
        "/etc",
        "a/b",
        "a\\b",
        "C:",
        "a\0",
    ] {
        let (_folder, net) = apart(place);
        refused(&net, -31, &["bundle.json", "`body`"]);
    }
}
