//! `upt mesh` as a user calls it.

use std::path::Path;
use std::process::Output;

use fixture::{program, root};

fn upt(arguments: &[&str]) -> Output {
    program(env!("CARGO_BIN_EXE_upt"), arguments)
        .output()
        .unwrap()
}

fn coarse() -> String {
    let path = root().join("onnx/meshes/brain-coarse.mesh.safetensors");
    path.display().to_string()
}

fn fixture(name: &str) -> String {
    let path = root().join("crates/tissue/tests/fixtures/import");
    path.join(name).display().to_string()
}

#[test]
fn info_of_the_committed_coarse_brain() {
    let output = upt(&["mesh", "info", &coarse(), "--json"]);
    assert!(output.status.success(), "{output:?}");
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(info["nodes"], 3152);
    assert_eq!(info["components"], 1);
    assert_eq!(info["euler_characteristic"], 2);
    assert_eq!(info["non_manifold_edges"].as_array().unwrap().len(), 0);
    assert!(info["min_dihedral_deg"].as_f64().unwrap() > 10.78);
    let critical = info["critical_step_s"].as_f64().unwrap();
    assert!((1.5e-4..4e-4).contains(&critical), "{critical}");
}

#[test]
fn a_stiffer_material_has_a_shorter_critical_step() {
    let step = |young: &str| {
        let output = upt(&["mesh", "info", &coarse(), "--json", "--young", young]);
        let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        info["critical_step_s"].as_f64().unwrap()
    };
    let ratio = step("3000") / step("12000");
    assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
}

#[test]
fn import_writes_a_mesh_that_info_reads() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("box.mesh.safetensors");
    let mesh = mesh.to_str().unwrap();
    let input = fixture("box-41-binary.msh");
    let output = upt(&[
        "mesh",
        "import",
        &input,
        mesh,
        "--fixed",
        "ball:0,5,2.5,6",
        "--domain",
        "ball:20,5,2.5,7",
        "--window",
        "ball:20,5,2.5,12",
    ]);
    assert!(output.status.success(), "{output:?}");
    let made = tissue::mesh::Mesh::read(mesh.as_ref()).unwrap();
    let at = |node: u32| made.positions[node as usize];
    assert!(!made.fixed.is_empty() && made.fixed.iter().all(|&n| at(n)[0] <= 6.0));
    assert!(!made.supported.is_empty() && made.supported.iter().all(|&n| at(n)[0] < 20.0));
    let touched = |&row: &u32| made.surface[row as usize].iter().any(|&n| at(n)[0] > 13.0);
    assert!(!made.domain.is_empty() && made.domain.iter().all(touched));
    let nowhere = upt(&["mesh", "import", &input, mesh, "--fixed", "ball:100,0,0,1"]);
    let said = String::from_utf8_lossy(&nowhere.stderr);
    assert!(
        said.contains("no node lies in the region of --fixed"),
        "{said}"
    );
    let info = upt(&["mesh", "info", mesh]);
    let text = String::from_utf8(info.stdout).unwrap();
    assert!(text.contains("imported from box-41-binary.msh"), "{text}");
}

#[test]
fn faults_end_with_code_2_and_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("out.mesh.safetensors");
    let mesh = mesh.to_str().unwrap();
    for (input, wanted) in [("make.py", "unknown extension"), ("box.stl", "--nodes")] {
        let output = upt(&["mesh", "import", &fixture(input), mesh]);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(input) && text.contains(wanted), "{text}");
    }
    assert!(!Path::new(mesh).exists());
}

/// A distance field of 1 mm voxels, positive inside.
fn field(path: &Path, inside: impl Fn([f64; 3]) -> f64) {
    let side = 48usize;
    let at = |k: usize| k as f64 - 23.5;
    let mut bytes = Vec::new();
    for x in 0..side {
        for y in 0..side {
            for z in 0..side {
                let value = inside([at(x), at(y), at(z)]) as f32;
                bytes.extend(value.to_le_bytes());
            }
        }
    }
    let metadata = [
        ("format", "upt-distance-field"),
        ("origin", "[-23.5,-23.5,-23.5]"),
        ("voxel", "1.0"),
    ];
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let tensor = tissue::tensors::Tensor::new(
        "distance",
        tissue::tensors::Dtype::F32,
        vec![side; 3],
        bytes,
    );
    tissue::tensors::write_file(path, &metadata.into(), &[tensor]).unwrap();
}

#[test]
fn stuff_refuses_a_lattice_that_loses_tissue() {
    let folder = tempfile::tempdir().unwrap();
    let grid = folder.path().join("grid.safetensors");
    let out = folder.path().join("out.mesh.safetensors");
    let stuff = |more: &[&str]| {
        let _ = std::fs::remove_file(&out);
        let files = [grid.to_str().unwrap(), out.to_str().unwrap()];
        upt(&[&["mesh", "stuff"], &files[..], more].concat())
    };
    let length = |p: [f64; 3]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
    // A ball of 14 mm with a plate of 3 mm around it.
    field(&grid, |p| {
        let across = (p[0] * p[0] + p[1] * p[1]).sqrt();
        let plate = (1.5 - p[2].abs()).min(21.0 - across);
        (14.0 - length(p)).max(plate)
    });
    let coarse = stuff(&["--spacing", "7"]);
    let said = String::from_utf8_lossy(&coarse.stderr).into_owned();
    assert_eq!(coarse.status.code(), Some(2), "{said}");
    assert!(
        said.contains("grid.safetensors")
            && said.contains("% of the")
            && said.contains("smaller --spacing than 7 mm"),
        "{said}"
    );
    assert!(!out.exists());
    assert!(
        stuff(&["--spacing", "7", "--least-share", "0.5"])
            .status
            .success()
    );
    let fine = stuff(&["--spacing", "1.5"]);
    assert!(fine.status.success(), "{fine:?}");
    // Half of it is held against half of the volume.
    let half = stuff(&["--spacing", "1.5", "--half-space", "1,0,0,0"]);
    assert!(half.status.success(), "{half:?}");
}
