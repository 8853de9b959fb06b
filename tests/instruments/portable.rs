//! The same bits on every instruction set that this machine has: each in a process of its own, since a process keeps to one.

use super::cuts::slit;
use super::relaxing::liver_that_relaxes;
use super::*;
use lanes::Isa;
use sha2::{Digest, Sha256};
use upt::{Error, Model, ModelOptions};

/// Set in the processes that print what they computed.
const CHILD: &str = "UPT_TEST_PORTABLE";

fn options() -> ModelOptions {
    ModelOptions {
        threads: 2,
        portable: true,
        ..ModelOptions::default()
    }
}

/// Of the liver that ships, and of tissue that relaxes by Ogden's law.
fn rollouts() -> String {
    fixture::find_runtime();
    let path = &fixture::shipped("liver-coarse");
    let model = Model::open(path, &options()).unwrap();
    let (_folder, relaxing) = liver_that_relaxes(Some(-12.0), &options());
    rollout(model) + &rollout(relaxing)
}

/// Two tools with friction, one of them turning, that press and slide, substeps, a cut, a step under gravity and what is saved: SHA-256 of it.
fn rollout(model: std::sync::Arc<Model>) -> String {
    let corrections = Corrections::Auto {
        most: 8,
        target_mm: 0.02,
        budget_us: 0,
    };
    let options = SceneOptions {
        corrections,
        substeps: 3,
        ..SceneOptions::default()
    };
    let scene = Scene::new(model, &options).unwrap();
    let (at, normal) = site(&scene);
    let along = normal.any_orthonormal_vector();
    let mut hash = Sha256::new();
    for t in 0..9 {
        let mut first = pressing(&scene, 1.5 * t.min(4) as f32, along * (0.8 * t as f32));
        first.friction = 0.4;
        let shape = Shape::Capsule {
            half_length: 5.0,
            radius: 2.5,
        };
        let (sine, cosine) = (0.05 * t as f32, (1.0 - (0.05 * t as f32).powi(2)).sqrt());
        let place = Vector::from(at) + normal * (4.0 - 0.7 * t as f32) - along * 14.0;
        let mut second = Tool::new(&shape, place.to_array(), [sine, 0.0, 0.0, cosine]).unwrap();
        second.friction = 0.2;
        hash.update(bytemuck(&step(&scene, &[first, second])));
        let forces = readings(&scene)
            .into_iter()
            .flat_map(|reading| reading.force);
        hash.update(bytemuck(&forces.collect::<Vec<f32>>()));
        if t == 5 {
            scene.cut(0, 2, &slit(&scene, 6.0, 12.0)).unwrap();
        }
    }
    assert!(scene.stats().max_displacement_mm > 1.0, "they press");
    hash.update(scene.save().unwrap());
    format!("{:x}", hash.finalize())
}

fn bytemuck(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Verifies REQ-094.
#[test]
fn a_portable_model_has_the_same_bits_on_every_instruction_set() {
    let own = rollouts();
    if std::env::var_os(CHILD).is_some() {
        println!("portable {own}");
        return;
    }
    let sets = Isa::available()
        .into_iter()
        .filter(|isa| !isa.is_portable());
    for isa in sets {
        let name = "portable::a_portable_model_has_the_same_bits_on_every_instruction_set";
        let child = std::process::Command::new(std::env::current_exe().unwrap())
            .args([name, "--exact", "--nocapture"])
            .env("UPT_ISA", isa.name())
            .env(CHILD, "1")
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&child.stdout);
        println!("{}: {}", isa.name(), text.contains(&own));
        assert!(
            text.contains(&format!("portable {own}")),
            "{isa:?}: {text}, here {own}"
        );
    }
}

#[test]
fn what_cannot_be_portable_is_refused() {
    fixture::find_runtime();
    for name in ["tiny-upt", "tiny-reduced"] {
        let refused = Model::open(&fixture::path(name), &options());
        assert!(
            matches!(&refused, Err(Error::Unsupported(text)) if text.contains("portable")),
            "{name}"
        );
    }
    let model = Model::open(&fixture::shipped("liver-coarse"), &options()).unwrap();
    let timed = SceneOptions {
        corrections: Corrections::RecommendedWithin { budget_us: 1000 },
        ..SceneOptions::default()
    };
    let refused = Scene::new(model, &timed);
    assert!(matches!(refused, Err(Error::Argument(text)) if text.contains("portable")));
}
