//! Faults of closed surfaces: named, and repaired where that was asked for.

use tissue::mesh_import::ImportError;
use tissue::mesh_quality::measure;

use super::obj;

#[test]
fn open_and_turned_surfaces_name_the_place() {
    let error = obj("f 1 3 2\nf 1 2 4\nf 1 4 3\n", true).unwrap_err();
    assert!(
        matches!(error, ImportError::Open { count: 3, .. }),
        "{error}"
    );
    let error = obj("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 4 3\n", true).unwrap_err();
    assert!(matches!(error, ImportError::Orientation { .. }), "{error}");
    let doubled = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 2 3 4\n";
    let error = obj(doubled, true).unwrap_err();
    assert!(
        matches!(error, ImportError::SurfaceEdge { faces: 3, .. }),
        "{error}"
    );
}

#[test]
fn an_inside_out_surface_is_turned_on_request() {
    let faces = "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
    assert!(matches!(
        obj(faces, false).unwrap_err(),
        ImportError::InsideOut { .. }
    ));
    let imported = obj(faces, true).unwrap();
    assert_eq!(imported.repairs[0].count, 4);
    assert!(measure(&imported.mesh).volume_mm3 > 90.0);
}

#[test]
fn smaller_parts_of_a_surface_are_dropped_on_request() {
    let second = "v 20 0 0\nv 22 0 0\nv 20 2 0\nv 20 0 2\n";
    let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 5 7 6\nf 5 6 8\nf 5 8 7\nf 6 7 8\n";
    let both = format!("{second}{faces}");
    let error = obj(&both, false).unwrap_err();
    assert!(
        matches!(error, ImportError::SurfaceParts { count: 2, face: 4 }),
        "{error}"
    );
    let imported = obj(&both, true).unwrap();
    assert!(measure(&imported.mesh).high_mm[0] < 10.0);
}
