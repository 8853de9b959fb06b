//! A ball that dents the tissue between its samples: a hand keeps it until the next step.

use super::*;
use upt::{Model, ModelOptions};

/// Of the ball, mm, and of a step, s.
const RADIUS: f32 = 1.11;
const STEP_S: f64 = 0.02;

/// 200 mm/s into a fold of the brain and then still: the samples about the ball slide off it sideways, which is no reason to feel nothing
/// for the rest of a step.
#[test]
fn a_small_ball_that_has_stopped_is_felt_in_each_millisecond() {
    let model = Model::open(&fixture::shipped("brain"), &ModelOptions::default()).unwrap();
    let options = SceneOptions {
        step_s: STEP_S,
        ..SceneOptions::default()
    };
    let scene = Scene::new(model, &options).unwrap();
    let (far, end) = ([-68.37, -62.41, 19.454f32], [-59.867, -51.704, 19.58f32]);
    let height = |step: f64| [-10.0, -6.0, -2.0, 2.0, 3.672][(step as usize).min(4)] + 10.0;
    let place = |step: f64| {
        let (low, high) = (height(step.floor()), height(step.floor() + 1.0));
        let part = (low + (high - low) * step.fract()) / 13.672;
        [0, 1, 2].map(|k| far[k] + (end[k] - far[k]) * part as f32)
    };
    let ball = |step: f64| {
        let shape = Shape::Sphere { radius: RADIUS };
        Tool::new(&shape, place(step), [0.0, 0.0, 0.0, 1.0]).unwrap()
    };
    let options = HapticOptions {
        latency_s: Some(0.5 * STEP_S),
        ..HapticOptions::new(0, ball(0.0))
    };
    let mut hand = scene.haptics(&options).unwrap();
    for step in 0..9 {
        super::step(&scene, &[ball(f64::from(step))]);
        for call in 1..=20 {
            let at = f64::from(step) + 0.5 + f64::from(call) / 20.0;
            let pose = HapticPose {
                time_s: at * STEP_S,
                position_m: place(at).map(|x| 1e-3 * x),
                rotation: [0.0, 0.0, 0.0, 1.0],
                velocity: None,
            };
            let force = hand.render(&pose).unwrap();
            assert!(step < 3 || force.contacts > 0, "nothing at step {at}");
        }
    }
}
