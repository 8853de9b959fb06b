//! Tissue that relaxes, by Ogden's law and the neo-Hookean one: steps of several lengths, cuts one after the other, snapshots of cut bodies.

use std::sync::Arc;

use super::cuts::{options, slit};
use super::cuts_and_truth::{Operation, compare, errors, press};
use super::regions::mark;
use super::*;
use fixture::{copy_of, relaxing_in, shipped};
use serde_json::json;
use upt::{Model, ModelOptions};

/// The liver with tissue of which a third of the stress lasts.
pub fn liver_that_relaxes(
    alpha: Option<f64>,
    options: &ModelOptions,
) -> (tempfile::TempDir, Arc<Model>) {
    let folder = copy_of(shipped("liver-coarse"));
    let branches = json!([{"share": 0.35, "tau_s": 0.12}, {"share": 0.32, "tau_s": 0.6}]);
    let model = relaxing_in(folder.path(), (branches, 1.0), alpha, options);
    (folder, model)
}

fn open(alpha: Option<f64>) -> (tempfile::TempDir, Arc<Model>) {
    liver_that_relaxes(alpha, &ModelOptions::default())
}

/// The force of a press of 4 mm that is held, mN, every 50 ms.
fn held(model: &Arc<Model>, options: &SceneOptions) -> Vec<f32> {
    let scene = Scene::new(Arc::clone(model), options).unwrap();
    let step_s = if options.step_s > 0.0 {
        options.step_s
    } else {
        0.05
    };
    let every = (0.05 / step_s).round() as usize;
    let mut forces = Vec::new();
    for t in 1..=40 * every {
        let part = (t as f32 / (4 * every) as f32).min(1.0);
        step(&scene, &[pressing(&scene, 4.0 * part, Vector::ZERO)]);
        if t % every == 0 {
            forces.push(size(readings(&scene)[0].force));
        }
    }
    forces
}

#[test]
fn steps_of_every_length_and_substeps_relax_alike() {
    for alpha in [None, Some(-12.0)] {
        let (_folder, model) = open(alpha);
        let fixed = |step_s| SceneOptions { step_s, ..with(10) };
        let fine = held(&model, &fixed(0.01));
        let parts = SceneOptions {
            corrections: Corrections::Auto {
                most: 10,
                target_mm: 0.005,
                budget_us: 0,
            },
            substeps: 4,
            ..plain()
        };
        for (name, options) in [
            ("whole", fixed(0.0)),
            ("short", fixed(0.025)),
            ("substeps", parts),
        ] {
            let own = held(&model, &options);
            for at in [6, 10, 20, 39] {
                let off = own[at] / fine[at] - 1.0;
                // What a step of 50 ms makes of a sudden stop is gone after some frames.
                let most = if at < 10 { 0.06 } else { 0.03 };
                assert!(off.abs() < most, "{name}, frame {at}: {off}");
            }
        }
        let fallen = fine[39] / fine[3];
        assert!((0.3..0.75).contains(&fallen), "{fallen}");
    }
}

/// The liver with the numbers of two regions by height: 1 is `first`, 2 relaxes faster than the material.
fn in_regions(
    material: &serde_json::Value,
    first: &serde_json::Value,
    number: impl Fn(f32) -> i32,
) -> (tempfile::TempDir, Arc<Model>) {
    let folder = copy_of(shipped("liver-coarse"));
    let law = json!({"name": "neo-hookean"});
    let fast = json!([{"share": 0.4, "tau_s": 0.06}, {"share": 0.3, "tau_s": 0.8}]);
    let laws = json!([
        {"name": "lobe", "law": law, "relaxation": first},
        {"name": "soft", "law": law, "relaxation": fast}
    ]);
    mark(folder.path(), number, &laws, &laws);
    let material = (material.clone(), 1.0);
    let model = relaxing_in(folder.path(), material, None, &ModelOptions::default());
    (folder, model)
}

/// A region of the whole body: the material's own relaxation has the material's bits, and in a body that is elastic otherwise it relaxes as that does.
#[test]
fn a_region_relaxes_as_the_material_would() {
    let (_folder, own) = open(None);
    let wanted = held(&own, &with(10));
    let branches = json!([{"share": 0.35, "tau_s": 0.12}, {"share": 0.32, "tau_s": 0.6}]);
    let (_folder, same) = in_regions(&branches, &branches, |_| 1);
    assert_eq!(held(&same, &with(10)), wanted);
    let (_folder, alone) = in_regions(&json!([]), &branches, |_| 1);
    let found = held(&alone, &with(10));
    for at in [3, 6, 10, 20, 39] {
        let off = found[at] / wanted[at] - 1.0;
        let most = if at < 10 { 0.08 } else { 0.02 };
        assert!(off.abs() < most, "frame {at}: {off}");
    }
}

/// Elastic below, slow in the middle, fast where the tool is: two seconds and a half of a held press, with a slit, beside the solver; and a snapshot of it.
#[test]
fn regions_go_on_as_the_solvers_under_a_held_tool() {
    let slow = json!([{"share": 0.3, "tau_s": 0.4}, {"share": 0.2, "tau_s": 5.0}]);
    let number = |share: f32| i32::from(share < 0.4) + 2 * i32::from(share > 0.6);
    let (folder, model) = in_regions(&slow, &json!([]), number);
    let scene = Scene::new(Arc::clone(&model), &options()).unwrap();
    let mut frames = press(&scene, 4.0, 54);
    frames[40].0 = Some(Operation::Cut(slit(&scene, 6.0, 15.0)));
    let mesh = folder.path().join("mesh.safetensors");
    let found = compare(&model, mesh.to_str().unwrap(), &frames);
    let (mean, force) = errors(&found[6..40]);
    println!(
        "{mean} mm², {force}; with a slit {:?}",
        errors(&found[40..])
    );
    assert!(mean < 0.005 && force < 0.05, "{mean} mm², {force}");
    let (mean, force) = errors(&found[40..]);
    assert!(mean < 0.005 && force < 0.08, "{mean} mm², {force}");
    assert!(found[39].2 < 0.9 * found[4].2, "{found:?}");
    // A copy goes on with the same bits.
    for (operation, tool) in &frames[..44] {
        if let Some(Operation::Cut(poses)) = operation {
            scene.cut(0, 2, poses).unwrap();
        }
        step(&scene, std::slice::from_ref(tool));
    }
    let other = Scene::new(Arc::clone(&model), &options()).unwrap();
    other.restore(&scene.save().unwrap()).unwrap();
    let tools = std::slice::from_ref(&frames[44].1);
    for _ in 0..3 {
        assert_eq!(bits(&step(&scene, tools)), bits(&step(&other, tools)));
    }
}

#[test]
fn slits_one_after_the_other_go_on_as_the_solvers() {
    for alpha in [None, Some(-12.0)] {
        let (_folder, model) = open(alpha);
        let scene = Scene::new(Arc::clone(&model), &options()).unwrap();
        let mut frames = press(&scene, 4.0, 36);
        frames[8].0 = Some(Operation::Cut(slit(&scene, 6.0, 15.0)));
        frames[22].0 = Some(Operation::Cut(slit(&scene, -2.5, 20.0)));
        let found = compare(&model, "onnx/liver-coarse/mesh.safetensors", &frames);
        let (mean, force) = errors(&found[6..]);
        assert!(
            mean < 0.005 && force < 0.08,
            "{alpha:?}: {mean} mm², {force}"
        );
        let fallen = [found[35].1 / found[3].1, found[35].2 / found[3].2];
        assert!(fallen[0] < 0.75, "{fallen:?}");
    }
}

/// What the lips of a slit have been strained with since they parted stays theirs when the body changes again: here into itself.
#[test]
fn a_change_elsewhere_changes_nothing_that_lips_remember() {
    let (_folder, model) = open(None);
    let scenes = [0; 2].map(|_| Scene::new(Arc::clone(&model), &with(20)).unwrap());
    let tool = pressing(&scenes[0], 5.0, Vector::ZERO);
    // Both lips stem from the same elements; one is pressed.
    for scene in &scenes {
        step(scene, &[pressing(scene, 0.5, Vector::ZERO)]);
        scene.cut(0, 2, &slit(scene, 2.0, 15.0)).unwrap();
        for _ in 0..16 {
            step(scene, std::slice::from_ref(&tool));
        }
    }
    scenes[1].scale_stiffness(&[0], 1.0).unwrap();
    let away = pressing(&scenes[0], -30.0, Vector::ZERO);
    for t in 0..12 {
        let [one, other] = scenes.each_ref().map(|scene| {
            let tool = if t < 4 { &tool } else { &away };
            step(scene, std::slice::from_ref(tool))
        });
        let off = fixture::largest_difference(&one, &other);
        assert!(off < 0.005, "step {t}: {off} mm");
    }
}

#[test]
fn snapshots_of_a_cut_body_go_on_in_the_middle_of_relaxing() {
    let (_folder, model) = open(None);
    let scene = Scene::new(Arc::clone(&model), &options()).unwrap();
    let tool = pressing(&scene, 4.0, Vector::ZERO);
    let tools = std::slice::from_ref(&tool);
    (0..6).for_each(|_| drop(step(&scene, tools)));
    let whole = scene.save().unwrap();
    let uncut = step(&scene, tools);
    scene.restore(&whole).unwrap();
    scene.cut(0, 2, &slit(&scene, 6.0, 12.0)).unwrap();
    (0..3).for_each(|_| drop(step(&scene, tools)));
    let parted = scene.save().unwrap();
    let next = step(&scene, tools);
    let threads = SceneOptions {
        threads: 2,
        ..options()
    };
    let other = Scene::new(Arc::clone(&model), &threads).unwrap();
    other.restore(&parted).unwrap();
    assert_eq!(bits(&step(&other, tools)), bits(&next));
    scene.cut(1, 2, &slit(&scene, -4.0, 18.0)).unwrap();
    other.cut(1, 2, &slit(&other, -4.0, 18.0)).unwrap();
    for _ in 0..3 {
        assert_eq!(bits(&step(&scene, tools)), bits(&step(&other, tools)));
    }
    other.restore(&whole).unwrap();
    assert_eq!(bits(&step(&other, tools)), bits(&uncut));
}
