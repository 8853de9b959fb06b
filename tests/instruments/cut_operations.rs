//! Random cuts, removals, stiffness, undo and presses on a brain of 3,152 nodes: nothing that is not finite, no lost state.
//!
//! 150 operations; 10,000 with `UPT_NIGHTLY=1`. `UPT_FUZZ_SEED` is where their numbers begin. The counts are printed.

use super::*;
use fixture::Draw;
use upt::{Error, GuardPolicy, flag};

/// Operations to a body; then the intact one takes its place.
const TO_A_BODY: usize = 12;

#[derive(Debug, Default)]
struct Counts {
    operations: usize,
    refused: usize,
    copies: usize,
    steps: usize,
    not_finite: usize,
    /// Steps that left an inverted element.
    inverted: usize,
    fell_back: usize,
    guarded: usize,
    lost_states: usize,
}

/// Does something to the body at a place.
fn operate(scene: &Scene, draw: &mut Draw, at: Vector, normal: Vector) -> Result<usize, Error> {
    let along = normal.any_orthonormal_vector();
    let along = along.lerp(normal.cross(along), draw.unit()).normalize();
    let before = scene.node_count();
    match (6.0 * draw.unit()) as u32 {
        0..=2 => {
            let (long, deep) = (draw.within(5.0, 60.0), draw.within(3.0, 25.0));
            let bend = normal.cross(along) * draw.within(-4.0, 4.0);
            let edge = |depth: f32, aside: Vector| {
                [-0.5, 0.5]
                    .map(|part| (at + along * (part * long) - normal * depth + aside).to_array())
            };
            let poses = [
                edge(-8.0, Vector::ZERO),
                edge(0.5 * deep, bend),
                edge(deep, Vector::ZERO),
            ];
            let stroke = (3.0 * draw.unit()) as u32;
            scene.cut(stroke, 2, poses.as_flattened())?;
        }
        3 => {
            let tool = ball(
                draw.within(2.0, 9.0),
                (at - normal * draw.within(0.0, 8.0)).to_array(),
            );
            scene.remove(&tool, draw.within(10.0, 300.0))?;
        }
        4 => {
            let first = (draw.unit() * 12_000.0) as u32;
            let elements: Vec<u32> = (first..first + 60).collect();
            scene.scale_stiffness(&elements, draw.within(0.4, 2.5))?;
        }
        _ => {
            scene.drop_fragments()?;
        }
    }
    Ok(scene.node_count().saturating_sub(before))
}

/// Verifies REQ-061.
#[test]
fn random_operations_leave_every_state_finite_and_none_is_lost() {
    let number =
        |name: &str, or: usize| std::env::var(name).map_or(or, |text| text.parse().unwrap_or(or));
    let operations = match number("UPT_NIGHTLY", 0) {
        0 => 150,
        _ => 10_000,
    };
    let model = fixture::model(fixture::shipped("brain-coarse-reduced"));
    let options = SceneOptions {
        corrections: Corrections::Fixed(3),
        guard_policy: GuardPolicy::Blend,
        ..SceneOptions::default()
    };
    let scene = Scene::new(model, &options).unwrap();
    let mesh = std::sync::Arc::clone(scene.mesh());
    let faces = mesh.domain.faces.as_chunks::<3>().0;
    let place = |node: u32| Vector::from_slice(&mesh.positions[3 * node as usize..][..3]);
    let mut draw = Draw(number("UPT_FUZZ_SEED", 0) as u64 + 46);
    let mut counts = Counts::default();
    for operation in 0..operations {
        if operation % TO_A_BODY == 0 {
            scene.reset().unwrap();
            assert_eq!(scene.node_count(), mesh.node_count());
        }
        let face = faces[(draw.unit() * faces.len() as f32) as usize % faces.len()];
        let [a, b, c] = face.map(place);
        let (at, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize());
        let saved = scene.save().unwrap();
        counts.operations += 1;
        match operate(&scene, &mut draw, at, normal) {
            Ok(copies) => counts.copies += copies,
            Err(error) => {
                let known = matches!(error, Error::Argument(_));
                assert!(known, "operation {operation}: {error}");
                counts.refused += 1;
                counts.lost_states += usize::from(scene.save().unwrap() != saved);
            }
        }
        for step in 0..3 {
            // It leaps to the place, and then presses.
            let depth = [-1.0, 1.5, 3.0][step];
            let tool = ball(4.0, (at + normal * (4.0 - depth)).to_array());
            let mut u = vec![f32::NAN; 3 * scene.node_count()];
            scene.step(Contact::Tools(&[tool]), Some(&mut u)).unwrap();
            let stats = scene.stats();
            counts.steps += 1;
            counts.not_finite += usize::from(!u.iter().all(|x| x.is_finite()));
            counts.fell_back += usize::from(stats.flags & flag::FELL_BACK != 0);
            counts.inverted += usize::from(stats.min_det < 0.0);
            let guarded = flag::BOUND | flag::GROWTH | flag::NON_FINITE;
            counts.guarded += usize::from(stats.flags & guarded != 0);
        }
        if operation % 10 == 9 {
            // Undo gives the state before back, and there is a way forward again.
            let now = scene.save().unwrap();
            scene.restore(&saved).unwrap();
            counts.lost_states += usize::from(scene.save().unwrap() != saved);
            scene.restore(&now).unwrap();
            counts.lost_states += usize::from(scene.save().unwrap() != now);
        }
    }
    println!("{counts:?}");
    assert!(
        counts.copies > operations && counts.refused < operations / 2,
        "{counts:?}"
    );
    let wrong = [counts.not_finite, counts.inverted, counts.lost_states];
    assert_eq!(wrong, [0; 3], "{counts:?}");
}

/// A spatula 1.4 mm thin presses one lip of a slit, its edge a millimetre beside it: the other lip is not in its way. (It was pushed aside by 1 N, and tissue
/// flew 27 mm: the spatula's middle lies beside the rim of the surface that samples cover, and counted as in the tissue.)
#[test]
fn a_thin_spatula_presses_a_lip_beside_the_other() {
    let options = SceneOptions {
        step_s: 0.02,
        ..SceneOptions::default()
    };
    let scene = Scene::new(super::cuts::liver(), &options).unwrap();
    let up = Vector::new(-0.844, 10.4127, 17.0547);
    let ends = [[-26.93, 94.14, 51.73], [-26.80, 71.36, 59.32]].map(Vector::from);
    let edges = ends.map(|tip| [tip, tip + up].map(|point| point.to_array()));
    assert!(scene.cut(0, 2, edges.as_flattened()).unwrap().area_mm2 > 100.0);
    scene.surface().update().unwrap();
    let shape = Shape::Spatula {
        half_extents: [5.0, 8.0, 0.7],
        radius: 0.5,
    };
    let [from, to] = [[-20.8621, 87.8401, 66.5315], [-21.233, 84.6307, 56.8805]].map(Vector::from);
    let rotation = [0.0147846, 0.15278, 0.983555, 0.0951789];
    for frame in 0..50 {
        let place = from.lerp(to, frame.min(37) as f32 / 37.0);
        let mut tool = Tool::new(&shape, place.to_array(), rotation).unwrap();
        tool.friction = 0.4;
        step(&scene, &[tool]);
        let (rest, seen) = (scene.surface().read(|surface| {
            let corners = surface.triangles.as_flattened().to_vec();
            (surface.rest.to_vec(), corners)
        }))
        .unwrap();
        let mut at = vec![0.0; 3 * rest.len()];
        scene.surface().positions(&mut at).unwrap();
        // Of the tissue: nodes of an element that a blade went through lie outside of it.
        let moved = seen.iter().map(|vertex| {
            let own = Vector::from_slice(&at[3 * *vertex as usize..][..3]);
            own.distance(Vector::from(rest[*vertex as usize]))
        });
        let largest = moved.fold(0.0, f32::max);
        println!("{frame}: {largest} mm");
        let flags = scene.stats().flags;
        // No farther than the spatula.
        assert!(
            largest < (0.2741 * (frame as f32 - 12.0)).clamp(0.01, 6.9) + 0.5,
            "{frame}: {largest} mm"
        );
        assert!(flags & flag::DEEP == 0, "{frame}: {flags:x}");
        assert!(
            frame > 37 || flags & flag::FELL_BACK == 0,
            "{frame}: {flags:x}"
        );
    }
}

/// How often the surface as it is goes around a point: 1 in the tissue, 0 outside (Van Oosterom and Strackee 1983).
fn winding(scene: &Scene, point: Vector) -> f32 {
    scene.surface().update().unwrap();
    let (count, triangles) = (scene.surface().read(|surface| {
        let count = surface.rest.as_flattened().len();
        (count, surface.triangles.to_vec())
    }))
    .unwrap();
    let mut at = vec![0.0; count];
    scene.surface().positions(&mut at).unwrap();
    let angles = triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|v| Vector::from_slice(&at[3 * v as usize..]) - point);
        let [x, y, z] = [a, b, c].map(Vector::length);
        let product = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
        2.0 * a.dot(b.cross(c)).atan2(product)
    });
    angles.sum::<f32>() / (4.0 * std::f32::consts::PI)
}

/// A small ball that is put into the tissue behind a wall of a slit is told of, and comes out. (It stayed there, with a force of 0 and no flag: what looked for
/// tools in the tissue knew the intact body's surface alone.)
#[test]
fn a_ball_behind_a_wall_is_in_the_tissue() {
    let options = SceneOptions {
        step_s: 0.02,
        ..super::cuts::options()
    };
    let scene = Scene::new(super::cuts::liver(), &options).unwrap();
    scene
        .cut(0, 2, &super::cuts::slit(&scene, 0.0, 15.0))
        .unwrap();
    let (at, normal) = site(&scene);
    let (at, along) = (Vector::from(at), normal.any_orthonormal_vector());
    let across = normal.cross(along);
    let start = scene.save().unwrap();
    for [aside, ahead, depth] in [[3.0, 0.0, 5.0], [-3.0, 5.0, 6.0], [3.5, -6.0, 7.0]] {
        scene.restore(&start).unwrap();
        let place = at + across * aside + along * ahead - normal * depth;
        let tool = ball(1.5, place.to_array());
        assert!(winding(&scene, place) > 0.9, "{aside}, {ahead}, {depth}");
        for frame in 0..12 {
            step(&scene, std::slice::from_ref(&tool));
            let (flags, force) = (scene.stats().flags, size(readings(&scene)[0].force));
            let seen = flags & flag::DEEP != 0 || force > 20.0;
            println!("{aside}, {ahead}, {depth}, {frame}: {force} mN, {flags:x}");
            assert!(seen, "{aside}, {ahead}, {depth}, {frame}: {force} mN");
        }
        let left = winding(&scene, place);
        assert!(left < 0.1, "{aside}, {ahead}, {depth}: {left}");
    }
}
