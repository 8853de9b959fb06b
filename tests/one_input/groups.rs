//! Support groups: parts of what holds the body that move against each other, are let go and held again.

use std::sync::Arc;

use upt::ffi::*;
use upt::{Contact, GroupMotion, Loads, Model, ModelOptions, Scene, StepInput, SupportPose};

use crate::{BUNDLE, ball, step, tool};
use fixture::host::{Host, message};
use fixture::{bits, copy_of, find_runtime, manifest, plain, scene, with_groups, write_manifest};

#[path = "led_between.rs"]
mod led_between;

/// With the folder, from which a model reads on.
fn open() -> (tempfile::TempDir, Arc<Model>) {
    let folder = with_groups(BUNDLE);
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    (folder, model)
}

pub fn led<'a>(supports: &'a [GroupMotion<'a>]) -> StepInput<'a> {
    let loads = Loads {
        supports,
        ..Loads::default()
    };
    StepInput {
        loads,
        ..StepInput::default()
    }
}

/// A turn about z and a way along x and z, up to one.
fn pose(part: f32) -> SupportPose {
    let (sine, cosine) = (0.4 * part).sin_cos();
    SupportPose {
        position: [6.0 * part, 0.0, 4.0 * part],
        rotation: [0.0, 0.0, sine, cosine],
    }
}

fn moved(group: u32, pose: SupportPose) -> GroupMotion<'static> {
    GroupMotion {
        group,
        pose: Some(pose),
        ..GroupMotion::default()
    }
}

fn at(u: &[f32], nodes: &[u32]) -> Vec<f32> {
    let rows = nodes.iter().map(|node| &u[3 * *node as usize..][..3]);
    rows.flatten().copied().collect()
}

fn largest(values: &[f32]) -> f32 {
    values.iter().fold(0.0, |most, v| most.max(v.abs()))
}

fn nodes(scene: &Scene, group: usize) -> Vec<u32> {
    scene.model().supports().nth(group).unwrap().1.to_vec()
}

/// All groups in one rigid motion, a turn of 46 degrees among it: the body ends where that takes it, free of stress.
#[test]
fn a_body_that_all_groups_carry_is_free_of_stress() {
    let (_folder, model) = open();
    let scene = scene(&model, &plain());
    let mut u = vec![0.0; 3 * scene.node_count()];
    let mut most = 0.0f64;
    let mut mse = 0.0;
    for t in 0..300 {
        let part = (t as f32 / 40.0).min(1.0);
        let to = pose(part * part * (3.0 - 2.0 * part));
        let supports = [moved(0, to), moved(1, to)];
        scene.step(led(&supports), Some(&mut u)).unwrap();
        let [_, _, sine, cosine] = to.rotation.map(f64::from);
        let (sin, cos) = (2.0 * sine * cosine, 1.0 - 2.0 * sine * sine);
        let rows = scene.model().positions().as_chunks::<3>().0.iter();
        let squares = rows.zip(u.as_chunks::<3>().0).map(|(x, u)| {
            let [x, y, z] = x.map(f64::from);
            let there = [cos * x - sin * y, sin * x + cos * y, z];
            let errors = [0, 1, 2].map(|k| {
                let wanted = there[k] + f64::from(to.position[k]) - [x, y, z][k];
                f64::from(u[k]) - wanted
            });
            errors.iter().map(|e| e * e).sum::<f64>()
        });
        mse = squares.sum::<f64>() / scene.node_count() as f64;
        most = most.max(mse);
    }
    println!("{most:e} mm² on the way, {mse:e} at its end");
    assert!(mse < 1e-6, "{mse:e} mm²");
}

/// A group that moves against the other takes its nodes to where they are told, by a pose as by displacements, with a tool and without; and back at rest the body
/// is as it was.
#[test]
fn a_pose_is_the_displacements_that_it_gives() {
    let (_folder, model) = open();
    let [posed, given] = [0; 2].map(|_| scene(&model, &plain()));
    let own = nodes(&posed, 1);
    let host = Host::new(BUNDLE, crate::awake);
    let tools = [tool(&ball(&host, 1.0))];
    let mut u = vec![0.0; 3 * posed.node_count()];
    let mut again = u.clone();
    for t in 0..60 {
        let to = SupportPose {
            position: [0.0, 0.0, 0.1 * t.min(10) as f32],
            rotation: [0.0, 0.0, 0.0, 1.0],
        };
        let z = to.position[2];
        let list = [0.0, 0.0, z].repeat(own.len());
        let by_nodes = [GroupMotion {
            group: 1,
            displacements: Some(&list),
            ..GroupMotion::default()
        }];
        let by_pose = [moved(1, to)];
        let (a, b) = match t < 40 {
            true => (led(&by_pose), led(&by_nodes)),
            false => (StepInput::default(), StepInput::default()),
        };
        let contact = match t % 20 < 10 {
            true => Contact::Tools(&tools),
            false => Contact::None,
        };
        posed
            .step(StepInput { contact, ..a }, Some(&mut u))
            .unwrap();
        given
            .step(StepInput { contact, ..b }, Some(&mut again))
            .unwrap();
        let wanted = if t < 40 { z } else { 0.0 };
        for row in at(&u, &own).as_chunks::<3>().0 {
            assert!(
                (row[2] - wanted).abs() < 1e-5 && row[0].abs() < 1e-5,
                "{t}: {row:?}"
            );
        }
        let apart = u.iter().zip(&again).map(|(a, b)| a - b).collect::<Vec<_>>();
        assert!(largest(&apart) < 1e-4, "step {t}: {} mm", largest(&apart));
        let det = posed.stats().min_det;
        assert!(det > 0.9 || (det == 0.0 && t > 40), "step {t}: {det}");
        assert!(largest(&at(&u, &nodes(&posed, 0))) == 0.0);
    }
    for _ in 0..100 {
        posed.step(StepInput::default(), Some(&mut u)).unwrap();
    }
    assert!(largest(&u) < 2e-3, "{} mm", largest(&u));
}

/// Under gravity a group is let go and sinks, is held where it is and stays there, and moves with its pose from there; a restored scene goes on to the bit.
#[test]
fn a_group_is_let_go_and_held_again() {
    let (_folder, model) = open();
    let scene = scene(&model, &plain());
    let own = nodes(&scene, 1);
    let mut u = vec![0.0; 3 * scene.node_count()];
    let gravity = [0.0, 0.0, -3.0];
    let go = [GroupMotion {
        group: 1,
        let_go: true,
        ..GroupMotion::default()
    }];
    let with = |supports| StepInput {
        loads: Loads {
            gravity,
            supports,
            ..Loads::default()
        },
        ..StepInput::default()
    };
    let mut saved = Vec::new();
    let mut after = Vec::new();
    for t in 0..60 {
        scene.step(with(&go), Some(&mut u)).unwrap();
        match t {
            30 => saved = scene.save().unwrap(),
            31 => after = bits(&u),
            _ => {}
        }
    }
    let sunk = at(&u, &own);
    let down = sunk
        .as_chunks::<3>()
        .0
        .iter()
        .map(|row| -row[2])
        .fold(0.0f32, f32::max);
    println!("{down} mm down, smallest det F {}", scene.stats().min_det);
    assert!(down > 0.05, "{down} mm");
    for _ in 0..20 {
        scene.step(with(&[]), Some(&mut u)).unwrap();
        let held = at(&u, &own);
        let apart: Vec<f32> = held.iter().zip(&sunk).map(|(a, b)| a - b).collect();
        assert!(largest(&apart) < 1e-5, "{} mm", largest(&apart));
    }
    let up = [moved(
        1,
        SupportPose {
            position: [0.0, 0.0, 0.5],
            rotation: [0.0, 0.0, 0.0, 1.0],
        },
    )];
    scene.step(with(&up), Some(&mut u)).unwrap();
    let lifted = at(&u, &own);
    for (row, before) in lifted
        .as_chunks::<3>()
        .0
        .iter()
        .zip(sunk.as_chunks::<3>().0)
    {
        assert!(
            (row[2] - before[2] - 0.5).abs() < 1e-5,
            "{row:?} {before:?}"
        );
    }
    scene.restore(&saved).unwrap();
    scene.step(with(&go), Some(&mut u)).unwrap();
    assert_eq!(bits(&u), after);
    scene.reset().unwrap();
    scene.step(StepInput::default(), Some(&mut u)).unwrap();
    assert_eq!(largest(&u), 0.0);
}

/// The host's struct is the Rust interface, and what no group can do is refused by name.
#[test]
fn the_c_interface_moves_groups() {
    let (folder, model) = open();
    let host = Host::new(folder.path().to_str().unwrap(), crate::awake);
    let own = scene(&model, &plain());
    let mut one = upt_support {
        group: 1,
        position: [0.0, 0.2, 0.4],
        ..upt_support::HELD
    };
    let mut u = vec![0.0; 3 * own.node_count()];
    let list = vec![0.1f32; 3 * nodes(&own, 1).len()];
    let input = |one: &upt_support| upt_input {
        supports: one,
        support_count: 1,
        ..upt_input::NOTHING
    };
    for t in 0..4 {
        let mut motion = moved(
            1,
            SupportPose {
                position: one.position,
                rotation: [0.0, 0.0, 0.0, 1.0],
            },
        );
        if t == 2 {
            one.position = [0.0; 3];
            (one.displacements, one.displacement_count) = (list.as_ptr(), list.len() as u64);
            (motion.pose, motion.displacements) = (None, Some(&list[..]));
        }
        if t == 3 {
            one = upt_support {
                group: 1,
                let_go: 1,
                ..upt_support::HELD
            };
            motion = GroupMotion {
                group: 1,
                let_go: true,
                ..GroupMotion::default()
            };
        }
        own.step(led(&[motion]), Some(&mut u)).unwrap();
        assert_eq!(step(&host, &input(&one)), bits(&u), "step {t}");
    }
    let before = crate::state(&host);
    let wrong = [
        (
            upt_support {
                group: 2,
                ..upt_support::HELD
            },
            UPT_ERR_ARGUMENT,
            "group 2 is beyond",
        ),
        (
            upt_support {
                let_go: 2,
                ..upt_support::HELD
            },
            UPT_ERR_ARGUMENT,
            "let_go",
        ),
        (
            upt_support {
                position: [0.0, 0.0, f32::NAN],
                ..upt_support::HELD
            },
            UPT_ERR_NON_FINITE,
            "supports[0]",
        ),
        (
            upt_support {
                position: [0.0, 0.0, 60.0],
                ..upt_support::HELD
            },
            UPT_ERR_ARGUMENT,
            "group `left`",
        ),
        (
            upt_support {
                displacements: list.as_ptr(),
                displacement_count: 3,
                ..upt_support::HELD
            },
            UPT_ERR_ARGUMENT,
            "displacements has 3 numbers",
        ),
    ];
    for (one, status, text) in wrong {
        let (to, floats) = (u.as_mut_ptr(), u.len() as u64);
        let found = unsafe { upt_scene_step(host.scene, &input(&one), to, floats) };
        assert_eq!(found, status, "{}", message());
        assert!(message().contains(text), "{}", message());
        assert_eq!(crate::state(&host), before);
    }
    let mut name = [0 as std::ffi::c_char; 16];
    let mut found = vec![0u32; nodes(&own, 1).len()];
    let mut needed = 0;
    let read = unsafe {
        let (to, room) = (found.as_mut_ptr(), found.len() as u64);
        upt_model_read_support(host.model, 1, name.as_mut_ptr(), 16, to, room, &mut needed)
    };
    assert_eq!((read, needed as usize), (UPT_OK, found.len()));
    assert_eq!(found, nodes(&own, 1));
    let text = unsafe { std::ffi::CStr::from_ptr(name.as_ptr()) };
    assert_eq!(text.to_str().unwrap(), "right");
    let none = std::ptr::null_mut();
    let read = unsafe {
        upt_model_read_support(host.model, 2, none, 0, std::ptr::null_mut(), 0, &mut needed)
    };
    assert_eq!(read, UPT_ERR_ARGUMENT);
    assert!(message().contains("the bundle has 2"), "{}", message());
}

/// A group that is none.
#[test]
fn a_bundle_names_groups_of_held_nodes() {
    for (groups, text) in [
        (
            serde_json::json!([{"name": "a", "nodes": [4_000_000_000u32]}]),
            "is not held",
        ),
        (
            serde_json::json!([{"name": "", "nodes": [0]}]),
            "must have one of its own",
        ),
        (
            serde_json::json!([{"name": "a", "nodes": []}]),
            "must have nodes",
        ),
    ] {
        find_runtime();
        let folder = copy_of(BUNDLE);
        let mut manifest = manifest(folder.path());
        manifest["supports"] = groups;
        write_manifest(folder.path(), &mut manifest);
        let Err(error) = Model::open(folder.path(), &ModelOptions::default()) else {
            panic!("{text}");
        };
        let error = error.to_string();
        assert!(
            error.contains("supports[0]") && error.contains(text),
            "{error}"
        );
    }
}
