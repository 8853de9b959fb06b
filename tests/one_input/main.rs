//! One input for steps, submitted steps and frames: through the C ABI it gives the bits of the Rust interface, zeros are a step of free
//! motion, and what cannot be meant is refused by name and changes nothing.
#![cfg(feature = "instruments")]
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

mod all_together;
mod beds;
mod groups;
mod loads;
mod mistakes;
mod mobilise;
mod points;
mod reach;
mod regions;
mod relaxing;
mod supports;
mod ties;

use std::ptr::{null, null_mut};

use fixture::host::{self, Host, indices, message};
use fixture::{bits, model, plain, scene};
use upt::contact::Tool;
use upt::ffi::*;
use upt::{Contact, Corrections, Scene, SceneOptions, Shape, StepInput, View};

const BUNDLE: &str = "tiny-corrected";

/// A ball over the middle of the domain, this deep in it, mm.
fn ball(host: &Host, depth: f32) -> upt_instrument {
    upt_instrument {
        friction: 0.2,
        ..host::ball(host, depth)
    }
}

/// The same for the Rust interface.
fn tool(one: &upt_instrument) -> Tool {
    let shape = Shape::Capsule {
        half_length: 0.0,
        radius: one.radius,
    };
    let mut tool = Tool::new(&shape, one.position, one.rotation).unwrap();
    tool.friction = one.friction;
    tool
}

fn state(host: &Host) -> Vec<u32> {
    let mut u = vec![0.0f32; 3 * host.nodes];
    let read = unsafe { upt_scene_read(host.scene, null(), u.as_mut_ptr(), u.len() as u64) };
    assert_eq!(read, UPT_OK, "{}", message());
    bits(&u)
}

fn step(host: &Host, input: &upt_input) -> Vec<u32> {
    let mut u = vec![0.0f32; 3 * host.nodes];
    let status = unsafe { upt_scene_step(host.scene, input, u.as_mut_ptr(), u.len() as u64) };
    assert_eq!(status, UPT_OK, "{}", message());
    bits(&u)
}

fn submitted(host: &Host, input: &upt_input) -> Vec<u32> {
    assert_eq!(unsafe { upt_scene_submit(host.scene, input) }, UPT_OK);
    let done = unsafe { upt_scene_wait(host.scene, u32::MAX) };
    assert_eq!(done, UPT_OK, "{}", message());
    state(host)
}

fn frame(host: &Host, input: &upt_input, when: f64) -> Vec<u32> {
    let mut u = vec![0.0f32; 3 * host.nodes];
    let (to, floats) = (u.as_mut_ptr(), u.len() as u64);
    let status = unsafe { upt_scene_present(host.scene, input, when, null(), to, floats) };
    assert_eq!(status, UPT_OK, "{}", message());
    bits(&u)
}

fn rust(scene: &Scene, input: StepInput<'_>) -> Vec<u32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    scene.step(input, Some(&mut u)).unwrap();
    bits(&u)
}

fn rust_frame(scene: &Scene, contact: Contact<'_>, when: f64) -> Vec<u32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    scene.present(contact, when, View::Region, &mut u).unwrap();
    bits(&u)
}

fn awake(options: &mut upt_scene_options) {
    options.sleep = UPT_SWITCH_OFF;
}

/// Each drive, by a step, a submitted step and a frame of the C ABI, against the Rust interface.
#[test]
fn every_drive_gives_the_bits_of_the_rust_interface() {
    let hosts = [Host::new(BUNDLE, awake), Host::new(BUNDLE, awake)];
    let [direct, worker] = &hosts;
    let own = scene(&model(BUNDLE), &plain());
    let nodes = &indices(direct.model, UPT_SET_DOMAIN_NODES)[..4];
    for t in 0..12 {
        let depth = 0.3 * (t % 4) as f32;
        let pushing = [ball(direct, depth)];
        let push = [0.1, 0.0, -depth].repeat(nodes.len());
        let mut dense = vec![0.0; 3 * direct.nodes];
        for (&node, vector) in nodes.iter().zip(push.chunks(3)) {
            dense[3 * node as usize..][..3].copy_from_slice(vector);
        }
        let given = vec![0.01; 3 * direct.nodes];
        let tools = [tool(&pushing[0])];
        let (mut input, ours) = match t / 4 {
            0 => (
                upt_input::of_instruments(&pushing),
                StepInput::from(Contact::Tools(&tools)),
            ),
            1 => (
                upt_input::of_contacts(nodes, &push),
                StepInput::from(Contact::Sparse {
                    nodes,
                    vectors: &push,
                }),
            ),
            _ => (
                upt_input {
                    collision: dense.as_ptr(),
                    ..upt_input::NOTHING
                },
                StepInput::from(Contact::Dense(&dense)),
            ),
        };
        let ours = match t {
            // A state to start from.
            6 | 9 => {
                input.displacement = given.as_ptr();
                StepInput {
                    displacement: Some(&given),
                    ..ours
                }
            }
            _ => ours,
        };
        let made = rust(&own, ours);
        assert_eq!(step(direct, &input), made, "step {t}");
        assert_eq!(submitted(worker, &input), made, "submitted step {t}");
        input.displacement = null();
        let shown = rust_frame(&own, ours.contact, 0.02);
        assert_eq!(frame(direct, &input, 0.02), shown, "frame after step {t}");
    }
}

/// Without a drive the tissue moves on by itself: zeros, NULL, and what an empty list of tools or nodes gave.
#[test]
fn zeros_are_a_step_of_free_motion() {
    // Substeps: tissue that a tool let go swings by the elements, and not by the learned part.
    let corrected = |options: &mut upt_scene_options| {
        awake(options);
        options.corrections.mode = UPT_CORRECTIONS_AUTO;
        (options.corrections.target_mm, options.substeps) = (0.02, 4);
    };
    let options = SceneOptions {
        corrections: Corrections::Auto {
            most: 64,
            target_mm: 0.02,
            budget_us: 0,
        },
        substeps: 4,
        ..plain()
    };
    let hosts = [Host::new(BUNDLE, corrected), Host::new(BUNDLE, corrected)];
    let rest = state(&hosts[0]);
    assert_eq!(step(&hosts[0], &upt_input::NOTHING), rest);
    for tools_drive in [true, false] {
        let own = scene(&model(BUNDLE), &options);
        let empty = match tools_drive {
            true => Contact::Tools(&[]),
            false => Contact::Sparse {
                nodes: &[],
                vectors: &[],
            },
        };
        for host in &hosts {
            assert_eq!(unsafe { upt_scene_reset(host.scene) }, UPT_OK);
        }
        let node = &indices(hosts[0].model, UPT_SET_DOMAIN_NODES)[..1];
        let one = ball(&hosts[0], 1.0);
        let tools = [tool(&one)];
        for _ in 0..3 {
            let (input, contact) = match tools_drive {
                true => (
                    upt_input::of_instruments(std::slice::from_ref(&one)),
                    Contact::Tools(&tools),
                ),
                false => (
                    upt_input::of_contacts(node, &[0.0, 0.0, -1.0]),
                    Contact::Sparse {
                        nodes: node,
                        vectors: &[0.0, 0.0, -1.0],
                    },
                ),
            };
            let made = rust(&own, contact.into());
            for host in &hosts {
                assert_eq!(step(host, &input), made);
            }
        }
        // The tools are gone, and the nodes are released.
        let shown = rust_frame(&own, empty, 0.03);
        assert_eq!(frame(&hosts[0], &upt_input::NOTHING, 0.03), shown);
        let mut last = state(&hosts[0]);
        for t in 0..6 {
            let made = rust(&own, empty.into());
            assert_ne!(made, last, "free tissue stands still");
            assert_eq!(step(&hosts[0], &upt_input::NOTHING), made, "step {t}");
            let mut u = vec![0.0f32; 3 * hosts[1].nodes];
            let (to, floats) = (u.as_mut_ptr(), u.len() as u64);
            assert_eq!(
                unsafe { upt_scene_step(hosts[1].scene, null(), to, floats) },
                UPT_OK
            );
            assert_eq!(bits(&u), made, "step {t} of NULL");
            last = made;
        }
    }
}

/// The paper's call is the same step.
#[test]
fn a_step_of_fields_is_a_step_of_that_input() {
    let hosts = [Host::new(BUNDLE, awake), Host::new(BUNDLE, awake)];
    let node = indices(hosts[0].model, UPT_SET_DOMAIN_NODES)[3] as usize;
    let mut collision = vec![0.0f32; 3 * hosts[0].nodes];
    collision[3 * node + 2] = -0.8;
    let given = vec![0.02f32; 3 * hosts[0].nodes];
    for displacement in [null(), given.as_ptr(), null()] {
        let input = upt_input {
            collision: collision.as_ptr(),
            displacement,
            ..upt_input::NOTHING
        };
        let made = step(&hosts[0], &input);
        let mut u = vec![0.0f32; 3 * hosts[1].nodes];
        let (field, floats) = (collision.as_ptr(), u.len() as u64);
        let status = unsafe {
            upt_scene_step_field(hosts[1].scene, displacement, field, u.as_mut_ptr(), floats)
        };
        assert_eq!(status, UPT_OK, "{}", message());
        assert_eq!(bits(&u), made);
    }
}

/// With times of the host's own, a frame is counted from that of the last published step.
#[test]
fn frames_count_from_the_time_of_the_last_step() {
    let (timed, plain) = (Host::new(BUNDLE, awake), Host::new(BUNDLE, awake));
    let mut saved = Vec::new();
    for t in 0..4 {
        let pushing = [ball(&timed, 0.5 * t as f32)];
        let mut input = upt_input::of_instruments(&pushing);
        assert_eq!(step(&plain, &input).len(), 3 * plain.nodes);
        // A clock of a power of two, so that the difference is exact.
        let now = 1024.0 + 0.0625 * f64::from(t);
        input.time_s = now;
        assert_eq!(submitted(&timed, &input), state(&plain));
        input.time_s = 0.0;
        let shown = frame(&plain, &input, 0.03125);
        assert_eq!(
            frame(&timed, &input, now + 0.03125),
            shown,
            "after step {t}"
        );
        let too_early = unsafe {
            let mut u = vec![0.0f32; 3 * timed.nodes];
            let floats = u.len() as u64;
            upt_scene_present(
                timed.scene,
                &input,
                now - 1e-3,
                null(),
                u.as_mut_ptr(),
                floats,
            )
        };
        assert_eq!(too_early, UPT_ERR_ARGUMENT);
        assert!(message().contains("when is"), "{}", message());
        if t == 2 {
            let mut needed = 0;
            let status = unsafe { upt_scene_save(timed.scene, null_mut(), 0, &mut needed) };
            assert_eq!(status, UPT_OK);
            saved = vec![0u8; needed as usize];
            let status =
                unsafe { upt_scene_save(timed.scene, saved.as_mut_ptr(), needed, &mut needed) };
            assert_eq!(status, UPT_OK);
        }
    }
    // The time is part of the state.
    let restored = unsafe { upt_scene_restore(timed.scene, saved.as_ptr(), saved.len() as u64) };
    assert_eq!(restored, UPT_OK, "{}", message());
    let mut u = vec![0.0f32; 3 * timed.nodes];
    let floats = u.len() as u64;
    let before = 1024.0 + 0.125 - 1e-3;
    let status =
        unsafe { upt_scene_present(timed.scene, null(), before, null(), u.as_mut_ptr(), floats) };
    assert_eq!(status, UPT_ERR_ARGUMENT, "{}", message());
    frame(&timed, &upt_input::NOTHING, 1024.0 + 0.125);
    // Back at rest it is 0.
    assert_eq!(unsafe { upt_scene_reset(timed.scene) }, UPT_OK);
    frame(&timed, &upt_input::NOTHING, 0.0);
}

/// A rotation that was never set turns nothing, wherever the ABI has one: instruments, what holds the body, hands. (Groups: `the_c_interface_moves_groups`.)
#[test]
fn a_rotation_of_zeros_is_the_identity() {
    let identity = [0.0, 0.0, 0.0, 1.0];
    let quarter = [0.0, 0.0, 0.5f32.sqrt(), 0.5f32.sqrt()];
    let [zeros, same, turned] = [[0.0; 4], identity, quarter].map(|rotation| {
        let host = Host::new(BUNDLE, |options| {
            awake(options);
            options.corrections.mode = UPT_CORRECTIONS_COUNT;
            options.corrections.count = 8;
        });
        let blade = upt_instrument {
            shape: UPT_SHAPE_BOX,
            half_extents: [1.0, 4.0, 3.0],
            rotation,
            ..ball(&host, 1.0)
        };
        let tools = [blade];
        let input = upt_input {
            support_position: [0.5, 0.0, 0.2],
            support_rotation: rotation,
            ..upt_input::of_instruments(&tools)
        };
        let mut hand = null_mut();
        // SAFETY: zeros are a value of this struct.
        let mut options: upt_haptics_options = unsafe { std::mem::zeroed() };
        options.struct_size = size_of::<upt_haptics_options>() as u32;
        let mut above = blade;
        above.position[2] += 5.0;
        options.tool = &above;
        options.step_latency_ms = 1.0;
        let made = unsafe { upt_haptics_create(host.scene, &options, &mut hand) };
        assert_eq!(made, UPT_OK, "{}", message());
        let mut felt = Vec::new();
        let mut states = Vec::new();
        for t in 0..4 {
            states.push(step(&host, &input));
            // At 1 kHz, from above.
            for k in 0..50 {
                let mut now = blade;
                now.position[2] += 5.0 - f32::min(0.1 * (50 * t + k) as f32, 5.0);
                felt = render(hand, 0.05 * f64::from(t) + 1e-3 * f64::from(k), &now);
            }
        }
        assert_eq!(unsafe { upt_haptics_destroy(hand) }, UPT_OK);
        assert!(felt.iter().any(|&bits| f32::from_bits(bits) != 0.0));
        states.push(felt);
        states
    });
    assert_eq!(zeros, same);
    for (step, (a, b)) in zeros.iter().zip(&turned).enumerate() {
        assert_ne!(a, b, "{step}");
    }
}

/// Force and torque of a hand that has its tool where this one is.
fn render(hand: *mut upt_haptics, time_s: f64, tool: &upt_instrument) -> Vec<u32> {
    // SAFETY: zeros are a value of these structs.
    let mut pose: upt_haptic_pose = unsafe { std::mem::zeroed() };
    pose.struct_size = size_of::<upt_haptic_pose>() as u32;
    (pose.time_s, pose.rotation) = (time_s, tool.rotation);
    pose.position_m = tool.position.map(|mm| 1e-3 * mm);
    let mut force: upt_haptic_force = unsafe { std::mem::zeroed() };
    force.struct_size = size_of::<upt_haptic_force>() as u32;
    let told = unsafe { upt_haptics_render(hand, &pose, &mut force) };
    assert_eq!(told, UPT_OK, "{}", message());
    bits(&[force.force_n, force.torque_n_m].concat())
}
