//! What a host has of a scene goes on when the body is cut: attached points, regions, frames between steps, hands.

use super::cuts::{liver, options, slit};
use super::*;
use upt::View;
use upt::haptics::{HapticOptions, HapticPose, Haptics};

/// Points 2 mm from the blade's plane on either side of it, some millimetres deep, in pairs; the blade is that of [`slit`].
fn beside(scene: &Scene, aside: f32) -> Vec<f32> {
    let (at, normal) = site(scene);
    let along = normal.any_orthonormal_vector();
    let across = normal.cross(along);
    let mut points = Vec::new();
    for (a, depth) in [(-6.0, 2.0), (-2.0, 3.0), (3.0, 4.0), (7.0, 2.5)] {
        for off in [-2.0, 2.0] {
            let at = Vector::from(at) + across * (aside + off) + along * a - normal * depth;
            points.extend(at.to_array());
        }
    }
    points
}

/// How far the two of each pair have moved apart, mm.
fn openings(points: &[f32]) -> Vec<f32> {
    let pairs = points.chunks_exact(6);
    pairs
        .map(|pair| (Vector::from_slice(&pair[..3]) - Vector::from_slice(&pair[3..])).length())
        .collect()
}

fn points_of(scene: &Scene) -> Vec<f32> {
    let mut u = vec![0.0; 3 * scene.point_count()];
    scene.read_view(upt::View::Points, &mut u).unwrap();
    u
}

#[test]
fn points_go_with_the_side_on_which_they_lie() {
    let scene = Scene::new(liver(), &options()).unwrap();
    let (_, normal) = site(&scene);
    let across = normal.cross(normal.any_orthonormal_vector());
    let places = beside(&scene, 6.0);
    scene.attach_points(Some(&places)).unwrap();
    for at in 0..4 {
        step(
            &scene,
            &[pressing(&scene, -0.5 + 0.8 * at as f32, Vector::ZERO)],
        );
    }
    // A grasper pulls one lip away from the other.
    let pull = |scene: &Scene| {
        for at in 0..12 {
            let mm = 0.6 * (at as f32 - 2.0).max(0.0);
            let mut tool = pressing(scene, 2.0, across * -mm + normal * (0.5 * mm));
            tool.mode = Mode::Grasp;
            step(scene, &[tool]);
        }
        points_of(scene)
    };
    let before = points_of(&scene);
    let whole = scene.save().unwrap();
    scene.cut(0, 2, &slit(&scene, 6.0, 20.0)).unwrap();
    // Nothing moves at the moment of a cut.
    assert_eq!(bits(&points_of(&scene)), bits(&before));
    let after = pull(&scene);
    let open = openings(&after);
    assert!(open.iter().all(|open| *open > 2.0), "{open:?}");
    // Attached to the cut body they are the same.
    scene.attach_points(Some(&places)).unwrap();
    assert_eq!(bits(&points_of(&scene)), bits(&after));
    // Undo gives them their whole element back.
    scene.restore(&whole).unwrap();
    assert_eq!(bits(&points_of(&scene)), bits(&before));
    let closed = openings(&pull(&scene));
    assert!(closed.iter().all(|open| *open < 1.0), "{closed:?}");
}

#[test]
fn a_region_goes_on_across_cuts() {
    let [scene, all] = [0, 1].map(|_| Scene::new(liver(), &options()).unwrap());
    let tool = pressing(&scene, 4.0, Vector::ZERO);
    let tools = std::slice::from_ref(&tool);
    let edge = slit(&scene, 6.0, 15.0);
    let nodes: Vec<u32> = scene
        .mesh()
        .domain
        .nodes
        .iter()
        .copied()
        .step_by(7)
        .collect();
    scene.set_region(Some(&nodes)).unwrap();
    let mut shown = vec![0.0; 3 * nodes.len()];
    for at in 0..6 {
        if at == 3 {
            let cut = scene.cut(0, 2, &edge).unwrap();
            all.cut(0, 2, &edge).unwrap();
            assert!(!cut.copied.is_empty());
        }
        scene.step(Contact::Tools(tools), Some(&mut shown)).unwrap();
        let u = step(&all, tools);
        let wanted = nodes.iter().flat_map(|node| &u[3 * *node as usize..][..3]);
        assert!(wanted.zip(&shown).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
    // A copy may be of it, and of a body without it no list may name it.
    let copy = [all.node_count() as u32 - 1];
    scene.set_region(Some(&copy)).unwrap();
    let mut one = [0.0; 3];
    scene.step(Contact::Tools(tools), Some(&mut one)).unwrap();
    assert_eq!(bits(&one), bits(&step(&all, tools)[3 * copy[0] as usize..]));
    assert!(scene.set_region(Some(&[copy[0] + 1])).is_err());
}

#[test]
fn frames_go_on_between_the_steps_of_a_cut_body() {
    let scene = Scene::new(liver(), &options()).unwrap();
    let tool = pressing(&scene, 4.0, Vector::ZERO);
    let tools = || Contact::Tools(std::slice::from_ref(&tool));
    let mut frame = vec![0.0; 3 * scene.node_count()];
    for _ in 0..6 {
        step(&scene, std::slice::from_ref(&tool));
    }
    scene
        .present(tools(), 0.01, View::Region, &mut frame)
        .unwrap();
    scene.cut(0, 2, &slit(&scene, 6.0, 15.0)).unwrap();
    let count = scene.node_count();
    let mut u = vec![0.0; 3 * count];
    for at in 0..10 {
        let mut frame = vec![f32::NAN; 3 * count];
        if at > 0 {
            u = step(&scene, std::slice::from_ref(&tool));
        } else {
            scene.read(&mut u).unwrap();
        }
        for tau in [0.0, 0.02, 0.045] {
            scene
                .present(tools(), tau, View::Region, &mut frame)
                .unwrap();
            let off = frame.iter().zip(&u).map(|(a, b)| (a - b).abs());
            let off = off.fold(0.0, f32::max);
            // A quick step is followed on for the time of the frame.
            assert!(
                off < 4.0 && frame.iter().all(|x| x.is_finite()),
                "{at} {tau}: {off}"
            );
        }
    }
    // At rest again frames and steps are one.
    for _ in 0..20 {
        u = step(&scene, std::slice::from_ref(&tool));
    }
    frame.resize(3 * count, 0.0);
    for tau in [0.01, 0.04] {
        scene
            .present(tools(), tau, View::Region, &mut frame)
            .unwrap();
        let off = frame.iter().zip(&u).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f32::max) < 0.05);
    }
}

/// What a hand feels where the tool is.
fn felt(hand: &mut Haptics, tool: &Tool, from_s: f64) -> [f32; 3] {
    let mut force = [0.0; 3];
    for at in 1..=40 {
        let pose = HapticPose {
            time_s: from_s + 0.001 * f64::from(at),
            position_m: (tool.pose.translation * 1e-3).to_array(),
            rotation: [0.0, 0.0, 0.0, 1.0],
            velocity: None,
        };
        force = hand.render(&pose).unwrap().force_n;
    }
    force
}

#[test]
fn a_hand_feels_the_cut_body() {
    let scene = Scene::new(liver(), &options()).unwrap();
    let tool = pressing(&scene, 4.0, Vector::ZERO);
    let tools = std::slice::from_ref(&tool);
    let mut hand = scene.haptics(&HapticOptions::new(0, tool.clone())).unwrap();
    for _ in 0..12 {
        step(&scene, tools);
    }
    let mn = |force: [f32; 3]| 1e3 * size(force);
    let mut now = 0.0;
    let mut feel = |hand: &mut Haptics| {
        now += 0.05;
        mn(felt(hand, &tool, now))
    };
    let whole = feel(&mut hand);
    let pressed = size(readings(&scene)[0].force);
    assert!((whole / pressed - 1.0).abs() < 0.05, "{whole} {pressed}");
    scene.cut(0, 2, &slit(&scene, -2.5, 20.0)).unwrap();
    // Until the next step it feels what it felt.
    let held = feel(&mut hand);
    assert!((held / whole - 1.0).abs() < 0.05, "{held} {whole}");
    for _ in 0..16 {
        step(&scene, tools);
        let force = feel(&mut hand);
        assert!(force.is_finite() && force < 2.0 * whole, "{force}");
    }
    let (cut, pressed) = (feel(&mut hand), size(readings(&scene)[0].force));
    assert!(pressed < 0.95 * whole, "{pressed} {whole}");
    assert!((cut / pressed - 1.0).abs() < 0.05, "{cut} {pressed}");
    // One that is made now, and both on the intact body.
    let mut other = scene.haptics(&HapticOptions::new(0, tool.clone())).unwrap();
    let late = mn(felt(&mut other, &tool, 10.0));
    assert!((late / pressed - 1.0).abs() < 0.05, "{late} {pressed}");
    scene.reset().unwrap();
    for _ in 0..12 {
        step(&scene, tools);
    }
    let again = feel(&mut hand);
    assert!((again / whole - 1.0).abs() < 0.05, "{again} {whole}");
}

/// A ball that circles on a flap, a step of 20 ms after the other: what the hand feels at the end of each is nearer to what the next step says (8 mN) than with the
/// compliance of the intact body (15 mN; the force changes by 10 in a step).
#[test]
fn a_hand_feels_how_soft_a_flap_is() {
    let options = SceneOptions {
        step_s: 0.02,
        ..SceneOptions::default()
    };
    let scene = Scene::new(liver(), &options).unwrap();
    let (at, normal) = site(&scene);
    let along = normal.any_orthonormal_vector();
    let across = normal.cross(along);
    let place = |a: f32, c: f32, n: f32| {
        let point = Vector::from(at) + along * a + across * c + normal * n;
        point.to_array()
    };
    let (low, high) = (-5.0, 6.0);
    let below = [-10.0, 10.0].map(|a| [place(a, -8.0, low), place(a, 14.0, low)]);
    let sides = [-10.0, 10.0].map(|a| [low, high].map(|n| [place(a, -8.0, n), place(a, 14.0, n)]));
    let front = [low, high].map(|n| [place(-10.0, 14.0, n), place(10.0, 14.0, n)]);
    for (stroke, blade) in (0..).zip([below, sides[0], sides[1], front]) {
        scene.cut(stroke, 2, blade.as_flattened()).unwrap();
    }
    let mut ball = ball(4.0, place(0.0, 0.0, 2.0));
    ball.friction = 0.6;
    for _ in 0..30 {
        step(&scene, std::slice::from_ref(&ball));
    }
    let hands = HapticOptions {
        latency_s: Some(0.001),
        passivity: false,
        ..HapticOptions::new(0, ball.clone())
    };
    let mut hand = scene.haptics(&hands).unwrap();
    step(&scene, std::slice::from_ref(&ball));
    let (mut now, mut squares, mut changes) = (0.0, 0.0, 0.0);
    let mut last = Vector::from(readings(&scene)[0].force);
    for around in 0..40 {
        let angle = 0.2 * std::f32::consts::PI * around as f32;
        let way = (across * angle.sin() - normal * angle.cos()) * 0.01;
        let mut force = Vector::ZERO;
        for _ in 0..20 {
            now += 0.001;
            ball.pose.translation += way;
            let pose = HapticPose {
                time_s: now,
                position_m: (ball.pose.translation * 1e-3).to_array(),
                rotation: [0.0, 0.0, 0.0, 1.0],
                velocity: None,
            };
            force = 1e3 * Vector::from(hand.render(&pose).unwrap().force_n);
        }
        step(&scene, std::slice::from_ref(&ball));
        let next = Vector::from(readings(&scene)[0].force);
        squares += force.distance_squared(next);
        changes += last.distance_squared(next);
        last = next;
    }
    let [off, change] = [squares, changes].map(|sum: f32| (sum / 40.0).sqrt());
    assert!(change > 5.0 && off < 11.5, "{off} mN, {change} mN");
}
