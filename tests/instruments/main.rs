//! Steps that rigid instruments drive: what the contact obeys, in every state that a host can bring about, and what is refused.
#![cfg(feature = "instruments")]

mod cut_blade;
mod cut_grasp;
mod cut_held;
mod cut_loads;
mod cut_operations;
mod cut_scenes;
mod cut_surfaces;
mod cuts;
mod cuts_and_truth;
mod extremes;
mod portable;
mod regions;
mod relaxing;
mod through_the_abi;

use contact::{Shape, Vector};
use fixture::{bits, model, plain, scene};
use upt::contact::{Mode, Tool, ToolReading};
use upt::{Contact, Corrections, Scene, SceneOptions};

/// A ball at a place.
fn ball(radius: f32, at: [f32; 3]) -> Tool {
    Tool::new(&Shape::Sphere { radius }, at, [0.0, 0.0, 0.0, 1.0]).unwrap()
}

fn step(scene: &Scene, tools: &[Tool]) -> Vec<f32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    scene.step(Contact::Tools(tools), Some(&mut u)).unwrap();
    u
}

fn readings(scene: &Scene) -> Vec<ToolReading> {
    scene.with_contact_report(|report| report.readings.clone())
}

fn with(corrections: u32) -> SceneOptions {
    SceneOptions {
        corrections: match corrections {
            0 => Corrections::None,
            count => Corrections::Fixed(count),
        },
        ..plain()
    }
}

/// The middle of the domain's free top, and the outward normal there.
fn site(scene: &Scene) -> ([f32; 3], Vector) {
    let mesh = scene.mesh();
    let place = |node: u32| Vector::from_slice(&mesh.positions[3 * node as usize..][..3]);
    let nodes = mesh.domain.nodes.iter().map(|&node| place(node));
    let middle = nodes.clone().sum::<Vector>() / mesh.domain.nodes.len() as f32;
    let normal = mesh.domain.faces.as_chunks::<3>().0.iter();
    let normal: Vector = normal
        .map(|face| face.map(place))
        .map(|[a, b, c]| (b - a).cross(c - a))
        .sum();
    let nearest = nodes.min_by(|a, b| {
        let far = |p: &Vector| (*p - middle).length();
        far(a).total_cmp(&far(b))
    });
    (nearest.unwrap().to_array(), normal.normalize())
}

/// A ball of radius 3 mm that is `depth` mm inside of the rest surface, shifted by `aside`.
fn pressing(scene: &Scene, depth: f32, aside: Vector) -> Tool {
    let (at, normal) = site(scene);
    let centre = Vector::from(at) + normal * (3.0 - depth) + aside;
    ball(3.0, centre.to_array())
}

fn size(v: [f32; 3]) -> f32 {
    Vector::from(v).length()
}

/// Verifies REQ-041.
#[test]
fn a_press_leaves_no_penetration_and_pushes_back_and_a_lift_ends_it() {
    for corrections in [0, 1, 3, 10] {
        let options = SceneOptions {
            sleep: true,
            ..with(corrections)
        };
        let scene = scene(&model("tiny-corrected"), &options);
        let (_, normal) = site(&scene);
        for t in 1..=8 {
            step(&scene, &[pressing(&scene, 0.2 * t as f32, Vector::ZERO)]);
            let reading = readings(&scene)[0];
            let deepest = match corrections {
                0 => 0.5,
                1 => 0.2,
                _ => 0.1,
            };
            assert!(
                reading.penetration_mm < deepest,
                "k = {corrections}, step {t}: {reading:?}"
            );
            let force = Vector::from(reading.force);
            assert!(
                reading.contacts > 0 && force.dot(normal) > 0.9 * force.length(),
                "k = {corrections}, step {t}: {reading:?}"
            );
            let sum = scene.with_contact_report(|report| {
                let pushes = report.pushes.iter().map(|push| Vector::from(push.force));
                pushes.sum::<Vector>()
            });
            assert!((sum - force).length() <= 1e-3 * force.length());
        }
        let pressed = size(readings(&scene)[0].force);
        step(&scene, &[pressing(&scene, -30.0, Vector::ZERO)]);
        let reading = readings(&scene)[0];
        assert_eq!(
            (reading.contacts, size(reading.force)),
            (0, 0.0),
            "{pressed}"
        );
        for _ in 0..60 {
            step(&scene, &[pressing(&scene, -30.0, Vector::ZERO)]);
        }
        let stats = scene.stats();
        assert!(
            stats.max_displacement_mm < 0.05,
            "k = {corrections}: {}",
            stats.max_displacement_mm
        );
        assert!(stats.sleeping, "k = {corrections}");
        step(&scene, &[]);
        assert!(
            readings(&scene).is_empty(),
            "a sleeping scene forgets its tools"
        );
    }
}

#[test]
fn a_reset_scene_forgets_what_its_tools_read() {
    let scene = scene(&model("tiny-corrected"), &with(3));
    step(&scene, &[pressing(&scene, 0.5, Vector::ZERO)]);
    assert!(readings(&scene)[0].contacts > 0);
    let saved = scene.save().unwrap();
    scene.restore(&saved).unwrap();
    assert!(readings(&scene).is_empty(), "a snapshot has no readings");
    step(&scene, &[pressing(&scene, 0.5, Vector::ZERO)]);
    scene.reset().unwrap();
    assert!(
        readings(&scene).is_empty() && scene.with_contact_report(|report| report.pushes.is_empty())
    );
}

/// Verifies REQ-042.
#[test]
fn friction_obeys_coulomb_and_drags() {
    let model = model("tiny-corrected");
    let dragged = |friction: f32| {
        let scene = scene(&model, &with(5));
        let (_, normal) = site(&scene);
        let along = normal.any_orthonormal_vector();
        for t in 0..14 {
            let depth = 0.25 * (t as f32).min(5.0);
            let aside = along * (0.2 * (t as f32 - 5.0).max(0.0));
            let mut tool = pressing(&scene, depth, aside);
            tool.friction = friction;
            step(&scene, &[tool]);
            // Each point on its own: its push is along the ball's normal there.
            let centre = Vector::from(pressing(&scene, depth, aside).pose.translation);
            scene.with_contact_report(|report| {
                for push in &report.pushes {
                    let force = -Vector::from(push.force);
                    let out = (Vector::from(push.point) - centre).normalize();
                    let normal = force.dot(out);
                    let across = (force - out * normal).length();
                    let most = friction * normal * 1.05 + 0.02 * force.length() + 0.01;
                    assert!(across <= most, "{friction}: {across} of {normal}");
                }
            });
        }
        Vector::from(readings(&scene)[0].force).dot(along)
    };
    let (smooth, rough) = (dragged(0.0), dragged(0.6));
    assert!(rough < smooth - 0.2 * smooth.abs(), "{smooth} {rough}");
}

/// Verifies REQ-045.
#[test]
fn a_grasp_pulls_and_tears_off() {
    let scene = scene(&model("tiny-corrected"), &with(5));
    let (_, normal) = site(&scene);
    let grasping = |depth: f32, tear_off_mn: f32| Tool {
        mode: Mode::Grasp,
        tear_off_mn,
        ..pressing(&scene, depth, Vector::ZERO)
    };
    for t in 1..=3 {
        step(&scene, &[pressing(&scene, 0.3 * t as f32, Vector::ZERO)]);
    }
    for t in 0..6 {
        step(&scene, &[grasping(0.9 - 0.3 * t as f32, 0.0)]);
    }
    let pulled = readings(&scene)[0];
    let pull = Vector::from(pulled.force).dot(normal);
    assert!(pull < 0.0 && pulled.contacts > 2, "{pulled:?}");
    step(&scene, &[grasping(-1.2, 0.5 * pull.abs())]);
    let tearing = readings(&scene)[0];
    assert!(
        tearing.torn && Vector::from(tearing.force).dot(normal) >= 0.0,
        "{tearing:?}"
    );
    step(&scene, &[grasping(-1.2, 0.5 * pull.abs())]);
    let torn = readings(&scene)[0];
    assert!(
        !torn.torn && Vector::from(torn.force).dot(normal) >= 0.0,
        "{torn:?}"
    );
}

/// A press, a slide with friction, a grasp and a lift, with the states of all steps.
fn programme(scene: &Scene, steps: std::ops::Range<i32>) -> Vec<u32> {
    let (_, normal) = site(scene);
    let along = normal.any_orthonormal_vector();
    let mut all = Vec::new();
    for t in steps {
        let depth = 0.3 * (t as f32).min(5.0) - 3.0 * (t as f32 - 11.0).max(0.0);
        let mut tool = pressing(scene, depth, along * (0.2 * t as f32));
        tool.friction = 0.3;
        if (8..11).contains(&t) {
            tool.mode = Mode::Grasp;
        }
        let other = pressing(scene, 0.1 * t as f32, along * -6.0);
        all.extend(bits(&step(scene, &[tool, other])));
        for reading in readings(scene) {
            all.extend(bits(&reading.force));
        }
    }
    all
}

/// Verifies REQ-030.
#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let model = model("tiny-corrected");
    for corrections in [0, 3] {
        let with_threads = |threads| {
            let options = SceneOptions {
                threads,
                ..with(corrections)
            };
            programme(&scene(&model, &options), 0..16)
        };
        assert_eq!(with_threads(1), with_threads(3));
    }
}

/// Verifies REQ-031.
#[test]
fn a_snapshot_resumes_contact_friction_and_grasp_to_the_bit() {
    let model = model("tiny-corrected");
    for at in [3, 6, 9, 12] {
        let first = scene(&model, &with(3));
        programme(&first, 0..at);
        let saved = first.save().unwrap();
        let wanted = programme(&first, at..16);
        first.restore(&saved).unwrap();
        assert_eq!(programme(&first, at..16), wanted, "after step {at}");
        let second = scene(&model, &with(3));
        second.restore(&saved).unwrap();
        assert_eq!(programme(&second, at..16), wanted, "after step {at}");
    }
}

#[test]
fn a_submitted_step_is_the_hosts_own() {
    let model = model("tiny-corrected");
    let (own, submitted) = (scene(&model, &with(3)), scene(&model, &with(3)));
    for t in 1..6 {
        let tools = [pressing(&own, 0.3 * t as f32, Vector::ZERO)];
        let wanted = step(&own, &tools);
        submitted.submit(Contact::Tools(&tools)).unwrap();
        let long = std::time::Duration::from_secs(600);
        assert_eq!(submitted.wait(long).unwrap(), upt::Progress::Done);
        let mut u = vec![0.0; wanted.len()];
        submitted.read(&mut u).unwrap();
        assert_eq!(bits(&u), bits(&wanted));
        assert_eq!(readings(&submitted), readings(&own));
    }
}
