//! Import: files of Gmsh and VTK (fixtures/import/make.py), and each fault by hand.
#![cfg(feature = "files")]

mod bodies;
#[path = "../inputs/mod.rs"]
mod inputs;
mod surfaces;
mod tets;
mod thin;

use contact::Shape;
use inputs::fixture;
use std::path::Path;
use tissue::mesh::Mesh;
use tissue::mesh_import::{
    Ball, ImportError, ImportOptions, Imported, Resolution, import, tool_shape,
};
use tissue::mesh_quality::measure;

fn read(name: &str, options: &ImportOptions) -> Result<Imported, ImportError> {
    import(&fixture(name), options)
}

/// Writes `text` as a file with `extension` and imports it.
fn read_text(
    text: &str,
    extension: &str,
    options: &ImportOptions,
) -> Result<Imported, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("case.{extension}"));
    std::fs::write(&path, text).unwrap();
    import(&path, options)
}

fn repairing() -> ImportOptions {
    ImportOptions {
        repair: true,
        ..ImportOptions::default()
    }
}

fn sorted_positions(mesh: &Mesh) -> Vec<[i64; 3]> {
    let mut rows: Vec<[i64; 3]> = mesh
        .positions
        .iter()
        .map(|p| p.map(|x| (f64::from(x) * 1e4).round() as i64))
        .collect();
    rows.sort_unstable();
    rows
}

#[test]
fn a_tool_is_the_hull_of_a_surface_file() {
    for name in ["box.stl", "box.obj", "box.ply"] {
        let Shape::Hull { points, .. } = tool_shape(&fixture(name), 2.0).unwrap() else {
            panic!("a hull");
        };
        assert_eq!(points.len(), 8, "{name}: {points:?}");
    }
    let error = tool_shape(&fixture("box.vtk"), 1.0)
        .unwrap_err()
        .to_string();
    assert!(
        error.ends_with("a tool is read from .stl, .obj, .ply or .off"),
        "{error}"
    );
    assert!(matches!(
        tool_shape(&fixture("box.stl"), -1.0),
        Err(ImportError::Scale(_))
    ));
}

#[test]
fn every_file_of_the_gmsh_box_gives_the_same_body() {
    let mut reference = None;
    for name in [
        "box-22-text.msh",
        "box-22-binary.msh",
        "box-41-text.msh",
        "box-41-binary.msh",
        "box.vtk",
        "box-binary.vtk",
        "box.vtu",
        "box-text.vtu",
        "box-raw.vtu",
        "box-raw-zlib.vtu",
    ] {
        let imported =
            read(name, &ImportOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(imported.repairs.is_empty(), "{name}");
        let mesh = imported.mesh;
        assert!((measure(&mesh).volume_mm3 - 1000.0).abs() < 1e-3, "{name}");
        let found = (mesh.tets.len(), mesh.surface.len(), sorted_positions(&mesh));
        assert_eq!(*reference.get_or_insert(found.clone()), found, "{name}");
    }
}

#[test]
fn second_order_tetrahedra_are_read_by_their_corners() {
    let imported = read("box-second-order.msh", &ImportOptions::default()).unwrap();
    assert_eq!(imported.repairs.len(), 1);
    assert!(imported.repairs[0].what.contains("higher order"));
    assert_eq!(imported.repairs[0].count, imported.mesh.tets.len());
    assert!((measure(&imported.mesh).volume_mm3 - 1000.0).abs() < 1e-3);
}

#[test]
fn surfaces_are_filled_to_a_node_count() {
    for name in [
        "box.stl",
        "box-text.stl",
        "box.ply",
        "box-text.ply",
        "box.obj",
    ] {
        let options = ImportOptions {
            resolution: Some(Resolution::Nodes(800)),
            ..ImportOptions::default()
        };
        let mesh = read(name, &options)
            .unwrap_or_else(|e| panic!("{name}: {e}"))
            .mesh;
        let quality = measure(&mesh);
        assert!(
            quality.nodes.abs_diff(800) <= 60,
            "{name}: {} nodes",
            quality.nodes
        );
        // Sharp edges are cut off at the scale of the lattice.
        assert!(
            (quality.volume_mm3 / 1000.0 - 1.0).abs() < 0.05,
            "{name}: {quality:?}"
        );
        assert!(quality.min_dihedral_deg > 8.0, "{name}: {quality:?}");
        assert_eq!((quality.components, quality.euler_characteristic), (1, 2));
    }
}

#[test]
fn spacing_and_scale_are_in_millimetres() {
    let options = ImportOptions {
        resolution: Some(Resolution::Spacing(15.0)),
        scale: 10.0,
        ..ImportOptions::default()
    };
    let quality = measure(&read("box.stl", &options).unwrap().mesh);
    assert!((quality.volume_mm3 / 1e6 - 1.0).abs() < 0.1, "{quality:?}");
    assert!(quality.max_edge_mm < 30.0);
}

#[test]
fn a_surface_needs_a_resolution_and_a_known_extension() {
    let error = read("box.stl", &ImportOptions::default()).unwrap_err();
    assert!(matches!(error, ImportError::NoResolution));
    let error = read_text("", "step", &ImportOptions::default()).unwrap_err();
    assert!(error.to_string().contains(".vtu"), "{error}");
    let error = import(Path::new("missing.vtu"), &ImportOptions::default()).unwrap_err();
    assert!(matches!(error, ImportError::Io { .. }), "{error}");
}

const TETRAHEDRON_OBJ: &str = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\n";

fn obj(faces: &str, repair: bool) -> Result<Imported, ImportError> {
    let options = ImportOptions {
        resolution: Some(Resolution::Spacing(1.5)),
        repair,
        ..ImportOptions::default()
    };
    read_text(&format!("{TETRAHEDRON_OBJ}{faces}"), "obj", &options)
}

#[test]
fn damaged_gmsh_files_say_where() {
    let sound = std::fs::read_to_string(fixture("box-41-text.msh")).unwrap();
    let cases = [
        (sound.replace("4.1 0 8", "4.0 0 8"), "version 4.0"),
        (sound.replace("$EndNodes", "$EndNode"), "$EndNode"),
        (sound[..sound.len() / 2].to_string(), "ends too early"),
        (
            sound.replace("$Nodes", "$Comments\n$EndComments\n$Other"),
            "$Other has no",
        ),
    ];
    for (text, expected) in cases {
        let error = read_text(&text, "msh", &ImportOptions::default()).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn a_ball_is_four_numbers() {
    assert!("1,2,3".parse::<Ball>().is_err());
    assert!("1,2,3,-4".parse::<Ball>().is_err());
}

#[test]
fn gmsh_version_1_is_read_with_sparse_tags_and_faces_beside() {
    let text = "$NOD\n5\n1 0 0 0\n2 10 0 0\n30 0 10 0\n4 0 0 10\n5 10 10 10\n$ENDNOD\n$ELM\n3\n\
                1 2 0 1 3 1 2 30\n2 4 0 1 4 1 2 30 4\n3 4 0 1 4 2 5 30 4\n$ENDELM\n";
    let mesh = read_text(text, "msh", &repairing()).unwrap().mesh;
    assert_eq!((mesh.node_count(), mesh.tets.len()), (5, 2));
    let cut = text.replace("2 4 0 1 4 1 2 30 4", "2 4 0 1 3 1 2 30");
    let error = read_text(&cut, "msh", &repairing()).unwrap_err();
    assert!(
        error.to_string().contains("has 3 nodes, must have 4"),
        "{error}"
    );
}

/// A box of 20 mm as VTK polydata, quads; `more` follows its points and faces.
fn polydata(points: &[[f64; 3]], faces: &[&[u32]]) -> String {
    let mut text = format!(
        "# vtk DataFile Version 3.0\nbox\nASCII\nDATASET POLYDATA\nPOINTS {} float\n",
        points.len()
    );
    for [x, y, z] in points {
        text += &format!("{x} {y} {z}\n");
    }
    let size: usize = faces.iter().map(|face| face.len() + 1).sum();
    text += &format!("POLYGONS {} {size}\n", faces.len());
    for face in faces {
        text += &format!("{}", face.len());
        face.iter().for_each(|node| text += &format!(" {node}"));
        text += "\n";
    }
    text
}

fn box_points(low: f64, high: f64) -> Vec<[f64; 3]> {
    (0..8)
        .map(|c| [c & 1, (c >> 1) & 1, c >> 2].map(|bit| if bit == 1 { high } else { low }))
        .collect()
}

const BOX_FACES: [&[u32]; 6] = [
    &[0, 2, 3, 1],
    &[4, 5, 7, 6],
    &[0, 1, 5, 4],
    &[2, 6, 7, 3],
    &[0, 4, 6, 2],
    &[1, 3, 7, 5],
];

#[test]
fn vtk_polydata_is_a_closed_surface() {
    let options = ImportOptions {
        resolution: Some(Resolution::Nodes(300)),
        ..ImportOptions::default()
    };
    let text = polydata(&box_points(0.0, 20.0), &BOX_FACES);
    let mesh = read_text(&text, "vtk", &options).unwrap().mesh;
    let volume = measure(&mesh).volume_mm3;
    assert!((volume - 8000.0).abs() < 400.0, "{volume}");
    assert_eq!(measure(&mesh).domain_area_mm2.to_string(), "0");
}

#[test]
fn a_surface_that_passes_through_itself_is_named_unless_it_hardly_does() {
    let options = |repair| ImportOptions {
        resolution: Some(Resolution::Nodes(3000)),
        repair,
        ..ImportOptions::default()
    };
    // A corner is pulled through the opposite faces.
    let through = |by: f64| {
        let mut points = box_points(0.0, 20.0);
        points.push([10.0, 10.0, -by]);
        let mut faces: Vec<&[u32]> = BOX_FACES.to_vec();
        faces[1] = &[4, 5, 8];
        faces.extend([[5, 7, 8].as_slice(), &[7, 6, 8], &[6, 4, 8]]);
        polydata(&points, &faces)
    };
    for repair in [false, true] {
        let error = read_text(&through(15.0), "vtk", &options(repair)).unwrap_err();
        let ImportError::SelfCrossing { depth_mm, .. } = error else {
            panic!("{error}");
        };
        assert!((depth_mm - 15.0).abs() < 1e-6, "{depth_mm}");
    }
    let shallow = through(0.1);
    assert!(matches!(
        read_text(&shallow, "vtk", &options(false)),
        Err(ImportError::SelfCrossing { .. })
    ));
    let repairs = read_text(&shallow, "vtk", &options(true)).unwrap().repairs;
    assert!(
        repairs.iter().any(|r| r.what.contains("hardly")),
        "{repairs:?}"
    );
}
