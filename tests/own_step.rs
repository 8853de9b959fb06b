//! Scenes whose steps are shorter than the bundle's: what they refuse, and that they are the same tissue.
#![cfg(feature = "instruments")]

use contact::Shape;
use fixture::{bits, model, plain, scene};
use upt::contact::Tool;
use upt::{Contact, Corrections, Error, Model, ModelOptions, Scene, SceneOptions};

const DT: f64 = 0.05;

fn stepping(step_s: f64) -> SceneOptions {
    SceneOptions {
        corrections: Corrections::Fixed(8),
        step_s,
        ..plain()
    }
}

/// A ball of radius 3 mm over the middle of the top, `depth` mm inside of it.
fn ball(scene: &Scene, depth: f64) -> Vec<Tool> {
    let mesh = scene.mesh();
    let place = |node: u32| [0, 1, 2].map(|axis| mesh.positions[3 * node as usize + axis]);
    let nodes = || mesh.domain.nodes.iter().map(|&node| place(node));
    let count = mesh.domain.nodes.len() as f32;
    let middle = [0, 1].map(|axis| nodes().map(|at| at[axis]).sum::<f32>() / count);
    let far = |at: &[f32; 3]| (0..2).map(|k| (at[k] - middle[k]).powi(2)).sum::<f32>();
    let [x, y, z] = nodes().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
    let centre = [x, y, z + 3.0 - depth as f32];
    let shape = Shape::Sphere { radius: 3.0 };
    vec![Tool::new(&shape, centre, [0.0, 0.0, 0.0, 1.0]).unwrap()]
}

/// In within 0.2 s, held until 0.4 s, gone after.
fn depth(seconds: f64) -> f64 {
    match seconds {
        0.0..0.2 => 10.0 * seconds,
        0.2..0.4 => 2.0,
        _ => -20.0,
    }
}

fn step(scene: &Scene, seconds: f64) -> Vec<f32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    let tools = ball(scene, depth(seconds));
    scene.step(Contact::Tools(&tools), Some(&mut u)).unwrap();
    u
}

fn farthest(a: &[f32], b: &[f32]) -> f32 {
    let pairs = a.as_chunks::<3>().0.iter().zip(b.as_chunks::<3>().0);
    let far = |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>();
    pairs.map(|(a, b)| far(a, b)).fold(0.0, f32::max).sqrt()
}

#[test]
fn what_cannot_be_is_refused() {
    let model = model("tiny-corrected");
    let refused = |options: &SceneOptions| Scene::new(model.clone(), options).err().unwrap();
    for step_s in [0.009, 0.051, -0.02, 1.0] {
        assert!(
            matches!(refused(&stepping(step_s)), Error::Argument(_)),
            "{step_s}"
        );
    }
    for step_s in [f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(&stepping(step_s)), Error::NonFinite(_)));
    }
    // A learned map has one length of step.
    let learned = SceneOptions {
        corrections: Corrections::None,
        step_s: 0.02,
        ..plain()
    };
    assert!(matches!(refused(&learned), Error::Unsupported(_)));
    // That of the bundle needs nothing.
    let own = SceneOptions {
        step_s: DT,
        ..learned
    };
    assert!(Scene::new(model.clone(), &own).is_ok());
}

#[test]
fn a_bundle_recommends_a_length_to_those_that_ask() {
    fixture::find_runtime();
    let folder = fixture::copy_of("tiny-corrected");
    let mut manifest = fixture::manifest(folder.path());
    manifest["corrections"]["frame_step_s"] = 0.02.into();
    fixture::write_manifest(folder.path(), &mut manifest);
    let told = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    assert_eq!(told.info().frame_step_s, 0.02);
    assert_eq!(told.info().dt, 0.05);
    // Who does not ask steps as the bundle does; who does gets that length.
    assert!((scene(&told, &plain()).step_s() - DT).abs() < 1e-12);
    let asked = SceneOptions {
        step_s: told.info().frame_step_s,
        ..SceneOptions::default()
    };
    assert!((scene(&told, &asked).step_s() - 0.02).abs() < 1e-12);
    for name in ["tiny-corrected", "tiny-reduced", "tiny-upt"] {
        assert_eq!(model(name).info().frame_step_s, DT, "{name}");
    }
}

#[test]
fn the_bundles_own_length_changes_no_bit() {
    let model = model("tiny-corrected");
    let (a, b) = (scene(&model, &stepping(0.0)), scene(&model, &stepping(DT)));
    for index in 1..14 {
        let seconds = f64::from(index) * DT;
        assert_eq!(bits(&step(&a, seconds)), bits(&step(&b, seconds)));
    }
}

#[test]
fn shorter_steps_are_the_same_tissue() {
    let model = model("tiny-corrected");
    let long = scene(&model, &stepping(0.0));
    let pressed = (1..8)
        .map(|index| step(&long, f64::from(index) * DT))
        .last()
        .unwrap();
    let size = farthest(&pressed, &vec![0.0; pressed.len()]);
    assert!(size > 1.0, "the ball presses: {size}");
    for parts in [2u32, 5] {
        let short = scene(&model, &stepping(DT / f64::from(parts)));
        assert!((short.step_s() - DT / f64::from(parts)).abs() < 1e-12);
        let mut u = Vec::new();
        for index in 1..8 * parts {
            u = step(&short, f64::from(index) * DT / f64::from(parts));
        }
        // At rest under a still tool the equation of motion is the same.
        let apart = farthest(&u, &pressed);
        assert!(apart < 0.05 * size, "{parts} parts: {apart} of {size}");
    }
}

#[test]
fn after_a_release_it_comes_to_rest_and_sleeps() {
    for corrections in [8, 1] {
        let options = SceneOptions {
            sleep: true,
            corrections: Corrections::Fixed(corrections),
            ..stepping(0.01)
        };
        comes_to_rest(&options);
    }
}

fn comes_to_rest(options: &SceneOptions) {
    let model = model("tiny-corrected");
    let scene = scene(&model, options);
    let mut largest = Vec::new();
    for index in 1..=600 {
        let u = step(&scene, 0.01 * f64::from(index));
        assert!(u.iter().all(|x| x.is_finite()));
        largest.push(farthest(&u, &vec![0.0; u.len()]));
    }
    assert!(largest[35] > 1.0);
    let after = &largest[41..];
    let most = largest[..40].iter().copied().fold(0.0, f32::max);
    assert!(after.iter().all(|now| *now < 1.5 * most), "it swings up");
    assert!(scene.stats().sleeping, "{}", largest[599]);
    assert_eq!(largest[599], 0.0);
}

#[test]
fn a_snapshot_goes_on_to_the_bit_and_only_at_its_own_length() {
    let model = model("tiny-corrected");
    let first = scene(&model, &stepping(0.02));
    for index in 1..=23 {
        step(&first, 0.02 * f64::from(index));
    }
    let saved = first.save().unwrap();
    let other = scene(&model, &stepping(0.02));
    other.restore(&saved).unwrap();
    for index in 24..=30 {
        let seconds = 0.02 * f64::from(index);
        assert_eq!(bits(&step(&first, seconds)), bits(&step(&other, seconds)));
    }
    let long = scene(&model, &stepping(0.0));
    assert!(matches!(long.restore(&saved), Err(Error::Snapshot(_))));
}

#[test]
fn threads_change_no_bit() {
    let model = model("tiny-corrected");
    let run = |threads| {
        let scene = scene(
            &model,
            &SceneOptions {
                threads,
                ..stepping(0.025)
            },
        );
        (1..=24)
            .map(|index| bits(&step(&scene, 0.025 * f64::from(index))))
            .last()
    };
    assert_eq!(run(1), run(3));
}

/// Nodes and vectors drive such scenes as well.
#[test]
fn a_collision_field_drives_it_too() {
    let model = model("tiny-corrected");
    let scene = scene(&model, &stepping(0.01));
    let node = scene.mesh().domain.nodes[0];
    let mut u = vec![0.0; 3 * scene.node_count()];
    for index in 1..=60 {
        let pushed = [0.0, 0.0, -0.05 * index.min(20) as f32];
        let (nodes, vectors): (&[u32], &[f32]) = match index <= 30 {
            true => (&[node], &pushed),
            false => (&[], &[]),
        };
        let contact = Contact::Sparse { nodes, vectors };
        scene.step(contact, Some(&mut u)).unwrap();
        let at = &u[3 * node as usize..][..3];
        if index == 30 {
            assert_eq!(at, [0.0, 0.0, -1.0]);
        }
    }
    let size = farthest(&u, &vec![0.0; u.len()]);
    assert!(size < 0.5, "released 0.3 s ago: {size}");
}

/// The natural modes of a fine mesh turn many times in a short step. What is left to BDF2 of them dies away after a release; in closed
/// form they once rang, and single nodes ran away by millimetres.
#[test]
fn a_fine_mesh_comes_to_rest_in_short_steps() {
    let model = model(fixture::shipped("brain-reduced"));
    let options = SceneOptions {
        corrections: Corrections::Fixed(3),
        step_s: 0.01,
        ..SceneOptions::default()
    };
    let scene = Scene::new(model, &options).unwrap();
    let shape = Shape::Sphere { radius: 6.0 };
    let mut largest = 0.0f32;
    for step in 0..170 {
        // 3 mm into the temporal lobe within 0.2 s, then away.
        let x = if step < 20 {
            -68.0 + 0.2 * step as f32
        } else {
            -120.0
        };
        let tool = Tool::new(&shape, [x, -14.0, 8.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        scene.step(Contact::Tools(&[tool]), None).unwrap();
        let stats = scene.stats();
        assert_eq!(
            stats.flags & upt::flag::FELL_BACK,
            0,
            "step {step} fell back"
        );
        if step == 20 {
            largest = stats.max_displacement_mm;
            assert!(largest > 1.0, "the tool pushed {largest} mm");
        }
        if step > 60 {
            let now = stats.max_displacement_mm;
            assert!(now < 0.5 * largest, "step {step}: {now} mm of {largest}");
        }
    }
    let end = scene.stats().max_displacement_mm;
    assert!(end < 0.1, "{end} mm are left after 1.5 s");
}

/// Pulled out of shape until elements invert, and let go: no free motion leads back, and the field dies away.
#[test]
fn what_is_inverted_dies_away_and_does_not_jump() {
    let scene = scene(&model("tiny-corrected"), &stepping(0.01));
    let nodes = scene.mesh().domain.nodes[..4].to_vec();
    let mut u = vec![0.0; 3 * scene.node_count()];
    let rest = u.clone();
    let mut fell_back = 0;
    for index in 0..120 {
        let vectors = [0.0, 0.0, -40.0].repeat(4);
        let (nodes, vectors): (&[u32], &[f32]) = match index < 4 {
            true => (&nodes, &vectors),
            false => (&[], &[]),
        };
        let contact = Contact::Sparse { nodes, vectors };
        let before = u.clone();
        scene.step(contact, Some(&mut u)).unwrap();
        if index >= 4 && scene.stats().flags & upt::flag::FELL_BACK != 0 {
            fell_back += 1;
            let (way, size) = (farthest(&u, &before), farthest(&before, &rest));
            assert!(way < 0.25 * size, "{way} of {size} mm in a step");
        }
    }
    assert!(fell_back > 0, "no free step fell back");
    let left = farthest(&u, &rest);
    assert!(left < 5.0, "released 1.2 s ago: {left} mm");
}
