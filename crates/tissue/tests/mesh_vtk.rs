//! VTK files as VTK 9 writes them (`fixtures/import/make_vtk.py`, which also writes all 1,080 dialects): a box of 24 ml.
#![cfg(feature = "files")]

mod inputs;

use inputs::fixture;
use tissue::mesh_import::{ImportOptions, Region, Resolution, import, read_labels, tets_in};
use tissue::mesh_quality::measure;

const GRIDS: [&str; 5] = [
    "vtk9-grid-51-text.vtk",
    "vtk9-grid-42-binary.vtk",
    "vtk9-arrays-zlib.vtu",
    "vtk9-inline-lzma.vtu",
    "vtk9-raw-lz4.vtu",
];
const SURFACES: [&str; 3] = [
    "vtk9-surface-51-binary.vtk",
    "vtk9-inline-zlib.vtp",
    "vtk9-appended-base64.vtp",
];

#[test]
fn grids_in_every_packing_are_the_box() {
    for name in GRIDS {
        let imported = import(&fixture(name), &ImportOptions::default()).unwrap();
        let quality = measure(&imported.mesh);
        assert_eq!((quality.nodes, quality.tets), (8, 6), "{name}");
        assert!((quality.volume_mm3 - 24000.0).abs() < 1e-3, "{name}");
        assert!(imported.repairs.is_empty(), "{name}");
    }
}

#[test]
fn polygons_and_strips_in_every_packing_are_the_box() {
    for name in SURFACES {
        let options = ImportOptions {
            resolution: Some(Resolution::Nodes(1500)),
            ..ImportOptions::default()
        };
        let imported = import(&fixture(name), &options).unwrap();
        let volume = measure(&imported.mesh).volume_mm3;
        assert!((volume - 24000.0).abs() < 720.0, "{name}: {volume}");
        assert!(imported.repairs.is_empty(), "{name}");
    }
}

/// Cells are a triangle, a vertex, a line and the tetrahedra, and an array counts them all.
#[test]
fn arrays_of_every_kind_are_names() {
    for name in &GRIDS[..3] {
        let path = fixture(name);
        let mesh = import(&path, &ImportOptions::default()).unwrap().mesh;
        let labels = read_labels(&path).unwrap();
        for array in [
            "material", "ids", "long ids", "mark", "real", "short", "longest", "long", "signed",
            "char",
        ] {
            let region: Region = format!("group:{array}=2").parse().unwrap();
            let rows = tets_in(&mesh, &region.open(&path, 1.0).unwrap());
            assert_eq!(rows, [0, 2, 4], "{name}: {array}");
        }
        assert!(labels.names().contains("bits=1"), "{name}");
        assert!(labels.names().contains("numbers=7"), "{name}");
        assert!(
            !labels.names().iter().any(|name| name.contains("vectors")),
            "{name}"
        );
    }
}

/// What announces more than the file can hold is refused before anything is made for it.
#[test]
fn counts_are_held_against_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let xml = |compressor: &str, points: &str| {
        format!(
            "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt32\"{compressor}><UnstructuredGrid>\
             <Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" \
             format=\"binary\">{points}</DataArray></Points></Piece></UnstructuredGrid></VTKFile>"
        )
    };
    let zlib = " compressor=\"vtkZLibDataCompressor\"";
    let legacy = |rest: &str| {
        format!("# vtk DataFile Version 3.0\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\n{rest}")
    };
    let refused = [
        (
            "blocks.vtu",
            xml(zlib, "/////wEAAAABAAAAeJxjYCANAAAAMAAB"),
            "shorter",
        ),
        (
            "size.vtu",
            xml(zlib, "AQAAAP//////////CAAAAA==eJxjYCANAAAAMAAB"),
            "far more bytes",
        ),
        (
            "block.vtu",
            xml(zlib, "AQAAAAAAEAAAAAAACAAAAA==eJxjYCANAAAA"),
            "cannot hold",
        ),
        ("plain.vtu", xml("", "////f3j4"), "far more bytes"),
        ("letters.vtu", xml("", "AAAA!AAAA"), "base64"),
        (
            "other.vtu",
            xml(" compressor=\"vtkZstd\"", ""),
            "compressor",
        ),
        ("points.vtk", legacy("POINTS 4000000000 float\n"), "cut off"),
        (
            "overflow.vtk",
            legacy("POINTS 18446744073709551615 float\n"),
            "more than a file can hold",
        ),
        ("cells.vtk", legacy("CELLS 4000000000 4\n"), "cut off"),
        ("types.vtk", legacy("CELL_TYPES 9999999999999\n"), "cut off"),
        (
            "texts.vtk",
            legacy("FIELD f 1\na 4000000000 4000000000 string\n"),
            "cut off",
        ),
    ];
    for (name, text, wanted) in refused {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let error = import(&path, &ImportOptions::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains(wanted) && error.contains(name), "{error}");
    }
}

#[test]
fn other_data_sets_and_cells_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let head = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET ";
    let cells = "UNSTRUCTURED_GRID\nPOINTS 8 float\n0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1\nCELLS 1 9\n8 0 1 2 3 4 5 6 7\n\
                 CELL_TYPES 1\n12\n";
    let refused = [
        ("hex.vtk", format!("{head}{cells}"), "12 (hexahedron)"),
        (
            "points.vtk",
            format!("{head}STRUCTURED_POINTS\n"),
            "STRUCTURED_POINTS",
        ),
        (
            "image.vti.vtu",
            "<VTKFile type=\"ImageData\"></VTKFile>".to_owned(),
            "ImageData",
        ),
        ("empty.vtu", String::new(), "# vtk DataFile"),
    ];
    for (name, text, wanted) in refused {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let error = import(&path, &ImportOptions::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains(wanted) && error.contains(name), "{error}");
    }
}

#[test]
fn quadratic_tetrahedra_are_read_by_their_corners() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("quadratic.vtk");
    let text = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 float\n0 0 0 8 0 0 0 8 0 0 0 8 4 0 0 4 4 0 0 4 0 \
                0 0 4 4 0 4 0 4 4\nCELLS 1 11\n10 0 1 2 3 4 5 6 7 8 9\nCELL_TYPES 1\n24\n";
    std::fs::write(&path, text).unwrap();
    let imported = import(&path, &ImportOptions::default()).unwrap();
    assert_eq!(
        (imported.mesh.node_count(), imported.mesh.tets.len()),
        (4, 1)
    );
    assert!(imported.repairs[0].what.contains("higher order"));
}
