//! Mesh files as programs write them, all of one box of 40 x 30 x 20 mm: STL, OBJ and OFF with their habits, parts and sets of Abaqus
//! and FEBio, Medit, TetGen. What is wrong in a text names its line.
#![cfg(feature = "files")]

mod surfaces;
mod volumes;

use std::path::{Path, PathBuf};

use tissue::mesh_import::{ImportOptions, Imported, Resolution, import};
use tissue::mesh_quality::measure;

const QUADS: [[usize; 4]; 6] = [
    [0, 1, 3, 2],
    [4, 6, 7, 5],
    [0, 4, 5, 1],
    [2, 3, 7, 6],
    [0, 2, 6, 4],
    [1, 5, 7, 3],
];
const TETS: [[usize; 4]; 6] = [
    [0, 4, 6, 7],
    [0, 6, 2, 7],
    [0, 2, 3, 7],
    [0, 3, 1, 7],
    [0, 1, 5, 7],
    [0, 5, 4, 7],
];

fn points() -> Vec<[f64; 3]> {
    let point = |c: usize| {
        [
            (c >> 2) as f64 * 40.0,
            (c >> 1 & 1) as f64 * 30.0,
            (c & 1) as f64 * 20.0,
        ]
    };
    (0..8).map(point).collect()
}

fn rows(line: impl Fn(usize, [f64; 3]) -> String) -> String {
    points()
        .into_iter()
        .enumerate()
        .map(|(at, p)| line(at, p))
        .collect()
}

/// Nodes counted from `first`, with a separator.
fn list(nodes: &[usize], first: usize, between: &str) -> String {
    let words: Vec<String> = nodes
        .iter()
        .map(|node| (node + first).to_string())
        .collect();
    words.join(between)
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

fn read(path: &Path) -> Imported {
    let options = ImportOptions {
        resolution: Some(Resolution::Nodes(1500)),
        ..ImportOptions::default()
    };
    import(path, &options).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(path: &Path, words: &[&str]) {
    let error = import(path, &ImportOptions::default())
        .unwrap_err()
        .to_string();
    for word in words {
        assert!(error.contains(word), "`{word}` is not in: {error}");
    }
}

/// A filled surface, or tetrahedra, of 24 ml.
fn is_the_box(name: &str, imported: &Imported) {
    let volume = measure(&imported.mesh).volume_mm3;
    assert!((volume - 24000.0).abs() < 720.0, "{name}: {volume}");
    assert!(
        imported.repairs.is_empty(),
        "{name}: {:?}",
        imported.repairs
    );
}

#[test]
fn what_is_no_place_or_no_file_is_refused_at_once() {
    let folder = Folder::new();
    let far =
        surfaces::vertices().replacen("v 40 30 20", "v 40 30 3000000000", 1) + &surfaces::faces();
    refused(
        &folder.write("far.obj", far),
        &["vertex 8 of the file (index 7)", "3000000000"],
    );
    let nan = surfaces::vertices().replacen("v 40 30 20", "v 40 nan 20", 1) + &surfaces::faces();
    refused(
        &folder.write("nan.obj", nan),
        &["vertex 8 of the file (index 7)"],
    );
    let tets = format!(
        "*NODE\n{}*ELEMENT, TYPE=C3D4\n{}",
        volumes::node_lines().replace("8, 40, 30, 20", "8, 40, 30, 2e7"),
        volumes::tet_lines()
    );
    refused(&folder.write("far.inp", tets), &["vertex 8 of the file"]);
    refused(folder.0.path(), &["unknown extension"]);
    let sub = folder.0.path().join("folder.stl");
    std::fs::create_dir(&sub).unwrap();
    refused(&sub, &["not a regular file"]);
}

#[test]
fn formats_that_are_not_read_are_named_with_how_to_convert_them() {
    let folder = Folder::new();
    let text = "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n$Entities\n";
    let mut binary = b"$MeshFormat\n4 1 8\n".to_vec();
    binary.extend(1i32.to_le_bytes());
    binary.extend(b"\n$EndMeshFormat\n");
    std::fs::write(folder.0.path().join("binary.msh"), binary).unwrap();
    let convert = ["MSH version 4", "-format msh41"];
    refused(&folder.write("text.msh", text), &convert);
    refused(&folder.0.path().join("binary.msh"), &convert);
    for (name, said) in [
        ("organ.meshb", ["binary Medit", "OUT.mesh"]),
        ("organ.nhdr", ["NRRD header beside its data", "OUT.nrrd"]),
        ("organ.mhd", ["MetaImage header beside its data", "OUT.mha"]),
    ] {
        refused(&folder.write(name, "text"), &said);
    }
}

/// Opening a pipe would wait for ever.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused() {
    let folder = Folder::new();
    for extension in [
        "stl", "obj", "ply", "off", "vtk", "vtu", "msh", "inp", "feb", "mesh", "ele",
    ] {
        let pipe = folder.0.path().join(format!("pipe.{extension}"));
        assert!(
            std::process::Command::new("mkfifo")
                .arg(&pipe)
                .status()
                .unwrap()
                .success()
        );
        if extension == "ele" {
            std::os::unix::fs::symlink(&pipe, folder.0.path().join("pipe.node")).unwrap();
        }
        refused(&pipe, &["not a regular file"]);
        let device = folder.0.path().join(format!("device.{extension}"));
        std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
        if extension == "ele" {
            std::os::unix::fs::symlink("/dev/zero", folder.0.path().join("device.node")).unwrap();
        }
        refused(&device, &["not a regular file"]);
    }
}
