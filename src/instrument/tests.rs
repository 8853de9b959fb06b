use super::*;
use ::contact::Shape;

/// A slab of `n x n` squares of 2 mm, 20 mm thick, with only its top and bottom faces: top nodes
/// first (z = 0, outward +z), then bottom nodes (z = -20, outward -z).
fn slab(n: u32) -> (Vec<f32>, Vec<u32>) {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for z in [0.0, -20.0] {
        for y in 0..=n {
            for x in 0..=n {
                positions.extend([2.0 * x as f32, 2.0 * y as f32, z]);
            }
        }
    }
    let side = (n + 1) * (n + 1);
    for y in 0..n {
        for x in 0..n {
            let a = x + (n + 1) * y;
            let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
            faces.extend([a, b, c, a, c, d]);
            faces.extend([a, c, b, a, d, c].map(|node| node + side));
        }
    }
    (positions, faces)
}

const LEVEL: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn instrument(shape: Shape, at: [f32; 3], turn: [f32; 4], sticking: bool) -> Instrument {
    Instrument {
        tool: Tool::new(&shape, at, turn).unwrap(),
        sticking,
    }
}

fn capsule_at(at: [f32; 3], sticking: bool) -> Instrument {
    let shape = Shape::Capsule {
        half_length: 6.0,
        radius: 4.0,
    };
    instrument(shape, at, LEVEL, sticking)
}

fn capsule(z: f32, sticking: bool) -> Instrument {
    capsule_at([20.0, 20.0, z], sticking)
}

/// The state that a step gives back: contact nodes are at `c`, others spring back to rest.
fn follow(count: usize, nodes: &[u32], vectors: &[f32]) -> Vec<f32> {
    let mut u = vec![0.0; count];
    for (&node, c) in nodes.iter().zip(vectors.chunks_exact(3)) {
        u[3 * node as usize..][..3].copy_from_slice(c);
    }
    u
}

#[test]
fn touched_nodes_end_on_the_surface_and_no_other_moves() {
    let (positions, faces) = slab(20);
    let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
    let instruments = [
        capsule(2.5, false),
        instrument(
            Shape::Box {
                half_extents: [4.5, 3.0, 1.0],
            },
            [8.0, 34.0, 0.3],
            [0.0, 0.0, 0.382_683_43, 0.923_879_5],
            false,
        ),
        instrument(
            Shape::Spatula {
                half_extents: [3.0, 5.0, 1.5],
                radius: 1.0,
            },
            [33.0, 8.0, 0.5],
            [0.1736482, 0.0, 0.0, 0.9848078],
            false,
        ),
    ];
    let zero = vec![0.0; positions.len()];
    let (nodes, vectors) = contacts.find(&instruments, &zero).unwrap();
    assert!(nodes.is_sorted() && nodes.len() > 20);
    let mut each = [0; 3];
    for node in 0..positions.len() as u32 / 3 {
        let p = Vector::from(triple(&positions, node));
        let inside = instruments.iter().position(|i| i.nearest(p).distance < 0.0);
        let found = nodes.binary_search(&node);
        assert_eq!(inside.is_some(), found.is_ok(), "node {node}");
        if let (Some(by), Ok(at)) = (inside, found) {
            each[by] += 1;
            let c = Vector::from_slice(&vectors[3 * at..]);
            let left = instruments[by].nearest(p + c).distance;
            assert!(left.abs() < 1e-3, "node {node}: {left}");
            assert!(c.z < 1e-3, "pushed into the tissue: {c}");
        }
    }
    assert!(each.iter().all(|&count| count > 3), "{each:?}");
}

#[test]
fn a_held_instrument_keeps_its_contacts_and_a_leaving_one_lets_go() {
    let (positions, faces) = slab(20);
    for sticking in [false, true] {
        let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
        let mut u = vec![0.0; positions.len()];
        let mut counts = Vec::new();
        let mut lowest = Vec::new();
        for z in [4.5, 3.5, 2.5, 1.5, 1.5, 1.5, 1.9, 2.3, 3.2, 4.1, 5.0] {
            let (nodes, vectors) = contacts.find(&[capsule(z, sticking)], &u).unwrap();
            counts.push(nodes.len());
            lowest.push(vectors.iter().copied().fold(0.0, f32::min));
            // Never pulled out; nodes on the flank ride along it, within the skin.
            assert!(
                vectors.chunks_exact(3).all(|c| c[2] < SKIN_MM),
                "{vectors:?}"
            );
            u = follow(u.len(), nodes, vectors);
        }
        assert_eq!(counts[0], 0, "not there yet");
        assert!(counts[3] > counts[1] && counts[1] > 0, "{counts:?}");
        assert_eq!(counts[3], counts[5], "held: {counts:?}");
        assert!((lowest[5] + 2.5).abs() < 0.05, "{lowest:?}");
        assert!(
            counts[7] > 0 && (lowest[7] + 1.7).abs() < 0.05,
            "follows: {lowest:?}"
        );
        assert_eq!(counts[10], 0, "left: {counts:?}");
    }
}

#[test]
fn a_first_touch_pushes_along_the_motion_or_inwards_not_aside() {
    let (positions, faces) = slab(20);
    let zero = vec![0.0; positions.len()];
    let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
    let (nodes, vectors) = contacts.find(&[capsule(2.5, false)], &zero).unwrap();
    assert!(nodes.len() > 10);
    for c in vectors.chunks_exact(3) {
        assert!(c[0] == 0.0 && c[1] == 0.0 && c[2] < 0.0, "{c:?}");
    }
    // Obliquely into the tissue.
    contacts.reset();
    let moved = |x: f32, z: f32| capsule_at([20.0 + x, 20.0, z], false);
    assert!(
        contacts
            .find(&[moved(0.0, 4.5)], &zero)
            .unwrap()
            .0
            .is_empty()
    );
    let (nodes, vectors) = contacts.find(&[moved(1.0, 2.5)], &zero).unwrap();
    assert!(nodes.len() > 10);
    let oblique = vectors
        .chunks_exact(3)
        .filter(|c| (c[0] + 0.5 * c[2]).abs() < 1e-4);
    assert!(oblique.count() > 10, "{vectors:?}");
}

#[test]
fn a_fast_lift_keeps_what_it_pressed_until_rest_and_lets_go_once() {
    let (positions, faces) = slab(20);
    for sticking in [false, true] {
        let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
        let mut u = vec![0.0; positions.len()];
        let mut counts = Vec::new();
        // 2 mm a call: 40 mm/s.
        for z in [3.5, 2.5, 1.5, 3.5, 5.5, 5.5] {
            let (nodes, vectors) = contacts.find(&[capsule(z, sticking)], &u).unwrap();
            counts.push(nodes.len());
            assert!(vectors.chunks_exact(3).all(|c| c[2] <= 1e-4), "{vectors:?}");
            u = follow(u.len(), nodes, vectors);
        }
        assert!(counts[3] > 0, "lost: {counts:?}");
        assert_eq!(counts[4..], [0, 0], "found again: {counts:?}");
    }
}

#[test]
fn a_sticking_instrument_that_slides_off_lets_go_above_the_rest_surface() {
    let (positions, faces) = slab(20);
    let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
    let mut u = vec![0.0; positions.len()];
    // Pressed 2 mm, dragged 6 mm, lifted to 0.5 mm above the tissue.
    for (x, z) in [
        (0.0, 3.0),
        (0.0, 2.0),
        (3.0, 2.0),
        (6.0, 2.0),
        (6.0, 3.5),
        (6.0, 4.5),
    ] {
        let dragged = capsule_at([20.0 + x, 20.0, z], true);
        let (nodes, vectors) = contacts.find(&[dragged], &u).unwrap();
        assert!(
            vectors.chunks_exact(3).all(|c| c[2] <= 1e-4),
            "pulled out: {vectors:?}"
        );
        u = follow(u.len(), nodes, vectors);
    }
    assert!(
        contacts.found().0.is_empty(),
        "glued: {:?}",
        contacts.found()
    );
}

#[test]
fn sticking_drags_and_sliding_does_not() {
    let (positions, faces) = slab(20);
    let mut drag = [0.0; 2];
    for (drag, sticking) in drag.iter_mut().zip([false, true]) {
        let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
        let mut u = vec![0.0; positions.len()];
        for shift in [0.0, 0.4, 0.8, 1.2] {
            let shape = Shape::Spatula {
                half_extents: [6.0, 6.0, 2.0],
                radius: 0.5,
            };
            let flat = instrument(shape, [20.0 + shift, 20.0, 0.5], LEVEL, sticking);
            let (nodes, vectors) = contacts.find(&[flat], &u).unwrap();
            u = follow(u.len(), nodes, vectors);
        }
        // The node below the middle.
        *drag = u[3 * (10 + 21 * 10)];
    }
    assert!(drag[0].abs() < 1e-4, "{drag:?}");
    assert!((drag[1] - 1.2).abs() < 1e-4, "{drag:?}");
}

#[test]
fn a_thin_instrument_that_moved_past_the_surface_pushes_inwards() {
    let (positions, faces) = slab(20);
    let shape = Shape::Spatula {
        half_extents: [5.0, 5.0, 0.8],
        radius: 0.4,
    };
    let blade = |z| instrument(shape.clone(), [20.0, 20.0, z], LEVEL, false);
    let zero = vec![0.0; positions.len()];
    let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
    assert!(contacts.find(&[blade(2.0)], &zero).unwrap().0.is_empty());
    // Its middle is 0.5 mm below the surface: the shortest way out would be up.
    let (nodes, vectors) = contacts.find(&[blade(-0.5)], &zero).unwrap();
    assert!(!nodes.is_empty());
    for c in vectors.chunks_exact(3) {
        assert!(c[2] < -0.5, "{c:?}");
    }
    // Asked again before the tissue has moved, the answer is the same.
    let first = (nodes.to_vec(), vectors.to_vec());
    let (nodes, vectors) = contacts.find(&[blade(-0.5)], &zero).unwrap();
    assert_eq!((nodes.to_vec(), vectors.to_vec()), first);
}

#[test]
fn contact_from_the_inside_is_ignored() {
    let (positions, faces) = slab(20);
    let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
    let zero = vec![0.0; positions.len()];
    let side = 21 * 21;
    contacts.find(&[capsule(-10.0, false)], &zero).unwrap();
    // Downwards, until the bottom nodes are inside it: they are reached from within the tissue.
    let (nodes, _) = contacts.find(&[capsule(-18.0, false)], &zero).unwrap();
    assert!(nodes.iter().all(|&node| node < side), "{nodes:?}");
}

#[test]
fn held_nodes_are_never_touched_and_bad_input_changes_nothing() {
    let (positions, faces) = slab(20);
    let held: Vec<u32> = (0..441).filter(|i| i % 2 == 0).collect();
    let mut contacts = InstrumentContacts::new(&positions, &faces, &held).unwrap();
    let zero = vec![0.0; positions.len()];
    let good = [capsule(2.5, false)];
    let before: Vec<u32> = contacts.find(&good, &zero).unwrap().0.to_vec();
    assert!(!before.is_empty() && before.iter().all(|node| node % 2 == 1));
    assert!(contacts.find(&good, &zero[3..]).is_err());
    assert_eq!(contacts.find(&good, &zero).unwrap().0, before);
    assert!(contacts.find(&[], &zero).unwrap().0.is_empty());
}

/// A ball is a capsule without length, and a hull is a shape like the others: what the contact solve takes is taken here.
#[test]
fn balls_and_hulls_are_taken() {
    let (positions, faces) = slab(20);
    let zero = vec![0.0; positions.len()];
    let corners = (0..8).map(|i: u32| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 4.0 } else { -4.0 }));
    let hull = Shape::Hull {
        points: corners.collect(),
        margin: 0.0,
    };
    let ball = Shape::Capsule {
        half_length: 0.0,
        radius: 4.0,
    };
    for shape in [ball, Shape::Sphere { radius: 4.0 }, hull] {
        let mut contacts = InstrumentContacts::new(&positions, &faces, &[]).unwrap();
        let tool = instrument(shape, [20.1, 20.1, 3.0], LEVEL, false);
        let (nodes, vectors) = contacts.find(&[tool], &zero).unwrap();
        assert!(!nodes.is_empty());
        let lowest = vectors.iter().copied().fold(0.0, f32::min);
        assert!((lowest + 1.0).abs() < 0.05, "{lowest}");
    }
}
