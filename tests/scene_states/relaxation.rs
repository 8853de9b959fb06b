//! Tissue that relaxes, as a scene's host sees it.

use super::FREE;
use fixture::{bits, plain, push, relaxing, scene, sparse};
use serde_json::json;
use std::sync::Arc;
use upt::{Corrections, IndexSet, Model, Scene, SceneOptions, flag};

/// A fast branch and a slow one; 0.3 of the stress lasts.
fn branches() -> serde_json::Value {
    json!([{"share": 0.4, "tau_s": 0.1}, {"share": 0.3, "tau_s": 1.0}])
}

fn options(step_s: f64) -> SceneOptions {
    SceneOptions {
        corrections: Corrections::Fixed(8),
        step_s,
        ..plain()
    }
}

/// The force of the tissue on the nodes of the push that is held, mN.
fn pressed(scene: &Scene, steps: u32) -> Vec<f32> {
    let contact = push(scene.model(), 3);
    let mut force = vec![0.0; 3 * contact.0.len()];
    for _ in 0..steps {
        scene.step(sparse(&contact), None).unwrap();
    }
    scene.contact_force(&mut force).unwrap();
    force.as_chunks::<3>().0.iter().map(|f| f[2]).collect()
}

fn sum(values: &[f32]) -> f32 {
    values.iter().sum()
}

/// Tissue that is held pushes as stiff tissue at first, and as tissue of what lasts of its modulus in the end.
#[test]
fn a_held_force_falls_to_that_of_what_lasts() {
    let (_a, model) = relaxing(branches(), 1.0);
    let (_b, soft) = relaxing(json!([]), 0.3);
    let (_c, stiff) = relaxing(json!([]), 1.0);
    let wanted = sum(&pressed(&scene(&soft, &options(0.0)), 200));
    let first = sum(&pressed(&scene(&stiff, &options(0.0)), 2));
    for step_s in [0.0, 0.02] {
        let scene = scene(&model, &options(step_s));
        let start = sum(&pressed(&scene, 2));
        assert!((0.5..0.97).contains(&(start / first)), "{start} of {first}");
        let end = sum(&pressed(&scene, if step_s > 0.0 { 500 } else { 200 }));
        let off = (end / wanted - 1.0).abs();
        assert!(off < 0.015, "{step_s}: {end} for {wanted} mN");
        // Most of what pushes back at these nodes is pressure, which stays.
        assert!(end / start < 0.96, "{start} to {end}");
    }
}

/// Verifies REQ-031.
#[test]
fn a_snapshot_goes_on_in_the_middle_of_relaxing() {
    let (_folder, model) = relaxing(branches(), 1.0);
    let options = options(0.0);
    let threads = SceneOptions {
        threads: 3,
        ..options.clone()
    };
    let (own, next) = (scene(&model, &options), scene(&model, &threads));
    pressed(&own, 7);
    next.restore(&own.save().unwrap()).unwrap();
    let node_count = own.node_count();
    let [mut a, mut b] = [vec![0.0; 3 * node_count], vec![0.0; 3 * node_count]];
    let contact = push(&model, 3);
    for step in 0..20 {
        let input = if step < 8 { sparse(&contact) } else { FREE };
        own.step(input, Some(&mut a)).unwrap();
        next.step(input, Some(&mut b)).unwrap();
        assert_eq!(bits(&a), bits(&b), "step {step}");
    }
    assert_eq!(own.save().unwrap(), next.save().unwrap());
    let (_elastic, plain) = relaxing(json!([]), 1.0);
    let elastic = scene(&plain, &options);
    pressed(&elastic, 7);
    assert!(elastic.stats().memory_bytes < own.stats().memory_bytes);
}

/// After a release the tissue creeps back, and comes to rest.
#[test]
fn it_recovers_slower_than_it_springs_back() {
    let (_a, model) = relaxing(branches(), 1.0);
    let (_b, elastic) = relaxing(json!([]), 1.0);
    let after = |model: &Arc<Model>, steps: usize| -> Vec<f32> {
        let options = SceneOptions {
            sleep: true,
            ..options(0.02)
        };
        let scene = scene(model, &options);
        pressed(&scene, 100);
        let moved = |_| {
            scene.step(FREE, None).unwrap();
            scene.stats().max_displacement_mm
        };
        (0..steps).map(moved).collect()
    };
    let (slow, fast) = (after(&model, 600), after(&elastic, 600));
    assert!(
        slow[30] > 0.05 && slow[30] > 3.0 * fast[30],
        "{} {}",
        slow[30],
        fast[30]
    );
    assert!(slow[100] < slow[30], "{} {}", slow[100], slow[30]);
    assert_eq!(slow[599], 0.0, "asleep");
    assert!(!model.indices(IndexSet::DomainNodes).is_empty());
}

/// Without corrections nothing relaxes, and every step says so.
#[test]
fn a_scene_without_corrections_says_that_it_is_elastic() {
    let (_a, model) = relaxing(branches(), 1.0);
    let (_b, elastic) = relaxing(json!([]), 1.0);
    let without = SceneOptions {
        corrections: Corrections::None,
        ..plain()
    };
    for (model, options, said) in [
        (&model, &without, true),
        (&model, &options(0.0), false),
        (&elastic, &without, false),
    ] {
        let scene = scene(model, options);
        for t in 0..6 {
            let contact = push(model, 3);
            let input = if t < 4 { sparse(&contact) } else { FREE };
            scene.step(input, None).unwrap();
            let flags = scene.stats().flags;
            assert_eq!(flags & flag::ELASTIC != 0, said, "step {t}");
        }
    }
    assert!(flag::names(flag::ELASTIC).contains("elastic"));
}
