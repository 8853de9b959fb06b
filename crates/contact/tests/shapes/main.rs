//! Distances and normals of every shape, against each other and against closed forms.

mod surfaces;

use contact::{Body, Shape, ShapeError, Vector};

/// Points from a fixed generator, in a cube of half size `half`.
fn points(count: usize, half: f32) -> Vec<Vector> {
    let mut state = 1u64;
    let mut unit = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    (0..count)
        .map(|_| Vector::new(unit(), unit(), unit()) * (2.0 * half) - Vector::splat(half))
        .collect()
}

fn corners(half: [f32; 3]) -> Vec<[f32; 3]> {
    (0..8)
        .map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] }))
        .collect()
}

fn every_shape() -> Vec<Shape> {
    vec![
        Shape::Sphere { radius: 4.0 },
        Shape::Capsule {
            half_length: 5.0,
            radius: 2.0,
        },
        Shape::Box {
            half_extents: [3.0, 5.0, 1.0],
        },
        Shape::Spatula {
            half_extents: [6.0, 8.0, 1.5],
            radius: 1.0,
        },
        Shape::Hull {
            points: corners([3.0, 5.0, 2.0]),
            margin: 0.5,
        },
        Shape::Hull {
            points: vec![
                [0.0, 0.0, 0.0],
                [6.0, 0.0, 0.0],
                [0.0, 5.0, 0.0],
                [0.0, 0.0, 4.0],
            ],
            margin: 0.0,
        },
    ]
}

#[test]
fn a_step_along_the_normal_by_the_distance_ends_on_the_surface() {
    for shape in every_shape() {
        let body = Body::new(&shape).unwrap();
        for p in points(400, 10.0) {
            let nearest = body.nearest(p);
            assert!(
                (nearest.normal.length() - 1.0).abs() < 1e-4,
                "{shape:?} {p}"
            );
            // From deep inside the way out may pass another face: then it ends outside of nothing, on the surface.
            let on = p - nearest.normal * nearest.distance;
            let left = body.nearest(on).distance;
            assert!(left.abs() < 2e-3, "{shape:?} at {p}: {left} mm off");
        }
    }
}

#[test]
fn the_distance_never_changes_faster_than_the_point_moves() {
    for shape in every_shape() {
        let body = Body::new(&shape).unwrap();
        for pair in points(800, 9.0).chunks_exact(2) {
            let (a, b) = (pair[0], pair[1]);
            let change = (body.nearest(a).distance - body.nearest(b).distance).abs();
            assert!(change <= (a - b).length() + 1e-3, "{shape:?} {a} {b}");
        }
    }
}

#[test]
fn a_hull_of_a_boxs_corners_is_the_box() {
    let half = [3.0, 5.0, 2.0];
    let hull = Body::new(&Shape::Hull {
        points: corners(half),
        margin: 0.0,
    })
    .unwrap();
    let cuboid = Body::new(&Shape::Box { half_extents: half }).unwrap();
    for p in points(2000, 7.0) {
        let (a, b) = (hull.nearest(p), cuboid.nearest(p));
        assert!((a.distance - b.distance).abs() < 1e-3, "{p}: {a:?} {b:?}");
        if b.distance > 1e-2 {
            assert!(a.normal.dot(b.normal) > 0.999, "{p}: {a:?} {b:?}");
        }
    }
}

#[test]
fn a_capsule_of_no_length_is_a_sphere() {
    let sphere = Body::new(&Shape::Sphere { radius: 3.0 }).unwrap();
    let capsule = Body::new(&Shape::Capsule {
        half_length: 0.0,
        radius: 3.0,
    })
    .unwrap();
    for p in points(50, 6.0) {
        assert_eq!(sphere.nearest(p), capsule.nearest(p));
        assert!((sphere.nearest(p).distance - (p.length() - 3.0)).abs() < 1e-5);
    }
    // The centre has a direction too.
    assert_eq!(sphere.nearest(Vector::ZERO).distance, -3.0);
    assert_eq!(sphere.nearest(Vector::ZERO).normal.length(), 1.0);
}

#[test]
fn a_point_on_a_face_of_a_box_has_that_faces_normal() {
    let body = Body::new(&Shape::Box {
        half_extents: [3.0, 5.0, 1.0],
    })
    .unwrap();
    for z in [0.999_999, 1.0, 1.000_001] {
        let nearest = body.nearest(Vector::new(1.0, -2.0, z));
        assert!(nearest.normal.dot(Vector::Z) > 0.999, "{nearest:?}");
        assert!((nearest.distance - (z - 1.0)).abs() < 1e-6);
    }
}

#[test]
fn bounds_and_motion_hold_every_point() {
    let pose = contact::pose::checked([10.0, -3.0, 5.0], [0.5, 0.5, 0.5, 0.5]).unwrap();
    let turn = contact::Pose::new(Vector::new(11.0, -2.0, 5.0), Vector::new(0.3, 1.0, -0.4));
    for shape in every_shape() {
        let body = Body::new(&shape).unwrap();
        let (low, high) = body.bounds(&pose, 0.25);
        let way = body.motion(&pose, &turn);
        for p in points(2000, 10.0) {
            if body.nearest(p).distance > 0.25 {
                continue;
            }
            let world = pose.transform_point(p);
            assert!(world.cmpge(low - 1e-4).all() && world.cmple(high + 1e-4).all());
            if body.nearest(p).distance <= 0.0 {
                let moved = (turn.transform_point(p) - world).length();
                assert!(moved <= way + 1e-4, "{shape:?}: {moved} of {way}");
            }
        }
    }
}

#[test]
fn bad_shapes_are_refused_by_name() {
    let bad = |shape: Shape| Body::new(&shape).unwrap_err().to_string();
    assert!(bad(Shape::Sphere { radius: f32::NAN }).starts_with("radius is NaN"));
    assert!(
        bad(Shape::Capsule {
            half_length: -1.0,
            radius: 1.0
        })
        .starts_with("half_length is -1")
    );
    let thin = bad(Shape::Spatula {
        half_extents: [5.0, 5.0, 1.0],
        radius: 2.0,
    });
    assert!(thin.contains("corner radius 2 mm exceeds"), "{thin}");
    let flat = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
    ];
    for points in [
        flat.to_vec(),
        vec![[0.0; 3]; 5],
        vec![],
        vec![[1.0, 2.0, 3.0]],
    ] {
        let error = Body::new(&Shape::Hull {
            points,
            margin: 0.0,
        })
        .unwrap_err();
        assert!(matches!(error, ShapeError::Flat { .. }), "{error}");
    }
    let points = vec![[0.0, f32::INFINITY, 0.0]];
    let error = Body::new(&Shape::Hull {
        points,
        margin: 0.0,
    })
    .unwrap_err();
    assert_eq!(error, ShapeError::Point { index: 0 });
    assert!(contact::pose::checked([0.0; 3], [0.0; 4]).is_err());
    assert!(contact::pose::checked([0.0, f32::NAN, 0.0], [0.0, 0.0, 0.0, 1.0]).is_err());
}

#[test]
fn poses_between_start_and_end_exactly_and_turn_evenly() {
    let a = contact::pose::checked([0.0, 1.0, 2.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let (s, c) = 0.6f32.sin_cos();
    // The same rotation with the other sign: the shorter way is kept.
    let b = contact::pose::checked([4.0, 1.0, -2.0], [0.0, -s, 0.0, -c]).unwrap();
    assert_eq!(contact::pose::between(&a, &b, 0.0), a);
    assert_eq!(contact::pose::between(&a, &b, 1.0), b);
    assert!((contact::pose::angle(&a.rotation, &b.rotation) - 1.2).abs() < 1e-5);
    let quarter = contact::pose::between(&a, &b, 0.25);
    assert!((contact::pose::angle(&a.rotation, &quarter.rotation) - 0.3).abs() < 1e-5);
    assert!((quarter.translation - Vector::new(1.0, 1.0, 1.0)).length() < 1e-6);
}

#[test]
fn a_hull_with_a_point_ends_there_in_a_ball() {
    let wide = 20.0 * 17.0f32.to_radians().tan();
    let mut points = vec![[0.0, -20.0, 0.0]];
    for side in 0..16 {
        let (sin, cos) = (side as f32 * std::f32::consts::TAU / 16.0).sin_cos();
        points.extend([0.0, 20.0].map(|y| [wide * cos, y, wide * sin]));
    }
    let margin = 0.0;
    let hull = Body::new(&Shape::Hull { points, margin }).unwrap();
    let distance = |x: f32, y: f32| hull.nearest(Vector::new(x, y, 0.0)).distance;
    // The point, a millimetre before it, the end and a side of the shaft.
    assert!(distance(0.0, -20.0).abs() < 1e-3);
    assert!((distance(0.0, -21.0) - 1.0).abs() < 1e-3);
    let (end, side) = (distance(0.0, 20.0), distance(wide, 10.0));
    assert!(end.abs() < 0.4 && side.abs() < 0.4, "{end} {side}");
    // Where the point as it was is 0.3 mm wide, it is that of a ball.
    assert!((distance(0.0, -19.0) + 1.0).abs() < 1e-3);
    assert!(hull.pierces() && !hull.is_broad() && hull.finest() == 1.0);
}

#[test]
fn a_march_that_leads_nowhere_ends() {
    let ball = Body::new(&Shape::Sphere { radius: 2.0 }).unwrap();
    let way = |x: f32, limit: f32| {
        let from = Vector::new(x, 0.0, 0.0);
        ball.way_through(&contact::Pose::IDENTITY, from, Vector::X, limit)
    };
    let through = way(-5.0, f32::INFINITY).unwrap();
    assert!((through - 7.0).abs() < 1e-2, "{through}");
    // From a state that is not finite, along the ball's side, and from where a step of f32 is longer than the ball.
    assert_eq!(way(f32::NAN, f32::INFINITY), None);
    assert_eq!(way(3.0, f32::INFINITY), None);
    assert_eq!(way(1e9, f32::INFINITY), None);
}
