//! Sleep, sampling, snapshots and the worker.

mod fixture;

use std::time::Duration;

use fixture::{BUNDLES, bits, largest_difference, model, plain, push, rollout, scene, sparse};
use sha2::{Digest, Sha256};
use upt::scene::{QUIET_DISPLACEMENT, QUIET_STEPS};
use upt::{Contact, Corrections, Error, Progress, SceneOptions, StepInput};

/// Longer than any machine takes for a step.
const FOREVER: Duration = Duration::from_secs(86_400);
const FREE: StepInput<'static> = StepInput {
    displacement: None,
    contact: Contact::None,
};

#[test]
fn a_reduced_scene_falls_asleep_and_wakes_at_once() {
    let model = model("tiny-reduced");
    let options = SceneOptions {
        no_sleep: false,
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
    #[cfg(feature = "forces")]
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

#[test]
fn the_worker_gives_what_the_host_would_get() {
    for name in BUNDLES {
        let model = model(name);
        let (direct, background) = (scene(&model, &plain()), scene(&model, &plain()));
        assert_eq!(
            background.poll().unwrap_err().status(),
            -7,
            "nothing submitted"
        );
        for t in 0..12 {
            let (nodes, vectors) = push(&model, t);
            background.submit(&nodes, &vectors).unwrap();
            // Reading is allowed at any time and never waits for the step.
            let mut seen = vec![0.0; 3 * background.node_count()];
            background.read(&mut seen).unwrap();
            background.sample(0.5, &mut seen).unwrap();
            background.stats();
            assert_eq!(background.wait(FOREVER).unwrap(), Progress::Done);
            assert_eq!(background.poll().unwrap(), Progress::Done);
            let mut want = seen.clone();
            direct
                .step(sparse(&(nodes, vectors)), Some(&mut want))
                .unwrap();
            background.read(&mut seen).unwrap();
            assert_eq!(bits(&seen), bits(&want), "{name} step {t}");
        }
        // What is wrong with an input is told by the submit, and the state stays.
        let mut before = vec![0.0; 3 * background.node_count()];
        background.read(&mut before).unwrap();
        let count = background.node_count();
        for (nodes, vectors) in [
            (vec![u32::MAX], vec![0.0; 3]),
            (vec![count as u32], vec![0.0; 3]),
            (vec![5, 5], vec![0.0; 6]),
            (vec![5], vec![f32::NAN, 0.0, 0.0]),
            (vec![5], vec![1e7, 0.0, 0.0]),
            (vec![5], vec![0.0; 2]),
            ((0..=count as u32).collect(), vec![0.0; 3 * count + 3]),
        ] {
            let error = background.submit(&nodes, &vectors).unwrap_err();
            assert!(matches!(error.status(), -2 | -6), "{error}");
        }
        assert_eq!(background.poll().unwrap(), Progress::Done);
        let mut after = before.clone();
        background.read(&mut after).unwrap();
        assert_eq!(bits(&after), bits(&before));
    }
}

/// A push that the guard refuses under its default policy.
fn refused(model: &upt::Model) -> (Vec<u32>, Vec<f32>) {
    let (nodes, _) = push(model, 0);
    let vectors = nodes.iter().flat_map(|_| [0.0, 0.0, -900.0]).collect();
    (nodes, vectors)
}

/// The error of a submitted step is told once, however many submits lie between.
#[test]
fn an_error_that_was_not_told_is_never_lost() {
    let model = model("tiny-upt");
    for latest_wins in [false, true] {
        let options = SceneOptions {
            latest_wins,
            no_sleep: true,
            ..SceneOptions::default()
        };
        let scene = scene(&model, &options);
        let settle = || {
            let made = scene.stats().step_count;
            while scene.reset().is_err() {
                std::thread::yield_now();
            }
            made
        };
        let (bad, good) = (refused(&model), push(&model, 1));
        scene.submit(&bad.0, &bad.1).unwrap();
        settle();
        for _ in 0..3 {
            scene.submit(&good.0, &good.1).unwrap();
            settle();
        }
        scene.submit(&bad.0, &bad.1).unwrap();
        settle();
        scene.submit(&good.0, &good.1).unwrap();
        let error = scene.wait(FOREVER).unwrap_err();
        assert!(matches!(error, Error::Guard(_)), "{error}");
        assert!(error.to_string().contains("1 later"), "{error}");
        assert_eq!(scene.wait(FOREVER).unwrap(), Progress::Done);
        assert_eq!(scene.poll().unwrap(), Progress::Done);
    }
}

/// A host that submits in every frame is told of new states all the same.
#[test]
fn steady_submits_under_latest_wins_are_told_of_finished_steps() {
    const STEPS: u64 = 60;
    let model = model("tiny-upt");
    let options = SceneOptions {
        latest_wins: true,
        ..plain()
    };
    let scene = scene(&model, &options);
    let (nodes, vectors) = push(&model, 3);
    let mut told = 0;
    while scene.stats().step_count < STEPS {
        scene.submit(&nodes, &vectors).unwrap();
        told += u64::from(scene.poll().unwrap() == Progress::Done);
    }
    // Between two polls at most the step that ran, the one that waited and the new one can finish.
    assert!(told >= STEPS / 3 - 2, "told {told} times of {STEPS} steps");
    assert!(told <= scene.stats().step_count + 1);
}

#[test]
fn the_latest_input_wins_where_asked() {
    let model = model("tiny-upt");
    let scene = scene(
        &model,
        &SceneOptions {
            latest_wins: true,
            ..plain()
        },
    );
    let (nodes, _) = push(&model, 0);
    for k in 0..200 {
        let vectors: Vec<f32> = nodes
            .iter()
            .flat_map(|_| [0.0, 0.0, -0.01 * k as f32])
            .collect();
        scene.submit(&nodes, &vectors).unwrap();
    }
    assert_eq!(scene.wait(FOREVER).unwrap(), Progress::Done);
    let mut out = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut out).unwrap();
    assert_eq!(out[3 * nodes[0] as usize + 2], -1.99);
    assert!(scene.stats().step_count <= 200);
}

/// A host that never waits asks eight scenes in turn and gives those that are done their next step: each goes on, and all
/// end in the same state. How many steps each has made by then is the system's choice.
#[test]
fn eight_scenes_on_one_model_go_on_beside_each_other() {
    const STEPS: u64 = 1000;
    for name in BUNDLES {
        let model = model(name);
        let scenes: Vec<_> = (0..8).map(|_| scene(&model, &plain())).collect();
        let (nodes, vectors) = push(&model, 3);
        let mut started = [1; 8];
        for scene in &scenes {
            scene.submit(&nodes, &vectors).unwrap();
        }
        while scenes.iter().any(|scene| scene.stats().step_count < STEPS) {
            for (scene, started) in scenes.iter().zip(&mut started) {
                if scene.poll().unwrap() == Progress::Done && *started < STEPS {
                    scene.submit(&nodes, &vectors).unwrap();
                    *started += 1;
                }
            }
            std::thread::yield_now();
        }
        let ends: Vec<Vec<u32>> = scenes
            .iter()
            .map(|scene| {
                assert_eq!(scene.wait(FOREVER).unwrap(), Progress::Done);
                let mut out = vec![0.0; 3 * scene.node_count()];
                scene.read(&mut out).unwrap();
                bits(&out)
            })
            .collect();
        assert!(ends.iter().all(|end| *end == ends[0]), "{name}");
        assert_eq!(
            upt::shutdown().unwrap_err().status(),
            -7,
            "models are alive"
        );
    }
}

#[test]
fn concurrent_use_is_busy_and_never_waits() {
    let model = model("tiny-upt");
    let scene = scene(&model, &plain());
    let busy = std::sync::atomic::AtomicUsize::new(0);
    std::thread::scope(|threads| {
        for _ in 0..4 {
            threads.spawn(|| {
                for _ in 0..200 {
                    match scene.step(FREE, None) {
                        Ok(()) => {}
                        Err(Error::Busy(_)) => {
                            busy.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        }
                        Err(error) => panic!("{error}"),
                    }
                }
            });
        }
    });
    let busy = busy.into_inner() as u64;
    assert_eq!(scene.stats().step_count + busy, 800);
}
