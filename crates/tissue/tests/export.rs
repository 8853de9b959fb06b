//! Exported files, read back by readers that this project did not write.
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

#[test]
fn a_gltf_surface_is_valid_and_upright() {
    let (mesh, displacement) = body();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.gltf");
    write_surface(&path, SurfaceFormat::Gltf, &mesh, &displacement).unwrap();
    // Opening validates accessors, views and indices.
    let document = gltf::Gltf::open(&path).unwrap();
    let primitive = document
        .meshes()
        .next()
        .unwrap()
        .primitives()
        .next()
        .unwrap();
    let high = primitive.bounding_box().max;
    // 6 mm tall along z becomes 6 mm along y, less what the deformation takes.
    assert!((high[1] - 6e-3).abs() < 1e-6, "{high:?}");
    assert_eq!(primitive.indices().unwrap().count(), 3 * mesh.surface.len());
    assert_eq!(SurfaceFormat::of(&path), Some(SurfaceFormat::Gltf));
}
