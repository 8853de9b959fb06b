//! Samples cover the surface, each once, and a search finds all that are near.

use contact::{Body, Grasp, Pieces, Placed, Pose, Samples, Search, Shape, Vector};
use std::collections::HashSet;

/// A wavy sheet of `n x n` squares of `edge` mm, its diagonals alternating.
fn sheet(n: u32, edge: f32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for y in 0..=n {
        for x in 0..=n {
            let (x, y) = (x as f32 * edge, y as f32 * edge);
            positions.push([x, y, (0.3 * x).sin() + 0.7 * (0.21 * y).cos()]);
        }
    }
    let mut faces = Vec::new();
    for y in 0..n {
        for x in 0..n {
            let a = x + (n + 1) * y;
            let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
            if (x + y) % 2 == 0 {
                faces.extend([[a, b, c], [a, c, d]]);
            } else {
                faces.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    (positions, faces)
}

fn point(positions: &[[f32; 3]], node: u32) -> Vector {
    Vector::from(positions[node as usize])
}

#[test]
fn every_point_of_the_surface_has_a_sample_near_it() {
    for (edge, spacing) in [(4.5, 1.7), (2.0, 1.7), (1.0, 1.7), (4.5, 0.8)] {
        let (positions, faces) = sheet(6, edge);
        let samples = Samples::new(&positions, faces.iter().copied(), &[], spacing);
        let at: Vec<Vector> = samples
            .rows()
            .iter()
            .map(|s| s.gather(|n| point(&positions, n)))
            .collect();
        let mut worst = 0.0f32;
        for face in &faces {
            let [a, b, c] = face.map(|n| point(&positions, n));
            for i in 0..=12 {
                for j in 0..=12 - i {
                    let (u, v) = (i as f32 / 12.0, j as f32 / 12.0);
                    let p = a * (1.0 - u - v) + b * u + c * v;
                    let nearest = at
                        .iter()
                        .map(|q| (*q - p).length())
                        .fold(f32::MAX, f32::min);
                    worst = worst.max(nearest);
                }
            }
        }
        // The farthest a point of a triangle with sides of the spacing can be from its corners, and half as much again
        // where lattices of faces and edges meet.
        assert!(worst <= 0.8 * spacing, "edge {edge}: {worst} of {spacing}");
    }
}

#[test]
fn samples_are_convex_and_occur_once() {
    let (positions, faces) = sheet(5, 4.0);
    let samples = Samples::new(&positions, faces.iter().copied(), &[], 1.7);
    let mut seen = HashSet::new();
    for sample in samples.rows() {
        let sum: f32 = sample.weights.iter().sum();
        assert!((sum - 1.0).abs() < 1e-6 && sample.weights.iter().all(|w| *w >= 0.0));
        let p = sample.gather(|n| point(&positions, n));
        assert!(
            seen.insert(p.to_array().map(|v| (v * 1e3).round() as i64)),
            "{p} occurs twice"
        );
    }
    assert_eq!(samples.nodes().len(), positions.len());
    assert_eq!(samples.of_face(faces.len() - 1).end, samples.len());
    // Nodes, one point a 4 mm edge would not do: two are needed, and three rows inside.
    assert!(samples.len() > 4 * positions.len(), "{}", samples.len());
    assert_eq!(samples, Samples::new(&positions, faces, &[], 1.7));
}

#[test]
fn a_node_knows_the_faces_that_have_it() {
    let (positions, faces) = sheet(5, 3.0);
    let samples = Samples::new(&positions, faces.iter().copied(), &[], 1.7);
    for place in 0..samples.nodes().len() as u32 {
        let has_it = |face: &u32| samples.corners(*face as usize).contains(&place);
        let all: Vec<u32> = (0..faces.len() as u32).filter(has_it).collect();
        assert_eq!(samples.faces_at(place), all);
    }
}

#[test]
fn samples_of_held_nodes_alone_are_left_out() {
    let (positions, faces) = sheet(3, 4.0);
    let all: Vec<u32> = (0..positions.len() as u32).collect();
    assert!(Samples::new(&positions, faces.iter().copied(), &all, 1.7).is_empty());
    let one = Samples::new(&positions, faces.iter().copied(), &all[1..], 1.7);
    assert!(!one.is_empty());
    assert!(one.rows().iter().all(|s| s.entries().any(|(n, _)| n == 0)));
}

#[test]
fn a_search_finds_exactly_the_samples_within_the_skin_of_each_tool() {
    let (positions, faces) = sheet(8, 3.0);
    let samples = Samples::new(&positions, faces, &[], 1.7);
    let rod = Body::new(&Shape::Capsule {
        half_length: 9.0,
        radius: 2.0,
    })
    .unwrap();
    let plate = Body::new(&Shape::Spatula {
        half_extents: [4.0, 6.0, 1.5],
        radius: 1.0,
    })
    .unwrap();
    let tools = [
        Placed {
            body: &rod,
            pose: Pose::new(Vector::new(10.0, 12.0, 2.0), Vector::new(0.4, 0.2, 0.9)),
            skin: 1.0,
        },
        Placed {
            body: &plate,
            pose: Pose::new(Vector::new(14.0, 8.0, 1.0), Vector::new(0.1, -0.3, 0.2)),
            skin: 1.6,
        },
    ];
    // A displaced surface: the search must not rely on where nodes are at rest.
    let position = |n: u32| {
        let p = point(&positions, n);
        p + Vector::new(0.5 * p.y.sin(), 3.0, 0.4 * p.x.cos())
    };
    let mut search = Search::default();
    let found = search.find(&samples, &tools, position).to_vec();
    let mut expected = Vec::new();
    for (index, tool) in tools.iter().enumerate() {
        for (row, sample) in samples.rows().iter().enumerate() {
            let nearest = tool.body.nearest_at(&tool.pose, sample.gather(position));
            if nearest.distance <= tool.skin {
                expected.push((index as u32, row as u32));
            }
        }
    }
    let order: Vec<(u32, u32)> = found.iter().map(|c| (c.tool, c.sample)).collect();
    assert_eq!(order, expected);
    assert!(expected.iter().any(|(t, _)| *t == 0) && expected.iter().any(|(t, _)| *t == 1));
    assert_eq!(search.find(&samples, &tools, position), found);
}

#[test]
fn a_grasp_holds_what_is_in_reach_until_it_is_pulled_too_hard() {
    let (positions, faces) = sheet(8, 3.0);
    let samples = Samples::new(&positions, faces, &[], 1.7);
    let body = Body::new(&Shape::Sphere { radius: 3.0 }).unwrap();
    let pose = Pose::from_parts(Vector::new(12.0, 12.0, 1.8), contact::Rotation::IDENTITY);
    let position = |n: u32| point(&positions, n);
    let mut grasp = Grasp::default();
    grasp.close(&samples, &body, &pose, 0.3, position).unwrap();
    assert!(grasp.anchors().len() > 3);
    for anchor in grasp.anchors() {
        let p = samples.rows()[anchor.sample as usize].gather(position);
        assert!((pose.transform_point(anchor.place) - p).length() < 1e-5);
        assert!(body.nearest_at(&pose, p).distance <= 0.3);
        assert_eq!(grasp.place(anchor.sample), Some(anchor.place));
    }
    assert!(!grasp.tear(Vector::new(0.0, 0.0, 49.0), 50.0));
    assert!(
        !grasp.tear(Vector::new(0.0, 0.0, 1e9), 0.0),
        "0 never tears"
    );
    assert!(grasp.tear(Vector::new(0.0, 40.0, 40.0), 50.0));
    assert!(grasp.anchors().is_empty());
}

/// Walls in two elements over a square of 6 mm with a common node above it: each corner halfway up.
#[test]
fn walls_have_samples_inside_of_elements() {
    let square = [[0.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]];
    let at = |height: f32| square.map(|[x, y]| [x, y, height]);
    let positions = [&at(0.0)[..], &at(5.0), &[[3.0, 3.0, 5.0]]].concat();
    let corners: Vec<([u32; 4], [f32; 4])> = (0..4)
        .map(|at| ([at, 8, at, at], [0.5, 0.5, 0.0, 0.0]))
        .collect();
    // The first piece is a part of the border, by three nodes.
    let single = [4, 5, 6].map(|node| ([node; 4], [1.0, 0.0, 0.0, 0.0]));
    let corners = [corners, single.to_vec()].concat();
    let pieces = Pieces {
        corners: &corners,
        triangles: &[[4, 5, 6], [0, 1, 2], [0, 2, 3]],
        first_wall: 1,
    };
    let made = Samples::with_pieces(&positions, &[[4, 6, 7]], pieces, &[], 1.7);
    let samples = made.unwrap();
    assert_eq!(
        (samples.nodes(), samples.all_nodes().len()),
        (&[4, 5, 6, 7][..], 9)
    );
    assert_eq!(samples.inner_corners().len(), 4);
    let last = |face: usize| samples.of_face(face).end as u32 - 1;
    let walls = [0, 1, 2, 3].map(|face| samples.is_on_wall(last(face)));
    assert_eq!(walls, [false, false, true, true]);
    // The nodes below go up by 1: the wall by half of it, the border not at all.
    let moved = |node: u32| point(&positions, node) + Vector::Z * f32::from(u8::from(node < 4));
    for face in 0..4 {
        let height = if face < 2 { 5.0 } else { 3.0 };
        assert!(samples.of_face(face).len() > 3);
        for row in samples.of_face(face) {
            let sample = samples.at(row as u32);
            let weights: f32 = sample.weights.iter().sum();
            assert!((weights - 1.0).abs() < 1e-5 && samples.face_of(row as u32) == face);
            assert!((sample.gather(moved).z - height).abs() < 1e-5, "{sample:?}");
        }
        for row in samples.of_face(face).chain([0]) {
            let next = samples.lattice_row(face, [7, row as u32 % 50]).unwrap();
            assert_eq!(samples.face_of(next), face);
            let sample = samples.at(next);
            assert!((sample.gather(moved).z - height).abs() < 1e-5, "{sample:?}");
        }
    }
    // A ball on the wall finds it, and what is held does not count.
    let ball = Body::new(&Shape::Sphere { radius: 1.0 }).unwrap();
    let placed = Placed {
        body: &ball,
        pose: Pose::from_translation(Vector::new(3.0, 3.0, 3.2)),
        skin: 0.5,
    };
    let mut search = Search::with_room(&samples).unwrap();
    let found = search.find(&samples, &[placed], |node| point(&positions, node));
    assert!(found.len() > 1 && found.iter().all(|near| (near.point.z - 2.5).abs() < 1e-5));
    let held: Vec<u32> = (0..9).collect();
    let none = Samples::with_pieces(&positions, &[[4, 6, 7]], pieces, &held, 1.7).unwrap();
    assert!(none.is_empty());
}
