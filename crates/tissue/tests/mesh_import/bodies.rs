//! Surfaces of several bodies: listed and chosen from, with their voids.

use tissue::mesh_import::{FoundBody, ImportError, ImportOptions, Imported, Resolution};
use tissue::mesh_quality::measure;

use super::read_text;

/// A cube from `low` of edge `size` as part of an OBJ, `before` points into the file.
fn cube(name: &str, low: [f64; 3], size: f64, before: usize, inward: bool) -> String {
    let mut text = format!("g {name}\n");
    for corner in 0..8 {
        let at = |k: usize| low[k] + size * f64::from(corner >> k & 1);
        text += &format!("v {} {} {}\n", at(0), at(1), at(2));
    }
    for [a, b, c, d] in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        let face = if inward { [d, c, b, a] } else { [a, b, c, d] };
        let [a, b, c, d] = face.map(|node| node + 1 + before);
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

fn filled(text: &str, part: Option<&str>, repair: bool) -> Result<Imported, ImportError> {
    let options = ImportOptions {
        resolution: Some(Resolution::Nodes(600)),
        repair,
        part: part.map(str::to_owned),
        ..ImportOptions::default()
    };
    read_text(text, "obj", &options)
}

fn listed(error: ImportError) -> Vec<FoundBody> {
    match error {
        ImportError::Bodies { bodies, .. } => bodies,
        other => panic!("{other}"),
    }
}

#[test]
fn two_bodies_are_listed_and_one_is_chosen_by_number_or_name() {
    let text = cube("lesion", [40.0; 3], 10.0, 0, false) + &cube("organ", [0.0; 3], 30.0, 8, false);
    let bodies = listed(filled(&text, None, true).unwrap_err());
    let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["lesion", "organ"]);
    assert!((bodies[0].volume_mm3 - 1000.0).abs() < 1e-6);
    assert!((bodies[1].centre[2] - 15.0).abs() < 1e-6);
    for (part, volume) in [("1", 1000.0), ("2", 27000.0), ("Organ", 27000.0)] {
        let mesh = filled(&text, Some(part), false).unwrap().mesh;
        let found = measure(&mesh).volume_mm3;
        assert!((found / volume - 1.0).abs() < 0.03, "{part}: {found}");
    }
    assert_eq!(listed(filled(&text, Some("3"), true).unwrap_err()).len(), 2);
    assert_eq!(
        listed(filled(&text, Some("liver"), true).unwrap_err()).len(),
        2
    );
    let error = filled(&text, None, true).unwrap_err().to_string();
    assert!(
        error.contains("1: `lesion`, 1.000 ml at (45.0, 45.0, 45.0) mm"),
        "{error}"
    );
}

#[test]
fn specks_alone_are_dropped_and_named() {
    let text = cube("organ", [0.0; 3], 30.0, 0, false) + &cube("dust", [40.0; 3], 2.0, 8, false);
    assert_eq!(listed(filled(&text, None, false).unwrap_err()).len(), 2);
    let made = filled(&text, None, true).unwrap();
    assert!(measure(&made.mesh).high_mm[0] < 31.0);
    assert!(
        made.notes
            .iter()
            .any(|note| note.contains("`dust`, 0.008 ml at (41.0")),
        "{:?}",
        made.notes
    );
    assert_eq!((made.repairs[0].count, made.repairs[0].first), (12, 12));
}

#[test]
fn a_surface_inside_that_faces_inward_bounds_a_void() {
    let wall = |outer_inward: bool, inner_inward: bool| {
        cube("wall", [0.0; 3], 30.0, 0, outer_inward)
            + &cube("void", [10.0; 3], 10.0, 8, inner_inward)
    };
    // Also where both are turned, or a body far away is there too.
    let far = cube("far", [60.0; 3], 12.0, 16, false);
    for (text, part) in [
        (wall(false, true), None),
        (wall(true, false), None),
        (wall(false, true) + &far, Some("1")),
    ] {
        let made = filled(&text, part, true).unwrap();
        let quality = measure(&made.mesh);
        assert!(
            (quality.volume_mm3 / 26000.0 - 1.0).abs() < 0.03,
            "{}",
            quality.volume_mm3
        );
        assert_eq!(quality.euler_characteristic, 4);
        assert!(
            made.notes
                .iter()
                .any(|note| note.contains("voids of 1.000 ml")),
            "{:?}",
            made.notes
        );
    }
    let bodies = listed(filled(&(wall(false, true) + &far), None, true).unwrap_err());
    assert!((bodies[0].volume_mm3 - 26000.0).abs() < 1e-6, "{bodies:?}");
    // One that faces outward is another body, not a repair.
    let bodies = listed(filled(&wall(false, false), None, true).unwrap_err());
    assert_eq!(bodies.len(), 2);
    // A body within a void is another body, too.
    let island = wall(false, true) + &cube("island", [13.0; 3], 4.0, 16, false);
    assert_eq!(listed(filled(&island, None, false).unwrap_err()).len(), 2);
}
