//! Exported files, read back by readers that this project did not write.
#![cfg(feature = "files")]

use tissue::export::{Cells, Collection, SurfaceFormat, write_frame, write_surface};
use tissue::mesh::{Mesh, box_phantom};
use vtkio::model::{Attribute, DataSet, VertexNumbers};

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
fn a_frame_reads_back_as_vtk_sees_it() {
    let (mesh, displacement) = body();
    let contact: Vec<u8> = (0..mesh.node_count())
        .map(|node| (node % 3 == 0) as u8)
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.vtu");
    for cells in [Cells::Tets(&mesh.tets), Cells::Triangles(&mesh.surface)] {
        write_frame(&path, &mesh.positions, cells, &displacement, &contact).unwrap();
        let DataSet::UnstructuredGrid { pieces, .. } = vtkio::Vtk::import(&path).unwrap().data
        else {
            panic!("not an unstructured grid");
        };
        let piece = pieces[0].load_piece_data(None).unwrap();
        let points: Vec<f32> = piece.points.into_vec().unwrap();
        assert_eq!(points, mesh.positions.as_flattened());
        let nodes: Vec<u64> = match cells {
            Cells::Tets(cells) => cells.as_flattened().iter().map(|&n| n.into()).collect(),
            Cells::Triangles(cells) => cells.as_flattened().iter().map(|&n| n.into()).collect(),
        };
        let VertexNumbers::XML {
            connectivity,
            offsets,
        } = piece.cells.cell_verts
        else {
            panic!("not XML cells");
        };
        assert_eq!(connectivity, nodes);
        assert_eq!(offsets.last(), Some(&(nodes.len() as u64)));
        let array = |name: &str| {
            piece
                .data
                .point
                .iter()
                .find_map(|attribute| match attribute {
                    Attribute::DataArray(array) if array.name == name => Some(array.data.clone()),
                    _ => None,
                })
                .unwrap_or_else(|| panic!("no array {name}"))
        };
        let found: Vec<f32> = array("displacement").into_vec().unwrap();
        assert_eq!(found, displacement.as_flattened());
        assert_eq!(array("contact").into_vec::<u8>().unwrap(), contact);
    }
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
