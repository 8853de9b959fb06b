//! Steps on a scene's worker: the same states as the host's own, no error lost, no call that waits.

use std::time::Duration;

use upt::{Contact, Error, Progress, SceneOptions};

use super::FREE;
use fixture::{BUNDLES, bits, model, plain, push, scene, sparse};

/// Longer than any machine takes for a step.
const FOREVER: Duration = Duration::from_secs(86_400);

/// Verifies REQ-036.
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
            background
                .submit(Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                })
                .unwrap();
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
            let error = background
                .submit(Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                })
                .unwrap_err();
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
/// Verifies REQ-036.
#[test]
fn an_error_that_was_not_told_is_never_lost() {
    let model = model("tiny-upt");
    for latest_wins in [false, true] {
        let options = SceneOptions {
            latest_wins,
            sleep: false,
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
        scene
            .submit(Contact::Sparse {
                nodes: &bad.0,
                vectors: &bad.1,
            })
            .unwrap();
        settle();
        for _ in 0..3 {
            scene
                .submit(Contact::Sparse {
                    nodes: &good.0,
                    vectors: &good.1,
                })
                .unwrap();
            settle();
        }
        scene
            .submit(Contact::Sparse {
                nodes: &bad.0,
                vectors: &bad.1,
            })
            .unwrap();
        settle();
        scene
            .submit(Contact::Sparse {
                nodes: &good.0,
                vectors: &good.1,
            })
            .unwrap();
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
        scene
            .submit(Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            })
            .unwrap();
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
        scene
            .submit(Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            })
            .unwrap();
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
            scene
                .submit(Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                })
                .unwrap();
        }
        while scenes.iter().any(|scene| scene.stats().step_count < STEPS) {
            for (scene, started) in scenes.iter().zip(&mut started) {
                if scene.poll().unwrap() == Progress::Done && *started < STEPS {
                    scene
                        .submit(Contact::Sparse {
                            nodes: &nodes,
                            vectors: &vectors,
                        })
                        .unwrap();
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

/// Verifies REQ-036.
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
