//! Scenes whose tissue is damped otherwise than the bundle says: what they refuse, and that they swing as long as they should.

use fixture::{bits, model, plain, scene};
use upt::{Contact, Corrections, Error, Scene, SceneOptions};

fn damped(damping_per_s: f64) -> SceneOptions {
    SceneOptions {
        corrections: Corrections::Fixed(8),
        damping_per_s,
        ..plain()
    }
}

/// A node of the domain is pulled by 1 mm within 0.2 s, held to the step 8, and let go.
fn step(scene: &Scene, index: usize, u: &mut [f32]) {
    let node = scene.mesh().domain.nodes[0];
    let vector = [0.0, 0.0, 0.25 * index.min(4) as f32];
    let (nodes, vectors): (&[u32], &[f32]) = match index <= 8 {
        true => (&[node], &vector),
        false => (&[], &[]),
    };
    scene
        .step(Contact::Sparse { nodes, vectors }, Some(u))
        .unwrap();
}

/// Mean square of the displacements of steps `from..to` of the programme, mm².
fn energy(options: &SceneOptions, from: usize, to: usize) -> f32 {
    let scene = scene(&model("tiny-corrected"), options);
    let mut u = vec![0.0; 3 * scene.node_count()];
    let mut sum = 0.0;
    for index in 1..to {
        step(&scene, index, &mut u);
        if index >= from {
            sum += u.iter().map(|x| x * x).sum::<f32>() / u.len() as f32;
        }
    }
    sum
}

#[test]
fn what_cannot_be_is_refused() {
    let model = model("tiny-corrected");
    let refused = |options: &SceneOptions| Scene::new(model.clone(), options).err().unwrap();
    for damping in [0.009, 1001.0, -3.0] {
        let error = refused(&damped(damping));
        assert!(matches!(error, Error::Argument(_)), "{damping}: {error}");
        assert!(error.to_string().contains("damping_per_s"), "{error}");
    }
    for damping in [f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(&damped(damping)), Error::NonFinite(_)));
    }
    let learned = SceneOptions {
        corrections: Corrections::None,
        ..damped(0.5)
    };
    let error = refused(&learned);
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    assert!(error.to_string().contains("damping_per_s"), "{error}");
}

#[test]
fn the_bundles_own_damping_changes_no_bit() {
    let model = model("tiny-corrected");
    let own = model.manifest.material.damping_per_s;
    let (a, b) = (scene(&model, &damped(0.0)), scene(&model, &damped(own)));
    let mut u = [vec![0.0; 3 * a.node_count()], vec![0.0; 3 * a.node_count()]];
    for index in 1..20 {
        step(&a, index, &mut u[0]);
        step(&b, index, &mut u[1]);
        assert!(bits(&u[0]) == bits(&u[1]), "step {index}");
    }
}

/// From 0.8 s after a release on, tissue with a tenth of the damping swings far more than the bundle's, and one with ten times the damping
/// hardly at all.
#[test]
fn less_damping_swings_longer() {
    let own = model("tiny-corrected").manifest.material.damping_per_s;
    let energies = [0.1, 1.0, 10.0].map(|part| energy(&damped(part * own), 24, 44));
    assert!(energies[0] > 3.0 * energies[1], "{energies:?}");
    assert!(energies[2] < energies[1], "{energies:?}");
}

#[test]
fn a_snapshot_goes_on_to_the_bit_and_only_at_its_own_damping() {
    let model = model("tiny-corrected");
    let first = scene(&model, &damped(0.5));
    let mut u = vec![0.0; 3 * first.node_count()];
    for index in 1..12 {
        step(&first, index, &mut u);
    }
    let saved = first.save().unwrap();
    let other = scene(&model, &damped(0.5));
    other.restore(&saved).unwrap();
    let mut v = u.clone();
    for index in 12..24 {
        step(&first, index, &mut u);
        step(&other, index, &mut v);
        assert!(bits(&u) == bits(&v), "step {index}");
    }
    let error = scene(&model, &damped(0.25)).restore(&saved).err().unwrap();
    assert!(matches!(error, Error::Snapshot(_)));
    assert!(error.to_string().contains("damping_per_s"), "{error}");
}

#[test]
fn threads_change_no_bit() {
    let model = model("tiny-corrected");
    let run = |threads| {
        let options = SceneOptions {
            threads,
            ..damped(0.5)
        };
        let scene = scene(&model, &options);
        let mut u = vec![0.0; 3 * scene.node_count()];
        (1..20).for_each(|index| step(&scene, index, &mut u));
        bits(&u)
    };
    assert!(run(1) == run(3));
}
