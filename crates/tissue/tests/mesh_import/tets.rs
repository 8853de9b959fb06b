//! Faults of tetrahedra: named, and repaired where that was asked for.

use tissue::mesh::Mesh;
use tissue::mesh_import::{ImportError, ImportOptions, RawTets, Repair, Resolution, from_tets};
use tissue::mesh_quality::measure;

use super::read_text;

/// Two tetrahedra on one face.
fn pair() -> RawTets {
    RawTets {
        positions: vec![
            [0.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, 0.0, 3.0],
            [3.0, 3.0, 3.0],
        ],
        tets: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
    }
}

/// The error without repair, and the repairs and the mesh with it.
fn both(raw: RawTets) -> (ImportError, Vec<Repair>, Mesh) {
    let error = from_tets(raw.clone(), false, &mut Vec::new()).unwrap_err();
    let mut repairs = Vec::new();
    let mesh = from_tets(raw, true, &mut repairs).unwrap();
    (error, repairs, mesh)
}

#[test]
fn a_sound_pair_passes_untouched() {
    let mesh = from_tets(pair(), false, &mut Vec::new()).unwrap();
    assert_eq!((mesh.tets.len(), mesh.surface.len()), (2, 6));
}

#[test]
fn inverted_tets_are_named_and_turned() {
    let mut raw = pair();
    raw.tets[1].swap(0, 1);
    let (error, repairs, mesh) = both(raw);
    assert!(
        matches!(
            error,
            ImportError::Inverted {
                tet: 1,
                count: 1,
                ..
            }
        ),
        "{error}"
    );
    assert_eq!((repairs.len(), repairs[0].first), (1, 1));
    assert_eq!(mesh.tets.len(), 2);
}

#[test]
fn degenerate_tets_are_named_and_dropped() {
    let mut raw = pair();
    raw.positions.push([1.0, 1.0, 0.0]);
    raw.tets.insert(1, [0, 1, 2, 5]);
    let (error, repairs, mesh) = both(raw);
    assert!(
        matches!(error, ImportError::Degenerate { tet: 1, .. }),
        "{error}"
    );
    // The node of the dropped tetrahedron goes with it.
    assert_eq!(repairs.len(), 2);
    assert_eq!((mesh.node_count(), mesh.tets.len()), (5, 2));
}

#[test]
fn repeated_tets_are_named_and_dropped() {
    let mut raw = pair();
    raw.tets.push([1, 0, 3, 2]);
    let (error, repairs, mesh) = both(raw);
    assert!(
        matches!(
            error,
            ImportError::Duplicate {
                first: 0,
                second: 2
            }
        ),
        "{error}"
    );
    assert_eq!(repairs[0].first, 2);
    assert_eq!(mesh.tets.len(), 2);
}

#[test]
fn unreferenced_nodes_are_named_and_dropped() {
    let mut raw = pair();
    raw.positions.insert(0, [50.0; 3]);
    raw.tets.iter_mut().flatten().for_each(|node| *node += 1);
    let (error, repairs, mesh) = both(raw);
    assert!(
        matches!(error, ImportError::Unreferenced { node: 0, count: 1 }),
        "{error}"
    );
    assert_eq!(repairs.len(), 1);
    assert_eq!(mesh.positions[0], [0.0; 3]);
}

/// A second body whose corner has this edge.
fn with_another(mut raw: RawTets, edge: f64) -> RawTets {
    let first = raw.positions.len() as u32;
    for step in [
        [0.0; 3],
        [edge, 0.0, 0.0],
        [0.0, edge, 0.0],
        [0.0, 0.0, edge],
    ] {
        raw.positions.push([9.0 + step[0], step[1], step[2]]);
    }
    raw.tets.insert(0, [0, 1, 2, 3].map(|node| first + node));
    raw
}

#[test]
fn bodies_are_listed_and_only_a_speck_is_dropped() {
    let raw = with_another(pair(), 0.5);
    let (error, repairs, mesh) = both(raw);
    let ImportError::Bodies { bodies, .. } = error else {
        panic!("{error}");
    };
    let volumes: Vec<f64> = bodies.iter().map(|body| body.volume_mm3).collect();
    assert!((volumes[0] - 0.125 / 6.0).abs() < 1e-6 && (volumes[1] - 13.5).abs() < 1e-6);
    assert!((bodies[0].centre[0] - 9.125).abs() < 1e-6, "{bodies:?}");
    assert_eq!(repairs[0].count, 1);
    assert_eq!((mesh.node_count(), mesh.tets.len()), (5, 2));
    // What is no speck is a choice.
    let raw = with_another(pair(), 1.0);
    let error = from_tets(raw, true, &mut Vec::new())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("2 bodies") && error.contains("--part"),
        "{error}"
    );
    assert!(
        error.contains("1: 0.000 ml at (9.2, 0.2, 0.2) mm"),
        "{error}"
    );
}

#[test]
fn nodes_at_one_place_are_one() {
    let mut raw = pair();
    raw.positions
        .extend([[3.0, 0.0, 0.0], [-0.0, 3.0, 0.0], [0.0, 0.0, 3.0]]);
    raw.tets[1] = [5, 6, 7, 4];
    let mut repairs = Vec::new();
    let mesh = from_tets(raw, false, &mut repairs).unwrap();
    assert_eq!(
        (mesh.node_count(), mesh.tets.len(), mesh.surface.len()),
        (5, 2, 6)
    );
    assert_eq!((repairs[0].count, repairs[0].first), (3, 5));
}

#[test]
fn one_place_is_one_in_the_meshs_own_digits_and_what_is_beside_it_is_another() {
    let apart = |by: f64| {
        let mut raw = pair();
        raw.positions
            .extend([[3.0 + by, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]]);
        raw.tets[1] = [5, 6, 7, 4];
        from_tets(raw, false, &mut Vec::new()).map(|mesh| mesh.node_count())
    };
    // A mesh file holds float32: what rounds to the same place is there.
    assert_eq!(apart(1e-8).unwrap(), 5);
    // Beyond that nothing is moved.
    assert_eq!(apart(1e-3).unwrap(), 6);
}

#[test]
fn non_finite_nodes_are_named_and_dropped_with_their_tets() {
    let mut raw = pair();
    raw.positions[4][1] = f64::NAN;
    let (error, repairs, mesh) = both(raw);
    assert!(
        matches!(error, ImportError::NonFinite { node: 4 }),
        "{error}"
    );
    assert_eq!(repairs.len(), 2);
    assert_eq!((mesh.node_count(), mesh.tets.len()), (4, 1));
}

#[test]
fn a_node_out_of_range_is_never_repaired() {
    let mut raw = pair();
    raw.tets[1][3] = 7;
    let error = from_tets(raw, true, &mut Vec::new()).unwrap_err();
    assert!(
        matches!(
            error,
            ImportError::NodeOutOfRange {
                index: 1,
                node: 7,
                count: 5,
                ..
            }
        ),
        "{error}"
    );
}

/// A box of 2 x 2 x 2 cubes of 10 mm as a VTK file, with its inner node at a place.
fn box_with_inner_node(at: [f64; 3]) -> String {
    let node = |i: usize, j: usize, k: usize| (i * 3 + j) * 3 + k;
    let mut points = Vec::new();
    let mut tets = Vec::new();
    for (i, j, k) in (0..27).map(|n| (n / 9, n / 3 % 3, n % 3)) {
        points.push(match (i, j, k) {
            (1, 1, 1) => at,
            _ => [i, j, k].map(|x| 10.0 * x as f64),
        });
        if i < 2 && j < 2 && k < 2 {
            let corner = |bits: usize| node(i + (bits >> 2), j + (bits >> 1 & 1), k + (bits & 1));
            for [b, c] in [[4, 6], [6, 2], [2, 3], [3, 1], [1, 5], [5, 4]] {
                tets.push([0, b, c, 7].map(corner));
            }
        }
    }
    let mut text = format!(
        "# vtk DataFile Version 3.0\nbox\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} float\n",
        points.len()
    );
    for [x, y, z] in points {
        text += &format!("{x} {y} {z}\n");
    }
    text += &format!("CELLS {} {}\n", tets.len(), 5 * tets.len());
    for [a, b, c, d] in &tets {
        text += &format!("4 {a} {b} {c} {d}\n");
    }
    text + &format!("CELL_TYPES {}\n{}", tets.len(), "10\n".repeat(tets.len()))
}

#[test]
fn slivers_and_inverted_tets_are_cured_by_filling_the_boundary_anew() {
    let options = ImportOptions {
        refill: true,
        resolution: Some(Resolution::Nodes(400)),
        ..ImportOptions::default()
    };
    // Flat beside a side, and pulled through one.
    for at in [[0.01, 10.0, 10.0], [23.0, 10.0, 10.0]] {
        let text = box_with_inner_node(at);
        let kept = read_text(&text, "vtk", &ImportOptions::default());
        let bad = kept.map_or(0.0, |made| measure(&made.mesh).min_dihedral_deg);
        assert!(bad < 1.0, "{bad}");
        let quality = measure(&read_text(&text, "vtk", &options).unwrap().mesh);
        assert!(
            quality.min_dihedral_deg > 8.0,
            "{}",
            quality.min_dihedral_deg
        );
        assert!(
            (quality.volume_mm3 - 8000.0).abs() < 240.0,
            "{}",
            quality.volume_mm3
        );
    }
    let unsized_one = ImportOptions {
        resolution: None,
        ..options
    };
    let text = box_with_inner_node([10.0; 3]);
    assert!(matches!(
        read_text(&text, "vtk", &unsized_one),
        Err(ImportError::NoResolution)
    ));
}
