//! Steps that rigid instruments drive: what the contact obeys, in every state that a host can bring about, and what is refused.
#![cfg(feature = "contact")]

mod fixture;

use contact::{Shape, Vector};
use fixture::{bits, model, plain, scene};
use upt::contact::{Mode, Reading, Tool};
use upt::{Contact, Corrections, Error, Scene, SceneOptions, StepInput, flag};

/// A ball at a place.
fn ball(radius: f32, at: [f32; 3]) -> Tool {
    Tool::new(0, &Shape::Sphere { radius }, at, [0.0, 0.0, 0.0, 1.0]).unwrap()
}

fn step(scene: &Scene, tools: &[Tool]) -> Vec<f32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    let input = StepInput {
        displacement: None,
        contact: Contact::Tools(tools),
    };
    scene.step(input, Some(&mut u)).unwrap();
    u
}

fn readings(scene: &Scene) -> Vec<Reading> {
    scene.with_told(|told| told.readings.clone())
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
    let nodes = mesh.domain_nodes.iter().map(|&node| place(node));
    let middle = nodes.clone().sum::<Vector>() / mesh.domain_nodes.len() as f32;
    let normal = mesh.domain_faces.as_chunks::<3>().0.iter();
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

#[test]
fn a_press_leaves_no_penetration_and_pushes_back_and_a_lift_ends_it() {
    for corrections in [0, 1, 3, 10] {
        let options = SceneOptions {
            no_sleep: false,
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
            let sum = scene.with_told(|told| {
                let pushes = told.pushes.iter().map(|push| Vector::from(push.force));
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
    assert!(readings(&scene).is_empty() && scene.with_told(|told| told.pushes.is_empty()));
}

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
            scene.with_told(|told| {
                for push in &told.pushes {
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
        submitted.submit_tools(&tools).unwrap();
        let long = std::time::Duration::from_secs(600);
        assert_eq!(submitted.wait(long).unwrap(), upt::Progress::Done);
        let mut u = vec![0.0; wanted.len()];
        submitted.read(&mut u).unwrap();
        assert_eq!(bits(&u), bits(&wanted));
        assert_eq!(readings(&submitted), readings(&own));
    }
}

#[test]
fn a_tool_that_starts_deep_inside_is_told_of_and_comes_out_on_its_own_side() {
    let scene = scene(&model("tiny-corrected"), &with(5));
    let (_, normal) = site(&scene);
    let mut deepest = Vec::new();
    for t in 0..12 {
        step(&scene, &[pressing(&scene, 5.5, Vector::ZERO)]);
        let reading = readings(&scene)[0];
        if t == 0 {
            assert!(scene.stats().flags & flag::DEEP != 0, "{reading:?}");
        }
        assert!(
            Vector::from(reading.force).dot(normal) >= 0.0,
            "{reading:?}"
        );
        deepest.push(reading.penetration_mm);
    }
    assert!(deepest[11] < 0.1 && deepest[11] < deepest[0], "{deepest:?}");
    let stats = scene.stats();
    assert!(stats.min_det > 0.0 && stats.flags & flag::DEEP == 0);
}

#[test]
fn wild_tools_stay_finite_and_the_tissue_comes_back() {
    for corrections in [0, 1, 3] {
        let options = SceneOptions {
            guard_policy: upt::GuardPolicy::Blend,
            ..with(corrections)
        };
        let scene = scene(&model("tiny-corrected"), &options);
        let (at, _) = site(&scene);
        let mut seed = 9u64;
        let mut random = |scale: f32| {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            scale * ((seed >> 40) as f32 / (1u64 << 23) as f32 - 1.0)
        };
        for _ in 0..200 {
            let tools: Vec<Tool> = (0..2)
                .map(|_| {
                    let centre = [0, 1, 2].map(|axis| at[axis] + random(6.0));
                    let mut tool = ball(2.5 + random(1.5), centre);
                    tool.friction = random(0.5).abs();
                    if random(1.0) > 0.7 {
                        tool.mode = Mode::Grasp;
                    }
                    tool
                })
                .collect();
            let u = step(&scene, &tools);
            assert!(u.iter().all(|x| x.is_finite()));
            for reading in readings(&scene) {
                assert!(
                    reading
                        .force
                        .iter()
                        .chain(&reading.torque)
                        .all(|x| x.is_finite())
                );
            }
        }
        for _ in 0..100 {
            step(&scene, &[]);
        }
        assert!(
            scene.stats().max_displacement_mm < 0.05,
            "k = {corrections}: {}",
            scene.stats().max_displacement_mm
        );
    }
}

#[test]
fn a_tool_as_large_as_the_organ_is_borne() {
    for corrections in [0, 3] {
        let options = SceneOptions {
            guard_policy: upt::GuardPolicy::Blend,
            ..with(corrections)
        };
        let scene = scene(&model("tiny-corrected"), &options);
        let (at, normal) = site(&scene);
        for t in 0..6 {
            let centre = Vector::from(at) + normal * (500.0 - 0.3 * t as f32);
            let u = step(&scene, &[ball(500.0, centre.to_array())]);
            assert!(u.iter().all(|x| x.is_finite()));
        }
        assert!(readings(&scene)[0].contacts > 3);
    }
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let model = model("tiny-corrected");
    let scene = scene(&model, &with(3));
    for t in 1..4 {
        step(&scene, &[pressing(&scene, 0.3 * t as f32, Vector::ZERO)]);
    }
    let before = scene.save().unwrap();
    let tool = pressing(&scene, 1.2, Vector::ZERO);
    let tried = |tools: &[Tool]| {
        let input = StepInput {
            displacement: None,
            contact: Contact::Tools(tools),
        };
        scene.step(input, None).unwrap_err()
    };
    let friction = Tool {
        friction: -0.1,
        ..tool.clone()
    };
    let error = tried(&[tool.clone(), friction]);
    assert!(matches!(error, Error::Argument(_)));
    assert!(
        error
            .to_string()
            .contains("instruments[1]: friction is -0.1"),
        "{error}"
    );
    let tear = Tool {
        tear_off_mn: f32::NAN,
        ..tool.clone()
    };
    assert!(matches!(tried(&[tear]), Error::Argument(_)));
    assert!(matches!(tried(&vec![tool; 65]), Error::Argument(_)));
    let turn = [0.0, 0.0, 0.0, 1.0];
    let made = |at: [f32; 3], turn| Tool::new(3, &Shape::Sphere { radius: 1.0 }, at, turn);
    assert!(matches!(
        made([f32::NAN; 3], turn),
        Err(Error::NonFinite(_))
    ));
    assert!(matches!(made([0.0; 3], [0.0; 4]), Err(Error::Argument(_))));
    assert!(matches!(
        made([2e6, 0.0, 0.0], turn),
        Err(Error::Argument(_))
    ));
    let flat = Shape::Sphere { radius: 0.0 };
    assert!(matches!(
        Tool::new(0, &flat, [0.0; 3], turn),
        Err(Error::Argument(_))
    ));
    assert!(scene.save().unwrap() == before);
}

#[test]
fn the_same_question_has_the_same_contacts() {
    use upt::instrument::{Instrument, Shape};
    let scene = scene(&model("tiny-reduced"), &plain());
    let tool = |depth: f32| {
        let at = pressing(&scene, depth, Vector::ZERO).pose.translation;
        let shape = Shape::Capsule {
            half_length: 2.0,
            radius: 3.0,
        };
        [Instrument {
            shape,
            position: at.to_array(),
            rotation: [0.0, 0.0, 0.0, 1.0],
            sticking: true,
        }]
    };
    for t in 1..8 {
        let tool = tool(0.4 * t as f32);
        let ask = || {
            let found = scene.contacts_from_instruments(&tool, |nodes, vectors| {
                Ok((nodes.to_vec(), vectors.to_vec()))
            });
            found.unwrap()
        };
        let (first, second) = (ask(), ask());
        assert_eq!(first, second, "step {t}");
        assert!(!first.0.is_empty());
        scene.step(fixture::sparse(&first), None).unwrap();
    }
}

#[test]
fn a_bundle_without_a_linear_response_says_what_to_use_instead() {
    let scene = scene(&model("tiny-upt"), &plain());
    let input = StepInput {
        displacement: None,
        contact: Contact::Tools(&[ball(1.0, [0.0; 3])]),
    };
    let error = scene.step(input, None).unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    assert!(
        error
            .to_string()
            .contains("upt_scene_contacts_from_instruments")
    );
}
