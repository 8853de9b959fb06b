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
    let turned = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 4 3\n";
    let error = obj(turned, false).unwrap_err();
    assert!(matches!(error, ImportError::Orientation { .. }), "{error}");
    let doubled = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 2 3 4\n";
    let error = obj(doubled, false).unwrap_err();
    assert!(
        matches!(error, ImportError::SurfaceEdge { faces: 3, .. }),
        "{error}"
    );
}

#[test]
fn turned_and_repeated_faces_are_repaired_on_request() {
    let whole = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let wanted = obj(whole, false).unwrap().mesh;
    for (faces, what, first) in [
        ("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 4 3\n", "turned against", 3),
        ("f 1 2 3\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", "turned against", 0),
        (&format!("{whole}f 4 2 3\n"), "repeated", 4),
        (&format!("{whole}f 2 4 3\n"), "repeated", 4),
    ] {
        let imported = obj(faces, true).unwrap();
        let [repair] = imported.repairs.as_slice() else {
            panic!("{faces}: {:?}", imported.repairs);
        };
        assert!(repair.what.contains(what), "{faces}: {repair}");
        assert_eq!((repair.count, repair.first), (1, first), "{faces}");
        assert_eq!(imported.mesh.positions, wanted.positions, "{faces}");
    }
    // Half of the faces are turned: those stay by which the volume is positive.
    let imported = obj("f 1 3 2\nf 1 2 4\nf 1 3 4\nf 2 4 3\n", true).unwrap();
    assert_eq!(imported.mesh.positions, wanted.positions);
}

#[test]
fn corners_that_differ_in_their_last_digits_are_welded() {
    // Each face has corners of its own; those of the last lie a little aside.
    let file = |aside: f64| {
        let corners = [
            [0.0, 0.0, 0.0],
            [9.0, 0.0, 0.0],
            [0.0, 9.0, 0.0],
            [0.0, 0.0, 9.0],
        ];
        let mut text = String::new();
        for (face, three) in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
            .iter()
            .enumerate()
        {
            for corner in three {
                let [x, y, z] = corners[*corner];
                let shift = if face == 3 { aside } else { 0.0 };
                text += &format!("v {} {y} {z}\n", x + shift);
            }
            let first = 3 * face + 1;
            text += &format!("f {first} {} {}\n", first + 1, first + 2);
        }
        let options = super::ImportOptions {
            resolution: Some(super::Resolution::Spacing(1.5)),
            ..super::ImportOptions::default()
        };
        super::read_text(&text, "obj", &options)
    };
    let whole = file(0.0).unwrap();
    assert!(whole.repairs.is_empty());
    let wanted = measure(&whole.mesh).volume_mm3;
    for aside in [1e-9, 1e-6, 1e-4, 5e-4] {
        let imported = file(aside).unwrap();
        let [repair] = imported.repairs.as_slice() else {
            panic!("{aside}: {:?}", imported.repairs);
        };
        assert!(repair.what.contains("welded"), "{aside}: {repair}");
        assert_eq!(repair.count, 3, "{aside}");
        let volume = measure(&imported.mesh).volume_mm3;
        assert!(
            (volume - wanted).abs() < 1e-2 * wanted,
            "{volume}, {wanted}"
        );
    }
    // A visible gap stays one.
    assert!(matches!(
        file(0.1).unwrap_err(),
        ImportError::Open { count: 6, .. }
    ));
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
