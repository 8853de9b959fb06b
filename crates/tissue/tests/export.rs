//! Exported files, read back. A reader that this project did not write opens glTF in `crates/cli/tests/export.rs`.
#![cfg(feature = "files")]

use tissue::export::{Collection, SurfaceFormat, write_surface};
use tissue::mesh::{Mesh, box_phantom};

fn body() -> (Mesh, Vec<[f32; 3]>) {
    let mesh = box_phantom([12.0, 8.0, 6.0], [3, 2, 2]).unwrap();
    let displacement = mesh
        .positions
        .iter()
        .map(|p| [0.1 * p[2], 0.0, -0.01 * p[0] * p[2]])
        .collect();
    (mesh, displacement)
}

#[test]
fn a_collection_lists_frames_with_their_times() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("all.pvd");
    let mut collection = Collection::default();
    collection.push(0.0, "frame-00000.vtu");
    collection.push(0.05, "frame-00001.vtu");
    collection.write(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("timestep=\"0.05\" part=\"0\" file=\"frame-00001.vtu\""),
        "{text}"
    );
    assert_eq!(text.matches("<DataSet").count(), 2);
}

#[test]
fn a_ply_surface_imports_again_with_its_volume() {
    let (mesh, displacement) = body();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.ply");
    write_surface(&path, SurfaceFormat::Ply, &mesh, &displacement).unwrap();
    let imported = tissue::mesh_import::import(
        &path,
        &tissue::mesh_import::ImportOptions {
            resolution: Some(tissue::mesh_import::Resolution::Spacing(0.8)),
            ..Default::default()
        },
    )
    .unwrap();
    let moved = Mesh {
        positions: (mesh.positions.iter().zip(&displacement))
            .map(|(p, u)| [0, 1, 2].map(|k| p[k] + u[k]))
            .collect(),
        ..mesh
    };
    let volume = |mesh: &Mesh| tissue::mesh_quality::measure(mesh).volume_mm3;
    let ratio = volume(&imported.mesh) / volume(&moved);
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}
