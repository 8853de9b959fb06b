//! Damaged bytes of bundles and snapshots: an error, or what the undamaged bytes give; never a crash.

mod explore;

use std::path::Path;
use std::sync::Arc;

use explore::{Budget, explore};
use fixture::{
    BUNDLES, bits, copy_of, find_runtime, plain, push, renew_hash, rollout, scene, sparse,
};
use proptest::collection::vec;
use proptest::prelude::{Strategy, any};
use sha2::{Digest, Sha256};
use upt::{IndexSet, Model, ModelOptions, Scene};

/// One damage: where (a part of the length, half of them in the head of the file), and what.
#[derive(Debug, Clone)]
struct Damage {
    place: u32,
    head: bool,
    byte: u8,
    /// 0: overwrite; 1: cut off from here; 2: insert.
    how: u8,
}

/// The three tests together take about half the time that the calls of `fuzz_abi.rs` take.
fn budget(round: u32) -> Budget {
    Budget {
        share: 1.0 / 6.0,
        round,
        least_rounds: 3,
    }
}

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    let one =
        (any::<u32>(), any::<bool>(), any::<u8>(), 0u8..10).prop_map(|(place, head, byte, how)| {
            Damage {
                place,
                head,
                byte,
                how: how.saturating_sub(7),
            }
        });
    vec(one, 1..4)
}

fn apply(damages: &[Damage], bytes: &mut Vec<u8>) {
    for damage in damages {
        let limit = if damage.head {
            bytes.len().min(600)
        } else {
            bytes.len()
        };
        if limit == 0 {
            return;
        }
        let at = damage.place as usize % limit;
        match damage.how {
            0 => bytes[at] = damage.byte,
            1 => bytes.truncate(at),
            _ => bytes.insert(at, damage.byte),
        }
    }
}

fn files(bundle: &str) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(fixture::path(bundle))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn open(folder: &Path) -> upt::Result<Arc<Model>> {
    Model::open(folder, &ModelOptions::default())
}

/// Four steps; what corrections need is read when their scene is made.
fn steps(model: &Arc<Model>) -> upt::Result<Vec<Vec<u32>>> {
    let fields = rollout(&upt::Scene::new(Arc::clone(model), &plain())?, 4);
    Ok(fields.iter().map(|field| bits(field)).collect())
}

#[test]
fn a_damaged_file_of_a_bundle_is_refused_or_gives_the_same_steps() {
    find_runtime();
    let targets: Vec<(&str, String, Vec<Vec<u32>>)> = BUNDLES
        .iter()
        .flat_map(|&bundle| {
            let wanted = steps(&open(&fixture::path(bundle)).unwrap()).unwrap();
            files(bundle)
                .into_iter()
                .map(move |file| (bundle, file, wanted.clone()))
        })
        .collect();
    let cases = (0..targets.len(), damages());
    explore("damaged files", budget(100), &cases, |(target, damages)| {
        let (bundle, file, wanted) = &targets[target];
        let folder = copy_of(bundle);
        let path = folder.path().join(file);
        let mut bytes = std::fs::read(&path).unwrap();
        apply(&damages, &mut bytes);
        std::fs::write(&path, &bytes).unwrap();
        match open(folder.path()).and_then(|model| steps(&model)) {
            Err(error) => assert!(matches!(error.status(), -39..=-20 | -8), "{file}: {error}"),
            Ok(found) => assert_eq!(&found, wanted, "{file}"),
        }
    });
}

/// Verifies REQ-005.
#[test]
fn damage_that_the_hash_does_not_show_is_an_error_or_a_model_that_steps() {
    find_runtime();
    // Graphs are left to their hash: beyond it they are ONNX Runtime's to judge.
    let targets: Vec<(&str, String)> = BUNDLES
        .iter()
        .flat_map(|&bundle| files(bundle).into_iter().map(move |file| (bundle, file)))
        .filter(|(_, file)| file.ends_with(".safetensors"))
        .collect();
    let cases = (0..targets.len(), damages());
    explore(
        "damaged tensors",
        budget(100),
        &cases,
        |(target, damages)| {
            let (bundle, file) = &targets[target];
            let folder = copy_of(bundle);
            let path = folder.path().join(file);
            let mut bytes = std::fs::read(&path).unwrap();
            apply(&damages, &mut bytes);
            std::fs::write(&path, &bytes).unwrap();
            renew_hash(folder.path(), file, &bytes);
            match open(folder.path()) {
                Err(error) => assert!(matches!(error.status(), -39..=-20), "{file}: {error}"),
                Ok(model) => drop(steps_or_error(&model)),
            }
        },
    );
}

/// Steps a model of unknown worth: what is published is finite, what fails has a typed error.
fn steps_or_error(model: &Arc<Model>) -> upt::Result<()> {
    let scene = Scene::new(Arc::clone(model), &plain())?;
    let surface = model.indices(IndexSet::SurfaceNodes);
    for depth in 1..4 {
        let nodes: Vec<u32> = surface.iter().copied().take(4).collect();
        let vectors = [0.1, 0.0, -0.3 * depth as f32].repeat(nodes.len());
        let mut out = vec![0.0; 3 * scene.node_count()];
        match scene.step(sparse(&(nodes, vectors)), Some(&mut out)) {
            Ok(()) => assert!(out.iter().all(|x| x.is_finite())),
            Err(error) => assert_ne!(error.status(), -90, "{error}"),
        }
    }
    Ok(())
}

/// Verifies REQ-032.
#[test]
fn a_damaged_snapshot_is_refused_or_restores_what_it_holds() {
    let subjects: Vec<(Scene, Vec<u8>)> = BUNDLES
        .iter()
        .map(|name| {
            let scene = scene(&fixture::model(name), &plain());
            rollout(&scene, 12);
            let snapshot = scene.save().unwrap();
            (scene, snapshot)
        })
        .collect();
    let cases = (0..subjects.len(), damages(), any::<bool>());
    explore(
        "damaged snapshots",
        budget(500),
        &cases,
        |(subject, damages, renew)| {
            let (scene, good) = &subjects[subject];
            scene.restore(good).unwrap();
            let mut bytes = good.clone();
            apply(&damages, &mut bytes);
            let body = bytes.len().saturating_sub(32);
            if renew {
                let digest = Sha256::digest(&bytes[..body]);
                bytes.truncate(body);
                bytes.extend(digest);
            }
            match scene.restore(&bytes) {
                Err(error) => {
                    assert!(matches!(error.status(), -33 | -32), "{error}");
                    assert!(
                        scene.save().unwrap() == *good,
                        "a refused snapshot changed the scene"
                    );
                }
                Ok(()) if !renew => assert!(bytes == *good, "accepted without a matching checksum"),
                Ok(()) => {
                    let mut out = vec![0.0; 3 * scene.node_count()];
                    scene.read(&mut out).unwrap();
                    assert!(out.iter().all(|x| x.is_finite()));
                    let contact = push(scene.model(), 3);
                    match scene.step(sparse(&contact), Some(&mut out)) {
                        Ok(()) => assert!(out.iter().all(|x| x.is_finite())),
                        Err(error) => assert_ne!(error.status(), -90, "{error}"),
                    }
                }
            }
        },
    );
}
