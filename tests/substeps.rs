//! Steps that are made of shorter ones where one alone would miss the target: when, what they gain, and what is refused.
#![cfg(feature = "instruments")]

use contact::{Shape, Vector};
use fixture::{bits, model, plain, scene};
use upt::contact::{Mode, Tool};
use upt::{Contact, Corrections, Error, Scene, SceneOptions};

fn with(substeps: u32, target_mm: f32) -> SceneOptions {
    SceneOptions {
        corrections: Corrections::Auto {
            most: 10,
            target_mm,
            budget_us: 0,
        },
        substeps,
        ..plain()
    }
}

/// A ball of radius 3 mm over the domain's first node, `depth` mm inside of the rest surface and `aside` mm to its side.
fn ball(scene: &Scene, depth: f32, aside: f32) -> Tool {
    let mesh = scene.mesh();
    let node = mesh.domain.nodes[mesh.domain.nodes.len() / 2] as usize;
    let at = Vector::from_slice(&mesh.positions[3 * node..][..3]);
    let centre = at + Vector::new(aside, 0.0, 3.0 - depth);
    let shape = Shape::Sphere { radius: 3.0 };
    let mut tool = Tool::new(&shape, centre.to_array(), [0.0, 0.0, 0.0, 1.0]).unwrap();
    tool.friction = 0.2;
    tool
}

fn step(scene: &Scene, tool: Tool) -> Vec<f32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    scene.step(Contact::Tools(&[tool]), Some(&mut u)).unwrap();
    u
}

/// A press within three steps, a slide, a grasp that is pulled, and a lift; displacements and readings.
fn programme(scene: &Scene, steps: std::ops::Range<i32>) -> Vec<u32> {
    let mut all = Vec::new();
    for t in steps {
        let depth = 0.7 * (t as f32).min(3.0) - 3.0 * (t as f32 - 11.0).max(0.0);
        let mut tool = ball(scene, depth, 0.4 * (t as f32 - 4.0).max(0.0));
        if (8..11).contains(&t) {
            tool.mode = Mode::Grasp;
            tool.tear_off_mn = 40.0;
        }
        let state = step(scene, tool);
        all.extend(bits(&state));
        scene.with_contact_report(|report| all.extend(bits(&report.readings[0].force)));
    }
    all
}

fn error(a: &[f32], b: &[f32]) -> f32 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    (squares.sum::<f32>() / a.len() as f32).sqrt()
}

#[test]
fn a_quick_tool_gets_them_and_the_state_is_that_of_shorter_steps() {
    let model = model("tiny-corrected");
    let whole = scene(&model, &with(1, 0.002));
    let parts = scene(&model, &with(4, 0.002));
    let short = SceneOptions {
        step_s: 0.0125,
        ..with(1, 0.0005)
    };
    let short = scene(&model, &short);
    let depth = |time: f32| 2.0 * (time / 3.0).min(1.0);
    for scene in [&whole, &parts, &short] {
        step(scene, ball(scene, -0.1, 0.0));
    }
    let (mut errors, mut counts) = ([0.0f32; 2], Vec::new());
    for t in 1..=8 {
        let mut wanted = Vec::new();
        for part in 1..=4 {
            let time = (t - 1) as f32 + 0.25 * part as f32;
            wanted = step(&short, ball(&short, depth(time), 0.0));
        }
        for (sum, scene) in errors.iter_mut().zip([&whole, &parts]) {
            let state = step(scene, ball(scene, depth(t as f32), 0.0));
            *sum += error(&state, &wanted);
        }
        assert_eq!(whole.stats().substeps, 0);
        counts.push(parts.stats().substeps);
    }
    assert!(counts.contains(&4), "{counts:?}");
    assert!(errors[1] < 0.7 * errors[0], "{errors:?}");
}

#[test]
fn a_slow_tool_gets_none_and_the_bits_are_those_of_whole_steps() {
    let model = model("tiny-corrected");
    let (whole, parts) = (scene(&model, &with(1, 0.5)), scene(&model, &with(4, 0.5)));
    for t in 1..8 {
        let states = [&whole, &parts].map(|scene| step(scene, ball(scene, 0.05 * t as f32, 0.0)));
        assert_eq!(bits(&states[0]), bits(&states[1]), "step {t}");
        assert_eq!(parts.stats().substeps, 0);
    }
}

#[test]
fn a_snapshot_resumes_them_to_the_bit() {
    let model = model("tiny-corrected");
    for at in [2, 5, 9, 12] {
        let first = scene(&model, &with(4, 0.002));
        programme(&first, 0..at);
        let saved = first.save().unwrap();
        let wanted = programme(&first, at..16);
        first.restore(&saved).unwrap();
        assert!(programme(&first, at..16) == wanted, "after step {at}");
        let second = scene(&model, &with(4, 0.002));
        second.restore(&saved).unwrap();
        assert!(programme(&second, at..16) == wanted, "after step {at}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let model = model("tiny-corrected");
    let made = |threads| {
        let options = SceneOptions {
            threads,
            ..with(3, 0.002)
        };
        programme(&scene(&model, &options), 0..16)
    };
    assert!(made(1) == made(3));
}

#[test]
fn they_cost_nothing_until_a_tool_touches_and_are_counted_then() {
    let model = model("tiny-corrected");
    let [none, some] = [1, 4].map(|substeps| scene(&model, &with(substeps, 0.002)));
    assert_eq!(none.stats().memory_bytes, some.stats().memory_bytes);
    for scene in [&none, &some] {
        step(scene, ball(scene, 0.5, 0.0));
        step(scene, ball(scene, 0.5, 0.0));
    }
    let [none, some] = [&none, &some].map(|scene| scene.stats().memory_bytes);
    assert!(
        some > none + 6 * 12 * model.mesh.node_count() as u64,
        "{none} {some}"
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let model = model("tiny-corrected");
    let refused = |options: SceneOptions| match Scene::new(model.clone(), &options) {
        Err(Error::Argument(message)) => message,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("accepted"),
    };
    assert!(refused(with(9, 0.02)).contains("at most 8"));
    let fixed = SceneOptions {
        corrections: Corrections::Fixed(5),
        ..with(4, 0.0)
    };
    assert!(refused(fixed).contains("target"));
    let none = SceneOptions {
        corrections: Corrections::None,
        ..with(4, 0.0)
    };
    assert!(refused(none).contains("corrections"));
}

#[test]
fn tissue_that_a_tool_lets_go_swings_as_in_shorter_steps() {
    let model = model("tiny-corrected");
    let [whole, parts] = [1, 4].map(|substeps| scene(&model, &with(substeps, 0.002)));
    let short = SceneOptions {
        step_s: 0.0125,
        ..with(1, 0.0005)
    };
    let short = scene(&model, &short);
    // Pressed within four steps, held for four, and away within a quarter of a step.
    let depth = |time: f32| match time {
        ..4.0 => 0.5 * time,
        ..8.0 => 2.0,
        _ => 2.0 - 40.0 * (time - 8.0),
    };
    let mut errors = [0.0f32; 2];
    let mut made = Vec::new();
    for t in 1..=14 {
        let mut wanted = Vec::new();
        for part in 1..=4 {
            let time = (t - 1) as f32 + 0.25 * part as f32;
            wanted = step(&short, ball(&short, depth(time), 0.0));
        }
        for (sum, scene) in errors.iter_mut().zip([&whole, &parts]) {
            let state = step(scene, ball(scene, depth(t as f32), 0.0));
            if t > 9 {
                *sum += error(&state, &wanted);
            }
        }
        if t > 9 {
            assert_eq!(whole.stats().evaluations, 0, "the learned part's step");
            made.push(parts.stats().substeps);
        }
    }
    assert_eq!(made[0], 4, "{made:?}");
    assert!(errors[1] < 0.7 * errors[0], "{errors:?}");
}
