//! Loads of an input: the bits of the Rust interface, awake while they act, at rest after them, and from snapshots as without.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use upt::ffi::*;
use upt::{Contact, Corrections, Error, IndexSet, Loads, Pressure, SceneOptions, StepInput, flag};

use crate::{BUNDLE, awake, ball, rust, step, submitted, tool};
use fixture::host::{Host, indices};
use fixture::{bits, model, plain, scene};

fn largest(u: &[f32]) -> f32 {
    u.iter().fold(0.0, |most, u| most.max(u.abs()))
}

/// Gravity, forces and two pressures, with a tool pressed in and without, by a step and a submitted step.
#[test]
fn loads_give_the_bits_of_the_rust_interface() {
    let hosts = [Host::new(BUNDLE, awake), Host::new(BUNDLE, awake)];
    let [direct, worker] = &hosts;
    let own = scene(&model(BUNDLE), &plain());
    let domain = indices(direct.model, UPT_SET_DOMAIN_NODES);
    let mut last = Vec::new();
    for t in 0..8 {
        let size = 0.2 * t as f32;
        let forces = vec![0.05 * size; 3 * direct.nodes];
        let pressing = [ball(direct, 0.2 * size)];
        let tools = [tool(&pressing[0])];
        let raw = [
            upt_pressure {
                struct_size: size_of::<upt_pressure>() as u32,
                pascal: 20.0 * size,
                nodes: std::ptr::null(),
                node_count: 0,
            },
            upt_pressure {
                struct_size: size_of::<upt_pressure>() as u32,
                pascal: -5.0 * size,
                nodes: domain.as_ptr(),
                node_count: domain.len() as u64,
            },
        ];
        let drive = match t < 4 {
            true => upt_input::NOTHING,
            false => upt_input::of_instruments(&pressing),
        };
        let input = upt_input {
            gravity: [size, 0.0, -9.81],
            gravity_at_rest: [0.0, 0.0, -9.81],
            forces: forces.as_ptr(),
            pressures: raw.as_ptr(),
            pressure_count: 2,
            ..drive
        };
        let pressures = [
            Pressure {
                nodes: &[],
                pascal: 20.0 * size,
            },
            Pressure {
                nodes: &domain,
                pascal: -5.0 * size,
            },
        ];
        let ours = StepInput {
            contact: match t < 4 {
                true => Contact::None,
                false => Contact::Tools(&tools),
            },
            loads: Loads {
                gravity: [size, 0.0, -9.81],
                gravity_at_rest: [0.0, 0.0, -9.81],
                forces: Some(&forces),
                pressures: &pressures,
                ..Loads::default()
            },
            ..StepInput::default()
        };
        let wanted = rust(&own, ours);
        assert_eq!(step(direct, &input), wanted, "step {t}");
        assert_eq!(submitted(worker, &input), wanted, "submitted step {t}");
        assert_ne!(wanted, last, "step {t} moves");
        last = wanted;
    }
}

#[test]
fn a_body_under_a_load_is_awake_and_comes_to_rest_after_it() {
    let model = model(BUNDLE);
    let own = scene(&model, &SceneOptions::default());
    let mut u = vec![0.0; 3 * own.node_count()];
    let sway = |gravity: f32| StepInput {
        loads: Loads {
            gravity: [gravity, 0.0, 0.0],
            ..Loads::default()
        },
        ..StepInput::default()
    };
    for _ in 0..10 {
        own.step(Contact::None, None).unwrap();
    }
    assert!(own.stats().sleeping);
    for _ in 0..40 {
        own.step(sway(3.0), Some(&mut u)).unwrap();
        assert!(!own.stats().sleeping);
        assert_eq!(own.stats().flags & flag::GROWTH, 0);
    }
    let mean: f32 = u.iter().step_by(3).sum::<f32>() / own.node_count() as f32;
    assert!(mean > 0.05, "{mean} mm along gravity");
    // Twice the load, twice the sag, as far as the body is linear.
    let before = mean;
    for _ in 0..40 {
        own.step(sway(6.0), Some(&mut u)).unwrap();
    }
    let mean: f32 = u.iter().step_by(3).sum::<f32>() / own.node_count() as f32;
    assert!((mean / before - 2.0).abs() < 0.1, "{before} and {mean} mm");
    for _ in 0..80 {
        own.step(Contact::None, Some(&mut u)).unwrap();
    }
    assert!(own.stats().sleeping, "{} mm are left", largest(&u));
    assert_eq!(largest(&u), 0.0);
}

/// Forces on the nodes hold the body where gravity would let it: the same field, by another way.
/// Verifies REQ-070.
#[test]
fn forces_that_are_the_weight_are_gravity() {
    let model = model(BUNDLE);
    let (one, other) = (scene(&model, &plain()), scene(&model, &plain()));
    // A quarter of each element at its corners, 1 g/cm³.
    let (positions, tets) = (model.positions(), model.indices(IndexSet::Tets));
    let mut forces = vec![0.0f32; positions.len()];
    for tet in tets.chunks_exact(4) {
        let corner = |k: usize| {
            let at = 3 * tet[k] as usize;
            [0, 1, 2].map(|axis| f64::from(positions[at + axis]))
        };
        let first = corner(0);
        let [a, b, c] = [1, 2, 3].map(|k| {
            let end = corner(k);
            [0, 1, 2].map(|axis| end[axis] - first[axis])
        });
        let six = a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        for &node in tet {
            // mm³ at 1e-3 g/mm³ under 2000 mm/s² in µN, a thousandth of it in mN.
            forces[3 * node as usize] += (six / 24.0 * 1e-3 * 2000.0 * 1e-3) as f32;
        }
    }
    let mut fields = [vec![0.0f32; positions.len()], vec![0.0f32; positions.len()]];
    let by_gravity = Loads {
        gravity: [2.0, 0.0, 0.0],
        ..Loads::default()
    };
    let by_forces = Loads {
        forces: Some(&forces),
        ..Loads::default()
    };
    for _ in 0..30 {
        for ((own, loads), u) in [(&one, by_gravity), (&other, by_forces)]
            .into_iter()
            .zip(&mut fields)
        {
            let input = StepInput {
                loads,
                ..StepInput::default()
            };
            own.step(input, Some(u)).unwrap();
        }
    }
    let off = fields[0].iter().zip(&fields[1]);
    let off = off.fold(0.0f32, |most, (a, b)| most.max((a - b).abs()));
    let moved = largest(&fields[0]);
    assert!(moved > 0.05 && off < 5e-3 * moved, "{off} of {moved} mm");
}

/// No contact moves the hemisphere without a domain, and the block bases that contact is made of hardly hold it.
#[test]
fn the_half_that_no_tool_reaches_turns_with_gravity_too() {
    let options = SceneOptions {
        corrections: Corrections::Fixed(2),
        ..plain()
    };
    let scene = scene(&model(fixture::shipped("brain-coarse-reduced")), &options);
    let positions = scene.model().positions();
    let mut u = vec![0.0; positions.len()];
    for t in 1..=12 {
        let loads = Loads {
            gravity: [0.0, 0.025 * t as f32, 0.0],
            ..Loads::default()
        };
        let input = StepInput {
            loads,
            ..StepInput::default()
        };
        scene.step(input, Some(&mut u)).unwrap();
    }
    let half = |side: f32| {
        let rows = positions.chunks_exact(3).zip(u.chunks_exact(3));
        let own: Vec<f32> = rows
            .filter(|(x, _)| x[0] * side > 5.0)
            .map(|(_, u)| u[1])
            .collect();
        own.iter().sum::<f32>() / own.len() as f32
    };
    let [left, right] = [-1.0, 1.0].map(half);
    println!("{left} and {right} mm");
    assert!(left > 0.5, "{left} mm");
    assert!((left / right - 1.0).abs() < 0.1, "{left} and {right} mm");
}

#[test]
fn a_snapshot_under_loads_resumes_to_the_bit() {
    let model = model(BUNDLE);
    let (one, other) = (scene(&model, &plain()), scene(&model, &plain()));
    let nodes = model.indices(IndexSet::DomainNodes);
    let host = Host::new(BUNDLE, awake);
    let tools = [tool(&ball(&host, 0.5))];
    let input = |t: usize, pressures: &'static [Pressure<'static>]| StepInput {
        loads: Loads {
            gravity: [0.3 * t as f32, 0.0, 0.0],
            pressures,
            ..Loads::default()
        },
        ..StepInput::default()
    };
    static PRESSURES: [Pressure<'static>; 1] = [Pressure {
        nodes: &[],
        pascal: 30.0,
    }];
    assert!(!nodes.is_empty());
    for t in 0..5 {
        one.step(input(t, &PRESSURES), None).unwrap();
    }
    other.restore(&one.save().unwrap()).unwrap();
    for t in 5..12 {
        // The pressure goes, a tool comes, at last gravity is as it was.
        let mut next = input(if t == 11 { 0 } else { t }, &[]);
        if t > 7 {
            next.contact = Contact::Tools(&tools);
        }
        assert_eq!(rust(&one, next), rust(&other, next), "step {t}");
    }
    assert_eq!(one.save().unwrap(), other.save().unwrap());
    one.reset().unwrap();
    let fresh = scene(&model, &plain());
    assert_eq!(
        rust(&one, input(2, &PRESSURES)),
        rust(&fresh, input(2, &PRESSURES)),
        "a reset scene has no loads"
    );
}

/// Verifies REQ-070.
#[test]
fn bad_loads_are_named_and_change_nothing() {
    let model = model(BUNDLE);
    let own = scene(&model, &plain());
    let sway = Loads {
        gravity: [3.0, 0.0, 0.0],
        ..Loads::default()
    };
    let input = |loads| StepInput {
        loads,
        ..StepInput::default()
    };
    own.step(input(sway), None).unwrap();
    let saved = own.save().unwrap();
    let three = [1.0f32; 3];
    let mut unreal = vec![0.0f32; 3 * own.node_count()];
    unreal[4] = f32::INFINITY;
    let with = |nodes, pascal| [Pressure { nodes, pascal }];
    let [huge, apart, beyond, nan] = [
        with(&[], 1e9),
        with(&[0], 10.0),
        with(&[1 << 30], 10.0),
        with(&[], f32::NAN),
    ];
    let many = [Pressure::default(); 33];
    let bad: [(&str, Loads<'_>); 8] = [
        (
            "gravity[1]",
            Loads {
                gravity: [0.0, f32::NAN, 0.0],
                ..sway
            },
        ),
        (
            "gravity_at_rest[2]",
            Loads {
                gravity_at_rest: [0.0, 0.0, 9810.0],
                ..sway
            },
        ),
        (
            "forces",
            Loads {
                forces: Some(&three),
                ..sway
            },
        ),
        (
            "node 1",
            Loads {
                forces: Some(&unreal),
                ..sway
            },
        ),
        (
            "pressures[0].pascal is 1000000000",
            Loads {
                pressures: &huge,
                ..sway
            },
        ),
        (
            "no boundary triangle",
            Loads {
                pressures: &apart,
                ..sway
            },
        ),
        (
            "beyond the mesh",
            Loads {
                pressures: &beyond,
                ..sway
            },
        ),
        (
            "at most 32",
            Loads {
                pressures: &many,
                ..sway
            },
        ),
    ];
    for (named, loads) in bad {
        let error = own.step(input(loads), None).unwrap_err();
        assert!(error.to_string().contains(named), "{named}: {error}");
        assert!(own.save().unwrap() == saved, "{named} changed the state");
    }
    let loads = Loads {
        pressures: &nan,
        ..sway
    };
    let error = own.submit(input(loads)).unwrap_err();
    assert!(matches!(error, Error::NonFinite(_)), "{error}");
    let uncorrected = SceneOptions {
        corrections: Corrections::None,
        ..plain()
    };
    let error = scene(&model, &uncorrected)
        .step(input(sway), None)
        .unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    let mut u = vec![0.0; 3 * own.node_count()];
    own.step(input(sway), Some(&mut u)).unwrap();
    assert!(!bits(&u).is_empty() && largest(&u) > 0.0);
}
