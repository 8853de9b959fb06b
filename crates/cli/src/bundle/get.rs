//! A bundle, fetched: its manifest, then the files that this lists, beside it or with its body, each checked against its hash. All of them lie in one
//! folder in the end, which is the same bundle.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use sha2::{Digest, Sha256};

use super::source::Source;

/// A manifest is a page of text.
const LARGEST_MANIFEST: u64 = 1 << 20;

const MANIFEST: &str = "bundle.json";

/// What is needed of `bundle.json`.
#[derive(Deserialize)]
struct Manifest {
    body: Option<String>,
    files: BTreeMap<String, Listed>,
}

#[derive(Deserialize)]
struct Listed {
    bytes: u64,
    sha256: String,
}

/// Fetches the bundle into `out/NAME`, unless it is there whole, and gives that folder.
///
/// # Errors
/// A name or hash that is none; a file that is missing or is not what its hash says: names it. Nothing is left in `out` then.
pub(super) fn bundle(source: &Source, name: &str, sha256: &str, out: &Path) -> Result<PathBuf> {
    ensure!(is_plain(name), "{name:?} is no plain name of a bundle");
    ensure!(
        sha256.len() == 64 && sha256.bytes().all(|digit| digit.is_ascii_hexdigit()),
        "sha256 must have 64 hexadecimal digits"
    );
    let folder = out.join(name);
    if is_whole(&folder, sha256) {
        return Ok(folder);
    }
    ensure!(
        !folder.exists(),
        "{} is there and is not the bundle with sha256 {sha256}: move it away, or give another --out",
        folder.display()
    );
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let scratch = out.join(format!(".{name}.{}", std::process::id()));
    let made = fill(source, name, sha256, &scratch).and_then(|()| {
        std::fs::rename(&scratch, &folder).with_context(|| folder.display().to_string())
    });
    if made.is_err() {
        std::fs::remove_dir_all(&scratch).ok();
    }
    made.map(|()| folder)
}

fn fill(source: &Source, name: &str, sha256: &str, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let put = |file: &str, bytes: &[u8]| {
        let path = folder.join(file);
        std::fs::write(&path, bytes).with_context(|| path.display().to_string())
    };
    let text = source.read(name, MANIFEST, LARGEST_MANIFEST)?;
    check(&text, sha256, &format!("{name}/{MANIFEST}"))?;
    let manifest: Manifest =
        serde_json::from_slice(&text).with_context(|| format!("{name}/{MANIFEST}"))?;
    put(MANIFEST, &text)?;
    let body = manifest.body.as_deref();
    let mut names = manifest.files.keys().map(String::as_str).chain(body);
    if let Some(bad) = names.find(|name| !is_plain(name)) {
        anyhow::bail!("{name}/{MANIFEST}: files or body: {bad:?} is no plain name");
    }
    for (file, listed) in &manifest.files {
        let own = source.read(name, file, listed.bytes);
        let bytes = match (own, body) {
            (Err(error), Some(body)) => {
                source.read(body, file, listed.bytes).with_context(|| {
                    format!("it lies neither with the bundle ({error:#}) nor with its body")
                })?
            }
            (own, _) => own?,
        };
        check(&bytes, &listed.sha256, &format!("{name}/{file}"))?;
        put(file, &bytes)?;
    }
    Ok(())
}

fn check(bytes: &[u8], sha256: &str, what: &str) -> Result<()> {
    let found = format!("{:x}", Sha256::digest(bytes));
    ensure!(
        found == sha256,
        "{what}: sha256 is {found}, must be {sha256}: the file is damaged, or of another version"
    );
    Ok(())
}

/// Whether the folder has this manifest and all that it lists.
fn is_whole(folder: &Path, sha256: &str) -> bool {
    let right = |file: &str, sha256: &str| {
        std::fs::read(folder.join(file))
            .ok()
            .filter(|bytes| check(bytes, sha256, file).is_ok())
    };
    let Some(text) = right(MANIFEST, sha256) else {
        return false;
    };
    let manifest = serde_json::from_slice::<Manifest>(&text);
    manifest.is_ok_and(|manifest| {
        let mut files = manifest.files.iter();
        files.all(|(file, listed)| is_plain(file) && right(file, &listed.sha256).is_some())
    })
}

/// Letters, digits, `_`, `-` and `.`, and no hidden file: nothing that leads out of a folder.
fn is_plain(name: &str) -> bool {
    let known = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte);
    !name.is_empty() && !name.starts_with('.') && name.bytes().all(known)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sha256(bytes: &[u8]) -> String {
        format!("{:x}", Sha256::digest(bytes))
    }

    /// `tiny` with two files, one of them with the body `flesh`; the manifest's hash.
    fn mirror(root: &Path) -> String {
        let manifest = serde_json::json!({"body": "flesh", "files": {
            "mesh": {"bytes": 4, "sha256": sha256(b"mesh")},
            "net": {"bytes": 3, "sha256": sha256(b"net")},
        }});
        for (file, bytes) in [
            ("tiny/bundle.json", manifest.to_string().as_bytes()),
            ("tiny/net", b"net"),
            ("flesh/mesh", b"mesh"),
        ] {
            let path = root.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
        sha256(manifest.to_string().as_bytes())
    }

    #[test]
    fn a_bundle_is_fetched_whole_and_once() {
        let room = tempfile::tempdir().unwrap();
        let wanted = mirror(room.path());
        let (source, out) = (Source::Folder(room.path().into()), room.path().join("out"));
        let folder = bundle(&source, "tiny", &wanted, &out).unwrap();
        assert_eq!(std::fs::read(folder.join("mesh")).unwrap(), b"mesh");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
        // Nothing is read again, and another bundle does not take its place.
        std::fs::remove_dir_all(room.path().join("flesh")).unwrap();
        assert_eq!(bundle(&source, "tiny", &wanted, &out).unwrap(), folder);
        std::fs::write(folder.join("net"), b"nut").unwrap();
        let error = bundle(&source, "tiny", &wanted, &out).unwrap_err();
        assert!(error.to_string().contains("move it away"), "{error}");
    }

    #[test]
    fn what_is_not_right_is_named_and_leaves_nothing() {
        let room = tempfile::tempdir().unwrap();
        let wanted = mirror(room.path());
        let (source, out) = (Source::Folder(room.path().into()), room.path().join("out"));
        let refused = |wanted: &str, says: &str| {
            let error = format!("{:#}", bundle(&source, "tiny", wanted, &out).unwrap_err());
            assert!(error.contains(says), "{error}");
            let left = std::fs::read_dir(&out).map_or(0, |entries| entries.count());
            assert_eq!(left, 0, "{error}");
        };
        refused(&"0".repeat(64), "tiny/bundle.json: sha256 is");
        refused("5f", "64 hexadecimal digits");
        let mesh = room.path().join("flesh/mesh");
        std::fs::write(&mesh, b"mush").unwrap();
        refused(&wanted, "tiny/mesh: sha256 is");
        std::fs::write(&mesh, b"meshes").unwrap();
        refused(&wanted, "larger than the 4 bytes");
        std::fs::remove_file(&mesh).unwrap();
        refused(&wanted, "nor with its body");
        let manifest = r#"{"files": {"../../escaped": {"bytes": 1, "sha256": ""}}}"#;
        std::fs::write(room.path().join("tiny/bundle.json"), manifest).unwrap();
        refused(&sha256(manifest.as_bytes()), "no plain name");
        assert!(bundle(&source, "../tiny", &wanted, &out).is_err());
    }
}
