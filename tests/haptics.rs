//! The force of one tool between steps: what a hand feels.
#![cfg(feature = "instruments")]

#[path = "haptics/loads.rs"]
mod loads;
#[path = "haptics/sideways.rs"]
mod sideways;

use contact::Shape;
use fixture::{model, plain, scene};
use upt::contact::Tool;
use upt::haptics::{HapticForce, HapticOptions, HapticPose, Haptics};
use upt::{Contact, Corrections, Error, Scene, SceneOptions};

const DT: f64 = 0.05;

fn corrected() -> SceneOptions {
    fixture::corrected(8)
}

/// The middle of the top, mm.
fn top(scene: &Scene) -> [f32; 3] {
    let mesh = scene.mesh();
    let place = |node: u32| [0, 1, 2].map(|axis| mesh.positions[3 * node as usize + axis]);
    let count = mesh.domain.nodes.len() as f32;
    let middle = [0, 1].map(|axis| {
        let along = mesh.domain.nodes.iter().map(|&node| place(node)[axis]);
        along.sum::<f32>() / count
    });
    let nearest = mesh.domain.nodes.iter().min_by(|a, b| {
        let far = |node: u32| {
            (0..2)
                .map(|k| (place(node)[k] - middle[k]).powi(2))
                .sum::<f32>()
        };
        far(**a).total_cmp(&far(**b))
    });
    place(*nearest.unwrap())
}

/// A ball of radius 3 mm whose lowest point is `depth` mm below the top.
fn ball(scene: &Scene, depth: f64) -> Tool {
    let [x, y, z] = top(scene);
    let shape = Shape::Sphere { radius: 3.0 };
    let at = [x, y, z + 3.0 - depth as f32];
    Tool::new(&shape, at, [0.0, 0.0, 0.0, 1.0]).unwrap()
}

fn pose(scene: &Scene, depth: f64, time_s: f64) -> HapticPose {
    HapticPose {
        time_s,
        position_m: ball(scene, depth)
            .pose
            .translation
            .to_array()
            .map(|x| 1e-3 * x),
        rotation: [0.0, 0.0, 0.0, 1.0],
        velocity: None,
    }
}

fn step(scene: &Scene, tools: &[Tool]) {
    scene.step(Contact::Tools(tools), None).unwrap();
}

fn felt(scene: &Scene) -> [f32; 3] {
    scene.with_contact_report(|report| report.readings[0].force)
}

fn size(force: &[f32; 3]) -> f32 {
    force.iter().map(|x| x * x).sum::<f32>().sqrt()
}

fn options(scene: &Scene) -> HapticOptions {
    HapticOptions {
        latency_s: Some(0.0),
        ..HapticOptions::new(0, ball(scene, -5.0))
    }
}

fn hand(scene: &Scene) -> Haptics {
    scene.haptics(&options(scene)).unwrap()
}

/// Steps at 20 Hz and forces at 1 kHz along a depth over time; calls with time, force and the scene.
fn play(
    scene: &Scene,
    hand: &mut Haptics,
    seconds: f64,
    depth: impl Fn(f64) -> f64,
    mut take: impl FnMut(f64, &HapticForce),
) {
    for tick in 0..(seconds / 1e-3) as usize {
        let t = 1e-3 * tick as f64;
        if tick % 50 == 0 {
            step(scene, &[ball(scene, depth(t))]);
        }
        take(t, &hand.render(&pose(scene, depth(t), t)).unwrap());
    }
}

#[test]
fn a_quick_hand_is_met_between_two_steps() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    // At 1 m/s from 160 mm above to 1 mm below, where the step at 200 ms would find it.
    let depth = |t: f64| (1000.0 * t - 160.0).min(1.0);
    let mut met = 0;
    play(&scene, &mut hand, 0.2, depth, |t, force| {
        assert!(depth(t) > -1.0 || !force.contact, "{t} s: {force:?}");
        met += u32::from(depth(t) >= 1.0 && force.contacts > 0);
    });
    // From 161 to 199 ms.
    assert_eq!(met, 39);
}

#[test]
fn a_hand_that_starts_suddenly_is_met_before_the_next_step() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    // At rest 15 mm above until the step at 100 ms, then at 1 m/s to 1 mm below.
    let depth = |t: f64| (1000.0 * (t - 0.1).max(0.0) - 15.0).min(1.0);
    let mut met = 0;
    play(&scene, &mut hand, 0.15, depth, |t, force| {
        assert!(depth(t) > -1.0 || !force.contact, "{t} s: {force:?}");
        met += u32::from(depth(t) >= 0.99 && force.contacts > 0);
    });
    // From 116 to 149 ms.
    assert_eq!(met, 34);
}

#[test]
fn a_tool_that_stays_feels_what_the_step_told() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    for t in 0..40 {
        step(&scene, &[ball(&scene, 1.0)]);
        for k in 0..50 {
            let time = DT * f64::from(t) + 1e-3 * f64::from(k);
            let force = hand.render(&pose(&scene, 1.0, time)).unwrap();
            assert!(force.force_n.iter().all(|x| x.is_finite()));
            if t == 39 && k == 49 {
                let told = felt(&scene);
                assert!(force.contact && force.contacts > 0);
                assert!(told[2] > 1.0, "{told:?}");
                let beside = [0, 1, 2].map(|k| 1e3 * force.force_n[k] - told[k]);
                assert!(size(&beside) < 0.02 * size(&told), "{force:?} {told:?}");
            }
        }
    }
}

#[test]
fn forces_run_on_when_a_step_arrives() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    let (mut last, mut largest, mut jump) = (0.0f32, 0.0f32, 0.0f32);
    let depth = |t: f64| -0.5 + 1.5 * (4.0 * t).sin();
    play(&scene, &mut hand, 2.0, depth, |_, force| {
        let now = force.force_n[2];
        jump = jump.max((now - last).abs());
        largest = largest.max(now);
        last = now;
    });
    assert!(largest > 1e-3, "{largest} N");
    assert!(jump < 0.1 * largest, "{jump} N of {largest} N within 1 ms");
}

#[test]
fn the_stiffness_says_how_the_force_changes_with_the_pose() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut options = options(&scene);
    options.passivity = false;
    let mut hand = scene.haptics(&options).unwrap();
    for _ in 0..40 {
        step(&scene, &[ball(&scene, 1.0)]);
    }
    // Until the first step is blended in.
    let rests = (0..60).map(|tick| 1e-3 * f64::from(tick) - 0.06);
    let rests = rests.map(|time_s| hand.render(&pose(&scene, 1.0, time_s)).unwrap());
    let before = rests.last().unwrap();
    let told = before.stiffness[2 * 6 + 2];
    assert!(told > 1.0, "{told} N/m");
    let change = |hand: &mut Haptics, time_s: f64| {
        let after = hand.render(&pose(&scene, 1.01, time_s)).unwrap();
        (after.force_n[2] - before.force_n[2]) / 1e-5
    };
    // Over 90 ms samples have followed; the modes feel it only in the next call.
    let slow = change(&mut hand, 0.089);
    assert!((slow / told - 1.0).abs() < 0.15, "{slow} and {told} N/m");
    // Moved within a millisecond the tissue resists by its mass, too.
    let mut hand = scene.haptics(&options).unwrap();
    for tick in 0..60 {
        let time_s = 1e-3 * f64::from(tick) - 0.06;
        hand.render(&pose(&scene, 1.0, time_s)).unwrap();
    }
    let fast = change(&mut hand, 0.0);
    assert!(fast > 1.5 * told, "{fast} and {told} N/m");
}

#[test]
fn out_of_contact_there_is_no_force() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    let depth = |t: f64| if t < 0.5 { 1.0 } else { -2.0 };
    play(&scene, &mut hand, 1.0, depth, |t, force| {
        if t >= 0.5 {
            assert_eq!(force.force_n, [0.0; 3], "at {t}");
            assert_eq!(force.torque_n_m, [0.0; 3], "at {t}");
            assert_eq!(force.stiffness, [0.0; 36], "at {t}");
            assert!(!force.contact);
        }
    });
}

/// Verifies REQ-050.
#[test]
fn a_hand_gets_no_energy() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    let depth = |t: f64| -0.3 + 1.2 * (9.0 * t).sin() + 0.3 * (61.0 * t).sin();
    let (mut given, mut before, mut held) = (0.0f64, f64::NAN, 0.0f64);
    let mut most = 0.0f64;
    play(&scene, &mut hand, 4.0, depth, |t, force| {
        if !before.is_nan() {
            // Up is against the depth.
            given += held * -1e-3 * (depth(t) - before);
        }
        before = depth(t);
        held = f64::from(force.force_n[2]);
        if held == 0.0 {
            given = given.max(0.0);
        }
        most = most.max(given);
    });
    assert!(most < 1e-6, "{most} J");
}

/// Verifies REQ-051.
#[test]
fn the_age_of_the_last_step_is_told() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    step(&scene, &[ball(&scene, 0.5)]);
    assert_eq!(hand.render(&pose(&scene, 0.5, 10.0)).unwrap().age_s, 0.0);
    let late = hand.render(&pose(&scene, 0.5, 10.75)).unwrap();
    assert!((late.age_s - 0.75).abs() < 1e-9);
    step(&scene, &[ball(&scene, 0.5)]);
    let fresh = hand.render(&pose(&scene, 0.5, 10.76)).unwrap();
    assert_eq!(fresh.age_s, 0.0);
    assert!(fresh.steps > late.steps);
}

#[test]
fn a_reset_scene_pushes_no_more() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    for _ in 0..10 {
        step(&scene, &[ball(&scene, 1.0)]);
    }
    hand.render(&pose(&scene, 1.0, -0.1)).unwrap();
    assert!(hand.render(&pose(&scene, 1.0, 0.0)).unwrap().contact);
    let saved = scene.save().unwrap();
    scene.reset().unwrap();
    let force = hand.render(&pose(&scene, -1.0, 0.001)).unwrap();
    assert_eq!(force.force_n, [0.0; 3]);
    scene.restore(&saved).unwrap();
    // The blend goes on from no force.
    hand.render(&pose(&scene, 1.0, 0.002)).unwrap();
    let force = hand.render(&pose(&scene, 1.0, 0.1)).unwrap();
    assert!(force.contact, "{force:?}");
}

/// Verifies REQ-050.
#[test]
fn a_limit_bounds_the_force() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut options = options(&scene);
    (options.force_limit_n, options.passivity) = (0.001, false);
    let mut hand = scene.haptics(&options).unwrap();
    let mut largest = 0.0f32;
    play(
        &scene,
        &mut hand,
        0.5,
        |t| 4.0 * t,
        |_, force| {
            largest = largest.max(size(&force.force_n));
        },
    );
    assert!((largest - 0.001).abs() < 1e-6, "{largest} N");
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let one = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&one);
    step(&one, &[ball(&one, 1.0)]);
    let good = pose(&one, 1.0, 5.0);
    hand.render(&good).unwrap();
    let mut bad = good;
    bad.position_m[1] = f32::NAN;
    assert!(matches!(hand.render(&bad), Err(Error::NonFinite(_))));
    bad = good;
    bad.time_s = f64::INFINITY;
    assert!(matches!(hand.render(&bad), Err(Error::NonFinite(_))));
    bad = good;
    bad.time_s = 4.9;
    assert!(matches!(hand.render(&bad), Err(Error::Argument(_))));
    bad = good;
    bad.rotation = [0.0; 4];
    assert!(matches!(hand.render(&bad), Err(Error::Argument(_))));
    bad = good;
    bad.velocity = Some([[f32::NAN; 3]; 2]);
    assert!(matches!(hand.render(&bad), Err(Error::NonFinite(_))));
    let later = hand.render(&pose_at(&good, 5.5)).unwrap();
    assert!(later.contact);
    let mut options = options(&one);
    options.blend_s = f64::NAN;
    assert!(matches!(one.haptics(&options), Err(Error::Argument(_))));
    options.blend_s = 0.02;
    options.instrument = 64;
    assert!(matches!(one.haptics(&options), Err(Error::Argument(_))));
    let without = SceneOptions {
        corrections: Corrections::None,
        ..plain()
    };
    for (name, settings) in [("tiny-corrected", &without), ("tiny-upt", &plain())] {
        let other = scene(&model(name), settings);
        let made = other.haptics(&self::options(&one));
        assert!(matches!(made, Err(Error::Unsupported(_))), "{name}");
    }
    drop(one);
    let gone = hand.render(&pose_at(&good, 6.0));
    assert!(matches!(gone, Err(Error::State(_))));
}

fn pose_at(pose: &HapticPose, time_s: f64) -> HapticPose {
    HapticPose { time_s, ..*pose }
}

/// A torn read would mix two steps: every field of a published problem is of one of them, so the force is that of one of two
/// depths, or between.
/// Verifies REQ-051.
#[test]
fn a_hand_and_the_steps_run_on_two_threads() {
    let one = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&one);
    let good = pose(&one, 1.0, 0.0);
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for t in 0..300 {
                step(&one, &[ball(&one, if t % 20 < 15 { 1.0 } else { -3.0 })]);
            }
            stop.store(true, std::sync::atomic::Ordering::Release);
        });
        let (mut time, mut steps, mut most) = (0.0, 0, 0.0f32);
        while !stop.load(std::sync::atomic::Ordering::Acquire) {
            time += 1e-3;
            let force = hand.render(&pose_at(&good, time)).unwrap();
            assert!(force.force_n.iter().all(|x| x.is_finite()));
            assert!(force.steps >= steps, "steps go forward");
            steps = force.steps;
            most = most.max(size(&force.force_n));
        }
        assert!(steps > 10, "{steps} steps were seen");
        assert!(most < 10.0, "{most} N");
    });
}
