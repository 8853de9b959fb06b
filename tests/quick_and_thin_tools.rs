//! Tools that a sample of the surface alone would miss: quick ones, thin ones, ones that start in the tissue, and grasps that leap.
#![cfg(feature = "instruments")]

use std::sync::Arc;

use contact::{Rotation, Shape, Vector};
use upt::contact::{Mode, Tool, ToolReading};
use upt::{Contact, Corrections, Model, Scene, SceneOptions, View, flag};

fn model() -> Arc<Model> {
    fixture::model(fixture::shipped("liver-coarse"))
}

fn scene(model: &Arc<Model>, corrections: Corrections) -> Scene {
    let options = SceneOptions {
        corrections,
        threads: 1,
        ..SceneOptions::default()
    };
    Scene::new(Arc::clone(model), &options).unwrap()
}

fn step(scene: &Scene, tool: Tool) -> (ToolReading, u32) {
    scene.step(Contact::Tools(&[tool]), None).unwrap();
    let reading = scene.with_contact_report(|report| report.readings[0]);
    (reading, scene.stats().flags)
}

/// A face of the domain far from what tools cannot touch: its middle and its outward normal.
struct Place {
    at: Vector,
    outward: Vector,
}

/// Every so many-th place of the domain at which the body is thick and the border is far.
fn places(scene: &Scene, count: usize) -> Vec<Place> {
    let mesh = scene.mesh();
    let node = |n: u32| Vector::from_slice(&mesh.positions[3 * n as usize..][..3]);
    let touchable = |n: &u32| mesh.domain.nodes.binary_search(n).is_ok();
    let faces = mesh.domain.faces.as_chunks::<3>().0.iter();
    let all = faces.map(|face| face.map(node)).map(|[a, b, c]| Place {
        at: (a + b + c) / 3.0,
        outward: (b - a).cross(c - a).normalize(),
    });
    let found: Vec<Place> = all
        .filter(|place| {
            let inside = place.at - place.outward * 12.0;
            let mut nodes = mesh.surface.nodes.iter();
            nodes.all(|n| {
                let far = |from: Vector, least: f32| node(*n).distance(from) > least;
                far(inside, 9.0) && (touchable(n) || far(place.at, 16.0))
            })
        })
        .collect();
    assert!(found.len() > count, "{} places", found.len());
    let every = found.len() / count;
    found.into_iter().step_by(every).take(count).collect()
}

impl Place {
    /// A tool along the normal, its end so far above the surface.
    fn tool(&self, shape: &Shape, end: f32, height: f32) -> Tool {
        let turn = Rotation::from_rotation_arc(Vector::Y, self.outward);
        let at = self.at + self.outward * (height + end);
        Tool::new(shape, at.to_array(), turn.to_array()).unwrap()
    }
}

/// Goes to `depth` below the surface, `way` a step, and stays there for three steps.
fn jab(scene: &Scene, place: &Place, shape: &Shape, end: f32, way: f32, depth: f32) -> f32 {
    scene.reset().unwrap();
    let mut height = 4.0f32.max(way - depth);
    let mut deepest = 0.0f32;
    let mut rests = 0;
    while rests < 4 {
        let (reading, flags) = step(scene, place.tool(shape, end, height));
        if height < -0.5 {
            let feels = reading.contacts > 0 || flags & flag::DEEP != 0;
            assert!(feels, "at {:?}, {height} mm: {reading:?}", place.at);
            let told = flags & flag::DEEP != 0;
            assert!(told || reading.penetration_mm <= 1.0, "{reading:?}");
            deepest = deepest.max(reading.penetration_mm);
        }
        rests += u32::from(height <= -depth);
        height = (height - way).max(-depth);
    }
    deepest
}

/// Verifies REQ-040.
#[test]
fn quick_and_leaping_balls_do_not_pass_through() {
    let model = model();
    // With the recommended corrections (50 ms): 100 mm/s, 1 m/s and a leap.
    let scene = scene(&model, Corrections::Recommended);
    let mut deep = Vec::new();
    for (radius, way) in [(2.0f32, 5.0f32), (3.0, 38.0), (5.0, 24.0)] {
        for place in places(&scene, 12) {
            let shape = Shape::Sphere { radius };
            let deepest = jab(&scene, &place, &shape, radius, way, 5.0);
            if deepest > 1.0 {
                deep.push((radius, place.at, deepest));
            }
        }
    }
    assert!(deep.is_empty(), "deeper than 1 mm: {deep:?}");
}

/// A blade over a node of the domain, `height` above the highest tissue beneath it.
fn blade(scene: &Scene, node: u32, height: f32) -> Tool {
    let mesh = scene.mesh();
    let positions = mesh.positions.as_chunks::<3>().0;
    let at = |n: u32| Vector::from(positions[n as usize]);
    let is_near = |n: &u32| at(*n).distance(at(node)) < 8.0;
    let faces = mesh.domain.faces.as_chunks::<3>().0.iter();
    let outward: Vector = faces
        .filter(|face| face.iter().any(is_near))
        .map(|face| face.map(at))
        .map(|[a, b, c]| (b - a).cross(c - a))
        .sum();
    let outward = outward.normalize();
    let turn = Rotation::from_rotation_arc(Vector::Z, outward);
    let half = Vector::new(6.0, 8.0, 1.5);
    let own = (0..positions.len() as u32).map(|n| turn.inverse() * (at(n) - at(node)));
    let beneath = own.filter(|p| p.x.abs() < half.x && p.y.abs() < half.y && p.z.abs() < 20.0);
    let top = beneath.map(|p| p.z).fold(0.0, f32::max);
    let place = at(node) + outward * (top + half.z + height);
    let shape = Shape::Spatula {
        half_extents: half.to_array(),
        radius: half.z,
    };
    Tool::new(&shape, place.to_array(), turn.to_array()).unwrap()
}

/// Verifies REQ-040.
#[test]
fn a_blade_that_leaps_while_it_presses_does_not_pass_through() {
    let model = fixture::model(fixture::shipped("brain-coarse-reduced"));
    let scene = |substeps| {
        let corrections = Corrections::Auto {
            most: 10,
            target_mm: 0.02,
            budget_us: 0,
        };
        let options = SceneOptions {
            corrections,
            step_s: 0.02,
            substeps,
            threads: 1,
            ..SceneOptions::default()
        };
        Scene::new(Arc::clone(&model), &options).unwrap()
    };
    // The blade is 3 mm thick, goes to 3 mm and from there to 12 in one step.
    for (node, substeps) in [(1045, 1), (1045, 4), (2370, 1), (393, 1)] {
        let scene = scene(substeps);
        let held = |leaps: bool| {
            scene.reset().unwrap();
            let mut force = 0.0;
            for k in 0..110u16 {
                let depth = match 0.2 * f32::from(k) {
                    slow if slow > 3.0 && leaps => 12.0,
                    slow => slow.min(12.0),
                };
                let (reading, flags) = step(&scene, blade(&scene, node, -depth));
                force = Vector::from(reading.force).length();
                let told = flags & (flag::DEEP | flag::UNSOLVED) != 0;
                assert!(
                    depth < 1.0 || force > 1.0 || told,
                    "node {node}, {substeps} substeps, step {k}: {reading:?}"
                );
            }
            force
        };
        let (slow, quick) = (held(false), held(true));
        assert!(
            quick > 0.7 * slow && quick < 1.4 * slow,
            "node {node}, {substeps} substeps: {quick} for {slow} mN"
        );
    }
}

#[test]
fn contact_on_the_linear_response_is_found_along_the_way_too() {
    let model = model();
    let scene = scene(&model, Corrections::None);
    for place in places(&scene, 8) {
        jab(
            &scene,
            &place,
            &Shape::Sphere { radius: 3.0 },
            3.0,
            12.0,
            5.0,
        );
    }
}

/// A hull whose point has a half angle of 17 degrees.
fn cone() -> Shape {
    let wide = 20.0 * 17.0f32.to_radians().tan();
    let mut points = vec![[0.0, -20.0, 0.0]];
    for side in 0..12 {
        let (sin, cos) = (side as f32 * std::f32::consts::TAU / 12.0).sin_cos();
        points.extend([0.0, 20.0].map(|y| [wide * cos, y, wide * sin]));
    }
    Shape::Hull {
        points,
        margin: 0.0,
    }
}

/// Verifies REQ-040.
#[test]
fn needles_points_and_square_probes_are_stopped_between_the_samples() {
    let model = model();
    let scene = scene(&model, Corrections::Recommended);
    let needle = |radius: f32| {
        let half_length = 30.0;
        let shape = Shape::Capsule {
            half_length,
            radius,
        };
        (shape, half_length + radius)
    };
    let probe = Shape::Box {
        half_extents: [0.5, 30.0, 0.5],
    };
    let mut deep = Vec::new();
    for (shape, end) in [needle(0.25), needle(0.5), (probe, 30.0), (cone(), 20.0)] {
        for place in places(&scene, 8) {
            let deepest = jab(&scene, &place, &shape, end, 1.0, 4.0);
            if deepest > 0.8 {
                deep.push((end, place.at, deepest));
            }
        }
    }
    assert!(deep.is_empty(), "{deep:?}");
}

#[test]
fn what_is_too_thin_is_refused_with_its_size() {
    let refused = |shape: Shape| {
        let tool = Tool::new(&shape, [0.0; 3], [0.0, 0.0, 0.0, 1.0]);
        tool.map(drop).unwrap_err().to_string()
    };
    let needle = Shape::Capsule {
        half_length: 20.0,
        radius: 0.1,
    };
    assert!(refused(needle).contains("0.2 mm thick"));
    let blade = Shape::Box {
        half_extents: [0.05, 10.0, 4.0],
    };
    assert!(refused(blade).contains("0.1 mm thick"));
    // A tool in metres.
    let metres = [-1.0, 1.0].map(|x| [[0.004 * x, 0.03, 0.0], [0.0, -0.03, 0.004 * x]]);
    let hull = |points: Vec<[f32; 3]>| Shape::Hull {
        points,
        margin: 0.0,
    };
    assert!(refused(hull(metres.as_flattened().to_vec())).contains("mm thick"));
    let pin = [
        [0.0; 3],
        [0.5, 10.0, 0.5],
        [-0.5, 10.0, 0.5],
        [0.0, 10.0, -0.5],
    ];
    assert!(refused(hull(pin.to_vec())).contains("too pointed at [0, 0, 0]"));
}

#[test]
fn a_tool_that_starts_in_the_tissue_is_told_and_comes_out() {
    let model = model();
    let scene = scene(&model, Corrections::Recommended);
    let shape = Shape::Sphere { radius: 3.0 };
    let mut out = 0;
    let places = places(&scene, 8);
    for place in &places {
        scene.reset().unwrap();
        let mut last = 0.0;
        for at in 0..10 {
            let (reading, flags) = step(&scene, place.tool(&shape, 3.0, -9.0));
            if at == 0 {
                assert!(flags & flag::DEEP != 0, "{reading:?}");
            }
            last = reading.penetration_mm;
        }
        out += usize::from(last < 1.0);
    }
    assert!(
        out + 1 >= places.len(),
        "{out} of {} came out",
        places.len()
    );
}

#[test]
fn a_grasp_does_not_survive_a_leap() {
    let model = model();
    let scene = scene(&model, Corrections::Recommended);
    let place = &places(&scene, 1)[0];
    let shape = Shape::Sphere { radius: 4.0 };
    let tool = |height: f32, mode: Mode| {
        let mut tool = place.tool(&shape, 4.0, height);
        tool.mode = mode;
        tool
    };
    step(&scene, tool(-1.0, Mode::Slide));
    let (held, _) = step(&scene, tool(-1.0, Mode::Grasp));
    assert!(held.contacts > 0 && !held.torn);
    let (lost, _) = step(&scene, tool(49.0, Mode::Grasp));
    assert!(lost.torn && lost.contacts == 0, "{lost:?}");
    // Back again it is open, until the host closes it anew.
    let (back, _) = step(&scene, tool(-1.0, Mode::Grasp));
    let pull = Vector::from(back.force).dot(place.outward);
    assert!(pull >= -1.0, "pulls {pull} mN");
    assert!(scene.stats().max_displacement_mm < 5.0);
}

/// Verifies REQ-046.
#[test]
fn a_step_of_deep_tools_is_bounded_and_says_what_it_left() {
    let model = model();
    let scene = scene(&model, Corrections::Recommended);
    let places = places(&scene, 12);
    let mut cut_short = false;
    for (trial, three) in places.windows(3).enumerate() {
        scene.reset().unwrap();
        let tools: Vec<Tool> = three
            .iter()
            .map(|place| {
                let shape = Shape::Capsule {
                    half_length: 14.0,
                    radius: 9.0,
                };
                let turn = Rotation::from_rotation_z(trial as f32).to_array();
                let mut tool = Tool::new(&shape, place.at.to_array(), turn).unwrap();
                tool.friction = 1.2;
                tool
            })
            .collect();
        // The guard may refuse what three tools as large as the organ leave of the tissue.
        if scene.step(Contact::Tools(&tools), None).is_err() {
            continue;
        }
        let stats = scene.stats();
        assert!(stats.evaluations < 200, "{} evaluations", stats.evaluations);
        let residual = scene.with_contact_report(|report| {
            let each = report.readings.iter().map(|reading| reading.residual_mm);
            each.fold(0.0, f32::max)
        });
        let flagged = stats.flags & flag::UNSOLVED != 0;
        assert_eq!(flagged, residual > 0.01, "{residual} mm");
        cut_short |= flagged;
    }
    assert!(cut_short, "no solve was cut short: deeper tools are needed");
}

#[test]
fn a_frame_shows_the_tissue_in_front_of_a_quick_tool() {
    let model = model();
    let scene = scene(&model, Corrections::Recommended);
    let shape = Shape::Sphere { radius: 3.0 };
    for place in places(&scene, 6) {
        scene.reset().unwrap();
        step(&scene, place.tool(&shape, 3.0, 2.0));
        // 7 mm in half a step: the ball has gone past the surface.
        let mut u = vec![0.0; 3 * scene.node_count()];
        scene
            .present(
                Contact::Tools(&[place.tool(&shape, 3.0, -5.0)]),
                0.025,
                View::Region,
                &mut u,
            )
            .unwrap();
        let moved = u.as_chunks::<3>().0.iter().map(|u| Vector::from(*u));
        let inward = moved.map(|u| -u.dot(place.outward)).fold(0.0, f32::max);
        assert!(inward > 3.0, "{inward} mm at {:?}", place.at);
    }
}
