//! Sleep, sampling and snapshots; the worker is in `worker.rs`.

mod relaxation;
mod worker;

use fixture::{BUNDLES, bits, largest_difference, model, plain, push, rollout, scene, sparse};
use sha2::{Digest, Sha256};
use upt::scene::{QUIET_DISPLACEMENT, QUIET_STEPS};
use upt::{Contact, Corrections, Error, Loads, SceneOptions, StepInput};

const FREE: StepInput<'static> = StepInput {
    displacement: None,
    contact: Contact::None,
    loads: Loads::NONE,
    time_s: 0.0,
};

#[test]
fn a_reduced_scene_falls_asleep_and_wakes_at_once() {
    let model = model("tiny-reduced");
    let options = SceneOptions {
        sleep: true,
        ..plain()
    };
    let scene = scene(&model, &options);
    let contact = push(&model, 2);
    scene.step(sparse(&contact), None).unwrap();
    let mut out = vec![1.0; 3 * scene.node_count()];
    let mut before = f32::INFINITY;
    let fell_asleep = (0..400)
        .find(|_| {
            scene.step(FREE, Some(&mut out)).unwrap();
            let stats = scene.stats();
            if !stats.sleeping {
                before = stats.max_displacement_mm;
            }
            stats.sleeping
        })
        .expect("the bound of the correction decays, so the scene must come to rest");
    assert!(fell_asleep as u32 >= QUIET_STEPS);
    assert!(before <= QUIET_DISPLACEMENT);
    scene.step(FREE, Some(&mut out)).unwrap();
    assert!(
        out.iter().all(|&u| u == 0.0),
        "a sleeping scene is exactly at rest"
    );
    assert_eq!(scene.stats().decoded_node_count, 0);
    #[cfg(feature = "instruments")]
    scene.contact_force(&mut []).unwrap();
    scene.step(sparse(&contact), Some(&mut out)).unwrap();
    assert!(!scene.stats().sleeping);
    // Waking from exact rest gives what a new scene gives.
    let fresh = fixture::scene(&model, &options);
    let mut first = out.clone();
    fresh.step(sparse(&contact), Some(&mut first)).unwrap();
    assert_eq!(bits(&out), bits(&first));
}

#[test]
fn sampling_passes_through_both_states() {
    for name in BUNDLES {
        for cubic_sampling in [false, true] {
            let model = model(name);
            let scene = scene(
                &model,
                &SceneOptions {
                    cubic_sampling,
                    ..plain()
                },
            );
            let states = rollout(&scene, 5);
            let mut out = vec![0.0; states[0].len()];
            scene.sample(0.0, &mut out).unwrap();
            assert_eq!(bits(&out), bits(&states[3]));
            scene.sample(1.0, &mut out).unwrap();
            assert_eq!(bits(&out), bits(&states[4]));
            scene.sample(7.0, &mut out).unwrap();
            assert_eq!(bits(&out), bits(&states[4]), "alpha is clamped");
            scene.sample(0.5, &mut out).unwrap();
            let spread = largest_difference(&states[3], &states[4]);
            assert!(largest_difference(&out, &states[3]) <= 1.3 * spread);
            assert!(largest_difference(&out, &states[4]) <= 1.3 * spread);
            assert!(largest_difference(&out, &states[3]) > 0.0);
            assert_eq!(scene.sample(f64::NAN, &mut out).unwrap_err().status(), -6);
            assert_eq!(scene.sample(0.5, &mut out[1..]).unwrap_err().status(), -2);
        }
    }
}

/// Verifies REQ-031.
#[test]
fn a_snapshot_resumes_to_the_bit() {
    for name in BUNDLES {
        let model = model(name);
        for at in [0, 1, 8, 12] {
            let original = scene(&model, &plain());
            rollout(&original, at);
            let snapshot = original.save().unwrap();
            let resumed = scene(
                &model,
                &SceneOptions {
                    threads: 2,
                    ..plain()
                },
            );
            rollout(&resumed, 3);
            resumed.restore(&snapshot).unwrap();
            for t in at..at + 8 {
                let contact = push(&model, t);
                let mut a = vec![0.0; 3 * original.node_count()];
                let mut b = a.clone();
                original.step(sparse(&contact), Some(&mut a)).unwrap();
                resumed.step(sparse(&contact), Some(&mut b)).unwrap();
                assert_eq!(bits(&a), bits(&b), "{name}: saved after {at}, step {t}");
            }
            assert_eq!(original.stats().step_count, resumed.stats().step_count);
        }
    }
}

/// Verifies REQ-032.
#[test]
fn a_bad_snapshot_is_refused_and_changes_nothing() {
    let (reduced, upt) = (model("tiny-reduced"), model("tiny-upt"));
    let scene = scene(&reduced, &plain());
    rollout(&scene, 5);
    let mut state = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut state).unwrap();
    let snapshot = scene.save().unwrap();
    let other = fixture::scene(&upt, &plain());
    rollout(&other, 2);
    assert_eq!(
        scene.restore(&other.save().unwrap()).unwrap_err().status(),
        -33
    );
    assert_eq!(scene.restore(&[]).unwrap_err().status(), -33);
    for at in (0..snapshot.len()).step_by(7) {
        let mut damaged = snapshot.clone();
        damaged[at] ^= 0x41;
        let status = scene.restore(&damaged).unwrap_err().status();
        assert!(status == -33 || status == -32, "byte {at}: {status}");
    }
    for length in [1, 8, 40, snapshot.len() - 1] {
        assert_eq!(
            scene.restore(&snapshot[..length]).unwrap_err().status(),
            -33
        );
    }
    let mut after = state.clone();
    scene.read(&mut after).unwrap();
    assert_eq!(bits(&state), bits(&after));
    scene.restore(&snapshot).unwrap();
}

/// A snapshot with another body, and the checksum of that.
fn sealed(body: &[u8]) -> Vec<u8> {
    [body, &Sha256::digest(body)].concat()
}

#[test]
fn a_snapshot_that_ends_early_is_refused_wherever_it_ends() {
    for name in BUNDLES {
        let scene = scene(&model(name), &plain());
        rollout(&scene, 5);
        let saved = scene.save().unwrap();
        let body = &saved[..saved.len() - 32];
        // Behind magic and version.
        for length in (12..body.len()).step_by(1 + body.len() / 400) {
            let error = scene.restore(&sealed(&body[..length])).unwrap_err();
            assert_eq!(error.status(), -33, "{name}, {length} bytes: {error}");
        }
        let longer = [body, &[0]].concat();
        let error = scene.restore(&sealed(&longer)).unwrap_err();
        assert!(error.to_string().contains("too many"), "{error}");
        assert_eq!(saved, scene.save().unwrap(), "{name}: nothing has changed");
    }
}

#[test]
fn a_snapshot_of_another_build_or_of_other_corrections_says_so() {
    let model = model("tiny-corrected");
    let with = |corrections| {
        let options = SceneOptions {
            corrections,
            ..plain()
        };
        let scene = scene(&model, &options);
        rollout(&scene, 5);
        scene
    };
    let [corrected, plain] = [Corrections::Fixed(3), Corrections::None].map(with);
    let saved = corrected.save().unwrap();
    let mut older = saved[..saved.len() - 32].to_vec();
    older[8] -= 1;
    let error = corrected.restore(&sealed(&older)).unwrap_err();
    assert!(matches!(error, Error::Version(_)), "{error}");
    for (scene, of) in [(&plain, &corrected), (&corrected, &plain)] {
        let own = scene.save().unwrap();
        let error = scene.restore(&of.save().unwrap()).unwrap_err();
        assert!(error.to_string().contains("`corrections`"), "{error}");
        assert_eq!(own, scene.save().unwrap(), "nothing has changed");
    }
}
