//! A support that moves: the body in its frame, the host's struct, snapshots, and poses that are none.

use upt::ffi::*;
use upt::{Loads, StepInput, SupportPose};

use crate::{BUNDLE, awake, rust, step};
use fixture::host::Host;
use fixture::{model, plain, scene};

fn field(bits: &[u32]) -> Vec<f32> {
    bits.iter().map(|bits| f32::from_bits(*bits)).collect()
}

fn largest(u: &[f32]) -> f32 {
    u.iter().fold(0.0, |most, u| most.max(u.abs()))
}

/// A pose on a way up and round.
fn pose(t: u32) -> SupportPose {
    let way = 0.1 * t.min(40) as f32;
    let (sine, cosine) = (0.5 * way).sin_cos();
    SupportPose {
        position: [3.0 * way, 0.0, 5.0 * way],
        rotation: [0.0, sine, 0.0, cosine],
    }
}

fn carried(t: u32) -> StepInput<'static> {
    let loads = Loads {
        support: Some(pose(t)),
        ..Loads::default()
    };
    StepInput {
        loads,
        ..StepInput::default()
    }
}

/// After a way of 23 mm and four radians the body is in its frame as it was, and what it bore on the way was inertia.
/// Verifies REQ-071.
#[test]
fn a_support_carries_the_body_without_strain() {
    let scene = scene(&model(BUNDLE), &plain());
    let mut u = vec![0.0; 3 * scene.node_count()];
    let mut most = 0.0f32;
    for t in 0..80 {
        scene.step(carried(t), Some(&mut u)).unwrap();
        most = most.max(largest(&u));
    }
    println!("{most} mm on the way, {} mm at its end", largest(&u));
    assert!(most > 1e-3, "{most} mm");
    assert!(largest(&u) < 1e-3, "{} mm", largest(&u));
}

/// With the world turned under it, an organ hangs as one that gravity turns about; and the host's struct gives the bits of the Rust interface.
#[test]
fn a_turned_support_is_gravity_that_turns() {
    let turned = |angle: f32| Loads {
        gravity: [0.0, 0.0, -1.0],
        gravity_at_rest: [0.0, 0.0, -1.0],
        support: Some(SupportPose {
            position: [0.0; 3],
            rotation: [(0.5 * angle).sin(), 0.0, 0.0, (0.5 * angle).cos()],
        }),
        ..Loads::default()
    };
    let host = Host::new(BUNDLE, awake);
    let [by_support, by_gravity] = [0; 2].map(|_| scene(&model(BUNDLE), &plain()));
    let mut last = [Vec::new(), Vec::new()];
    for t in 1..=120 {
        let angle = 0.02 * t.min(50) as f32;
        let loads = turned(angle);
        let support = loads.support.unwrap();
        let input = StepInput {
            loads,
            ..StepInput::default()
        };
        last[0] = rust(&by_support, input);
        let raw = upt_input {
            gravity: loads.gravity,
            gravity_at_rest: loads.gravity_at_rest,
            support_position: support.position,
            support_rotation: support.rotation,
            ..upt_input::NOTHING
        };
        assert_eq!(step(&host, &raw), last[0], "step {t}");
        let (sine, cosine) = angle.sin_cos();
        let gravity = Loads {
            gravity: [0.0, -sine, -cosine],
            gravity_at_rest: [0.0, 0.0, -1.0],
            ..Loads::default()
        };
        let input = StepInput {
            loads: gravity,
            ..StepInput::default()
        };
        last[1] = rust(&by_gravity, input);
    }
    let last = last.map(|bits| field(&bits));
    let off = last[0].iter().zip(&last[1]);
    let off = off.fold(0.0f32, |most, (a, b)| most.max((a - b).abs()));
    println!("{off} of {} mm", largest(&last[1]));
    assert!(largest(&last[1]) > 0.01 && off < 1e-3 * largest(&last[1]));
}

#[test]
fn a_snapshot_of_a_carried_body_resumes_to_the_bit() {
    let [own, resumed] = [0; 2].map(|_| scene(&model(BUNDLE), &plain()));
    for t in 0..12 {
        rust(&own, carried(t));
    }
    resumed.restore(&own.save().unwrap()).unwrap();
    for t in 12..20 {
        assert_eq!(rust(&own, carried(t)), rust(&resumed, carried(t)));
    }
}

#[test]
fn a_support_that_is_no_pose_is_named_and_one_that_leaps_is_put_there() {
    let scene = scene(&model(BUNDLE), &plain());
    rust(&scene, carried(0));
    let before = scene.save().unwrap();
    for (position, rotation) in [
        ([f32::NAN, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        ([0.0; 3], [0.0, 0.0, 0.0, 3.0]),
    ] {
        let loads = Loads {
            support: Some(SupportPose { position, rotation }),
            ..Loads::default()
        };
        let input = StepInput {
            loads,
            ..StepInput::default()
        };
        let error = scene.step(input, None).unwrap_err();
        assert!(error.to_string().contains("support"), "{error}");
    }
    assert_eq!(scene.save().unwrap(), before);
    let leap = Loads {
        support: Some(SupportPose {
            position: [900.0, 0.0, 0.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
        }),
        ..Loads::default()
    };
    let input = StepInput {
        loads: leap,
        ..StepInput::default()
    };
    assert_eq!(largest(&field(&rust(&scene, input))), 0.0);
}
