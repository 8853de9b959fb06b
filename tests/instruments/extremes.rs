//! Tools that a host had better not have: deep inside, wild, as large as the organ, or impossible and refused.

use contact::{Shape, Vector};
use fixture::Draw;
use upt::contact::{Mode, Tool};
use upt::{Contact, Corrections, Error, SceneOptions, flag};

use super::{ball, pressing, readings, site, step, with};
use fixture::{model, plain, scene};

/// Verifies REQ-044.
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
    assert!(deepest[11] < 0.1, "{deepest:?}");
    let stats = scene.stats();
    assert!(stats.min_det > 0.0 && stats.flags & flag::DEEP == 0);
}

/// A microsecond is over before any iteration begins: what the linear response has wrong stays, and the estimate must not forget it while the tool is held.
///
/// Verifies REQ-037.
#[test]
fn what_no_iteration_corrected_keeps_its_estimated_error() {
    let hurried = SceneOptions {
        corrections: Corrections::Auto {
            most: 64,
            target_mm: 0.0,
            budget_us: 1,
        },
        error_limit_mm: 0.01,
        ..plain()
    };
    let hurried = scene(&model("tiny-corrected"), &hurried);
    let settled = scene(&model("tiny-corrected"), &with(20));
    for t in 1..=40 {
        let tools = [pressing(
            &hurried,
            0.1 * f32::min(t as f32, 12.0),
            Vector::ZERO,
        )];
        let (state, truth) = (step(&hurried, &tools), step(&settled, &tools));
        let stats = hurried.stats();
        let squares = state.iter().zip(&truth).map(|(a, b)| (a - b) * (a - b));
        let error = (squares.sum::<f32>() / hurried.node_count() as f32).sqrt();
        let told = stats.error_mm;
        assert_eq!(stats.corrections, 0);
        assert!(2.0 * told >= error, "step {t}: {told} mm told, {error} mm");
        assert_eq!(stats.flags & flag::ERROR != 0, told > 0.01);
    }
}

/// Where a tool has leapt to, corrections come with the step after it. One that leaps away, as a hand lays an instrument down, takes none from the one that presses.
#[test]
fn a_leap_into_the_tissue_is_corrected_in_the_steps_that_follow() {
    let scene = scene(&model("tiny-corrected"), &with(5));
    let away = pressing(&scene, -60.0, Vector::ZERO);
    let on_it = pressing(&scene, 1.0, Vector::ZERO);
    let stepped = |tool: &Tool| {
        step(&scene, std::slice::from_ref(tool));
        (scene.stats(), readings(&scene)[0])
    };
    stepped(&away);
    let (leap, met) = stepped(&on_it);
    assert!(leap.corrections == 0 && leap.error_mm > 0.0, "{leap:?}");
    assert!(met.contacts > 0 && met.penetration_mm < 1.0, "{met:?}");
    let (next, held) = stepped(&on_it);
    assert!(next.corrections == 5 && held.contacts > 0, "{next:?}");
    for laid_down in [pressing(&scene, -2.0, Vector::ZERO), away] {
        step(&scene, &[on_it.clone(), laid_down]);
        let stats = scene.stats();
        assert!(stats.corrections == 5, "{stats:?}");
    }
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
        let mut draw = Draw(9);
        let mut random = |scale: f32| draw.within(-scale, scale);
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
    let tried = |tools: &[Tool]| scene.step(Contact::Tools(tools), None).unwrap_err();
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
    let made = |at: [f32; 3], turn| Tool::new(&Shape::Sphere { radius: 1.0 }, at, turn);
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
        Tool::new(&flat, [0.0; 3], turn),
        Err(Error::Argument(_))
    ));
    assert!(scene.save().unwrap() == before);
}

#[test]
fn the_same_question_has_the_same_contacts() {
    use upt::instrument::Instrument;
    let scene = scene(&model("tiny-reduced"), &plain());
    let tool = |depth: f32| {
        let at = pressing(&scene, depth, Vector::ZERO).pose.translation;
        let shape = Shape::Capsule {
            half_length: 2.0,
            radius: 3.0,
        };
        let turn = [0.0, 0.0, 0.0, 1.0];
        [Instrument {
            tool: Tool::new(&shape, at.to_array(), turn).unwrap(),
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
    let error = scene
        .step(Contact::Tools(&[ball(1.0, [0.0; 3])]), None)
        .unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    assert!(
        error
            .to_string()
            .contains("upt_scene_contacts_from_instruments")
    );
}

/// A slow press makes the iterations that the host asks for until none helps, however many nodes are near. (Their work was bounded for a day, and nothing
/// told.)
#[test]
fn a_slow_press_makes_the_iterations_that_are_asked_for() {
    let options = SceneOptions {
        corrections: Corrections::Fixed(64),
        ..SceneOptions::default()
    };
    let scene = upt::Scene::new(model(fixture::shipped("brain-reduced")), &options).unwrap();
    let mut made = 0;
    for frame in 0..12u8 {
        let depth = 0.8 * f32::from(frame.min(6));
        step(&scene, &[pressing(&scene, depth, Vector::ZERO)]);
        made += scene.stats().corrections;
        println!("{frame}: {} iterations", scene.stats().corrections);
    }
    println!("{made} in all");
    assert!(made > 600, "{made} iterations");
}
