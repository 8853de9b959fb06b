//! Damaged mesh files: an error or a mesh, never a panic, and never much more memory or work than a file of its size needs.
//!
//! Each format's seeds (`seeds`) are changed at random and read, with repair and with their names. 500 files a format, and 10,000
//! with `UPT_NIGHTLY=1`; `UPT_FUZZ_SEED` is the first file's seed. Files of
//! megabytes (`large`) are read as they are. Work is counted in allocations and allocated bytes (`counting`).
#![cfg(feature = "files")]

mod counting;
mod damage;
mod large;
mod seeds;

use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use counting::Use;
use tissue::mesh_import::{ImportError, ImportOptions, import, read_labels};

fn number(variable: &str) -> u64 {
    let text = std::env::var(variable).unwrap_or_default();
    text.parse().unwrap_or(0)
}

/// Reads a file as `upt make` does, but for the filling; whether it becomes a body.
fn read(path: &Path) -> bool {
    let options = ImportOptions {
        repair: true,
        ..ImportOptions::default()
    };
    let is_body = match import(path, &options) {
        // All but the filling of a surface is through.
        Ok(_) | Err(ImportError::NoResolution) => true,
        Err(error) => {
            let text = error.to_string();
            // What is wrong with the file itself is one line; bodies to choose from are listed.
            let is_line = !text.contains('\n') && text.len() < 2000;
            assert!(is_line || !error.names_file(), "{text}");
            false
        }
    };
    if let Ok(labels) = read_labels(path) {
        for name in labels.names().into_iter().take(3) {
            let _ = labels.group(name, path, 1.0);
        }
    }
    is_body
}

/// Verifies REQ-090.
#[test]
fn damaged_files_are_refused_or_read_within_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let seeds = seeds::all();
    let first = number("UPT_FUZZ_SEED");
    let rounds = if number("UPT_NIGHTLY") > 0 {
        10_000
    } else {
        500
    };
    let (mut files, mut bodies) = (0, 0);
    let mut most = Use::default();
    for (format, seed) in seeds.iter().enumerate() {
        let path = folder.path().join(&seed.name);
        for (name, bytes) in &seed.beside {
            std::fs::write(folder.path().join(name), bytes).unwrap();
        }
        for round in 0..=rounds {
            let mut bytes = seed.bytes.clone();
            // The first is whole.
            let number = (first + round) * seeds.len() as u64 + format as u64;
            if round > 0 {
                damage::damage(&mut bytes, number);
            }
            std::fs::write(&path, &bytes).unwrap();
            let (used, outcome) =
                counting::during(&format!("{} with seed {number}", seed.name), || {
                    catch_unwind(AssertUnwindSafe(|| read(&path)))
                });
            let Ok(is_body) = outcome else {
                panic!("{} with seed {number} panics", seed.name);
            };
            assert!(round > 0 || is_body, "{} is not read", seed.name);
            assert!(
                used.within(bytes.len()),
                "{} with seed {number}, {} bytes: {used:?}",
                seed.name,
                bytes.len()
            );
            most = most.or(used);
            files += 1;
            bodies += u64::from(is_body);
        }
    }
    for (name, text) in large::all() {
        let path = folder.path().join(name);
        std::fs::write(&path, &text).unwrap();
        let (used, _) = counting::during(name, || read(&path));
        assert!(used.within(text.len()), "{name}: {used:?}");
        files += 1;
    }
    // Past the test's captured output, so that a log has it also where all is well.
    let _ = writeln!(
        std::io::stderr(),
        "fuzz: {files} damaged mesh files from {} seeds, {bodies} of them read; at most {:.1} MB at once, {:.1} MB in all, {} allocations",
        seeds.len(),
        most.peak as f64 * 1e-6,
        most.bytes as f64 * 1e-6,
        most.allocations
    );
}
