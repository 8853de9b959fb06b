//! Closed surfaces of triangles: hollows, several parts, and what has no inside.

use contact::{Body, Shape, ShapeError, Vector};

use super::points;

/// An L of two bars, 4 mm thick: closed, not convex.
fn angle() -> Shape {
    let outline = [
        [0.0, 0.0],
        [10.0, 0.0],
        [10.0, 3.0],
        [3.0, 3.0],
        [3.0, 8.0],
        [0.0, 8.0],
    ];
    let points = [-2.0, 2.0].map(|z| outline.map(|[x, y]| [x, y, z]));
    let cap = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let mut faces: Vec<[u32; 3]> = cap.map(|[a, b, c]| [a, c, b]).to_vec();
    faces.extend(cap.map(|face| face.map(|n| n + 6)));
    for a in 0..6u32 {
        let b = (a + 1) % 6;
        faces.extend([[a, b, b + 6], [a, b + 6, a + 6]]);
    }
    Shape::Mesh {
        points: points.as_flattened().to_vec(),
        faces,
        margin: 0.0,
    }
}

#[test]
fn a_surface_that_is_not_convex_keeps_its_hollow() {
    let shape = angle();
    let body = Body::new(&shape).unwrap();
    let bar = |half: [f32; 3]| Body::new(&Shape::Box { half_extents: half }).unwrap();
    let (flat, upright) = (bar([5.0, 1.5, 2.0]), bar([1.5, 4.0, 2.0]));
    for p in points(3000, 12.0) {
        let found = body.nearest(p);
        let bars = [
            flat.nearest(p - Vector::new(5.0, 1.5, 0.0)).distance,
            upright.nearest(p - Vector::new(1.5, 4.0, 0.0)).distance,
        ];
        let expected = bars[0].min(bars[1]);
        // Outside the nearer bar decides; inside the way out may lead into the other.
        if expected > 1e-3 {
            assert!(
                (found.distance - expected).abs() < 1e-3,
                "{p}: {found:?} {expected}"
            );
        } else if expected < -1e-3 {
            assert!(
                found.distance <= expected + 1e-3,
                "{p}: {found:?} {expected}"
            );
        }
    }
    // In the hollow, where its hull would be touched.
    assert!(body.nearest(Vector::new(5.0, 5.0, 0.0)).distance > 1.9);
    // Its arms are 3 mm thick, and no probe lies in the hollow, as the middle of the box around it does.
    assert!((body.size() - 1.5).abs() < 1e-3, "{}", body.size());
    assert!(body.is_broad());
    assert!(body.probes().count() > 10);
    for probe in body.probes() {
        assert!(body.nearest(probe).distance < -1e-3, "{probe}");
    }
    let Shape::Mesh { mut points, .. } = angle() else {
        panic!("a mesh");
    };
    for p in &mut points {
        p[2] *= 0.04;
    }
    let thin = Shape::Mesh {
        points,
        faces: match angle() {
            Shape::Mesh { faces, .. } => faces,
            _ => panic!("a mesh"),
        },
        margin: 0.0,
    };
    assert!(matches!(
        Body::new(&thin).unwrap_err(),
        ShapeError::Wall { .. }
    ));
    let Shape::Mesh {
        points,
        mut faces,
        margin,
    } = shape
    else {
        panic!("a mesh");
    };
    // Inside out is turned.
    faces.iter_mut().for_each(|face| face.swap(0, 1));
    let mesh = |faces: &[[u32; 3]]| {
        Body::new(&Shape::Mesh {
            points: points.clone(),
            faces: faces.to_vec(),
            margin,
        })
    };
    assert!(
        mesh(&faces)
            .unwrap()
            .nearest(Vector::new(1.0, 1.0, 0.0))
            .distance
            < 0.0
    );
    faces.pop();
    assert!(matches!(mesh(&faces).unwrap_err(), ShapeError::Open { .. }));
    let beyond = mesh(&[[0, 1, 99]]).unwrap_err();
    assert_eq!(
        beyond,
        ShapeError::Face {
            index: 0,
            count: 12
        }
    );
}

/// A box of these half sizes about a point, its faces outward or inward, behind other parts of a surface.
fn add_box(surface: &mut (Vec<[f32; 3]>, Vec<[u32; 3]>), half: [f32; 3], at: [f32; 3], out: bool) {
    let first = surface.0.len() as u32;
    for corner in 0..8 {
        surface.0.push([0, 1, 2].map(|axis| {
            let side = if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
            at[axis] + side * half[axis]
        }));
    }
    for [a, b, c, d] in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        for face in [[a, b, c], [a, c, d]] {
            let face = face.map(|n| n + first);
            let [a, b, c] = face;
            surface.1.push(if out { face } else { [a, c, b] });
        }
    }
}

#[test]
fn a_surface_of_several_parts_has_one_inside_or_is_refused() {
    let made = |parts: &[([f32; 3], [f32; 3], bool)]| {
        let mut surface = (Vec::new(), Vec::new());
        for (half, at, out) in parts {
            add_box(&mut surface, *half, *at, *out);
        }
        let (points, faces) = surface;
        Body::new(&Shape::Mesh {
            points,
            faces,
            margin: 0.0,
        })
    };
    let distance = |body: &Body, p: [f32; 3]| body.nearest(Vector::from(p)).distance;
    // Two prongs, and a shell with a hollow in it.
    let prong = [1.0, 4.0, 1.0];
    let fork = made(&[
        (prong, [-3.0, 0.0, 0.0], true),
        (prong, [3.0, 0.0, 0.0], true),
    ])
    .unwrap();
    assert!((distance(&fork, [0.0; 3]) - 2.0).abs() < 1e-3);
    assert!((distance(&fork, [3.0, 0.0, 0.0]) + 1.0).abs() < 1e-3);
    let shell = made(&[([4.0; 3], [0.0; 3], true), ([3.0; 3], [0.0; 3], false)]).unwrap();
    assert!((distance(&shell, [0.0; 3]) - 3.0).abs() < 1e-3);
    assert!((distance(&shell, [3.4, 0.1, 0.2]) + 0.4).abs() < 1e-3);
    // A shaft through a plate, of which each is closed; two boxes on each other; a part inside out, beside another and in it.
    for crossing in [
        [
            ([1.0, 6.0, 1.0], [0.0; 3], true),
            ([5.0, 1.0, 5.0], [0.0; 3], true),
        ],
        [
            ([2.0; 3], [0.0; 3], true),
            ([1.0; 3], [0.3, 3.0, 0.2], true),
        ],
    ] {
        let error = made(&crossing).unwrap_err();
        assert!(matches!(error, ShapeError::Crossing { .. }), "{error}");
    }
    for inside_out in [
        [
            ([2.0; 3], [0.0; 3], true),
            ([1.0; 3], [9.0, 0.0, 0.0], false),
        ],
        [([4.0; 3], [0.0; 3], true), ([3.0; 3], [0.0; 3], true)],
    ] {
        let error = made(&inside_out).unwrap_err();
        assert!(matches!(error, ShapeError::InsideOut { .. }), "{error}");
    }
}
