//! Beds, points of ties, and ties that there cannot be.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use std::ptr::{null, null_mut};

use upt::ffi::*;
use upt::{Bed, Contact, Error, Loads, Spring, StepInput, Tie, TieEnd, Vector};

use crate::ties::{hang, middle, place, raw, thorough, thread, with};
use crate::{BUNDLE, awake, rust};
use fixture::host::{Host, message};
use fixture::{model, plain, scene};

/// A bed is one call, whose ties share its stiffness; pulled by its middle the ties there break first, and then farther out.
#[test]
fn a_bed_is_made_by_one_call_and_tears_node_by_node() {
    let host = Host::new(BUNDLE, awake);
    let own = scene(&model(BUNDLE), &thorough());
    let centre = place(&own, middle(&own)).to_array();
    let spring = Spring {
        stiffness: 40.0,
        ..Spring::default()
    };
    let bed = Bed {
        nodes: &[],
        centre,
        radius_mm: 30.0,
        spring,
        break_mn: 30.0,
        offset: [0.0; 3],
    };
    let ties = own.bed(&bed).unwrap();
    assert!(ties.len() > 8, "{}", ties.len());
    let whole: f32 = ties.iter().map(|tie| tie.spring.stiffness).sum();
    assert!((whole - 40.0).abs() < 1e-3);
    let raw_bed = upt_bed {
        struct_size: size_of::<upt_bed>() as u32,
        radius_mm: 30.0,
        centre,
        offset: [0.0; 3],
        nodes: null(),
        node_count: 0,
        stiffness: 40.0,
        slack_mm: 0.0,
        damping: 0.0,
        break_mn: 30.0,
        pushes: 0,
        reserved: [0; 7],
    };
    let mut needed = 0;
    let asked = unsafe { upt_scene_bed(host.scene, &raw_bed, null_mut(), 0, &mut needed) };
    assert_eq!(
        (asked, needed),
        (UPT_OK, ties.len() as u64),
        "{}",
        message()
    );
    let mut given = vec![upt_tie::NONE; ties.len()];
    let made = unsafe {
        upt_scene_bed(
            host.scene,
            &raw_bed,
            given.as_mut_ptr(),
            needed,
            &mut needed,
        )
    };
    assert_eq!(made, UPT_OK, "{}", message());
    let wanted: Vec<upt_tie> = ties.iter().map(raw).collect();
    for (given, wanted) in given.iter().zip(&wanted) {
        assert_eq!(
            (given.nodes, given.place, given.stiffness),
            (wanted.nodes, wanted.place, wanted.stiffness)
        );
    }
    // A force on its middle that grows: more and more of it is torn.
    let mut torn = Vec::new();
    let mut forces = vec![0.0; 3 * own.node_count()];
    for t in 0..60 {
        forces[3 * middle(&own) as usize + 2] = 1.2 * t as f32;
        let loads = Loads {
            forces: Some(&forces),
            ties: &ties,
            ..Loads::default()
        };
        rust(
            &own,
            StepInput {
                loads,
                ..StepInput::default()
            },
        );
        let readings = own.tie_readings().unwrap();
        torn.push(readings.iter().filter(|reading| reading.broken).count());
        let most = readings
            .iter()
            .zip(&ties)
            .map(|(reading, tie)| Vector::from(reading.force).length() / tie.break_mn);
        assert!(most.fold(0.0, f32::max) <= 1.0 + 1e-3, "step {t}");
    }
    assert!(torn.is_sorted() && torn[0] == 0, "{torn:?}");
    let partial = torn
        .iter()
        .filter(|count| (1..ties.len()).contains(count))
        .count();
    assert!(partial >= 2, "node by node: {torn:?}");
    let mut points = ([0u32; 6], [0.0f32; 6]);
    let places: Vec<f32> = centre.into_iter().chain([0.0, 0.0, 100.0]).collect();
    let found = unsafe {
        upt_scene_tie_points(
            host.scene,
            places.as_ptr(),
            2,
            points.0.as_mut_ptr(),
            points.1.as_mut_ptr(),
        )
    };
    assert_eq!(found, UPT_OK, "{}", message());
    let nearest = own.tie_point(centre).unwrap();
    let reset = scene(&model(BUNDLE), &plain()).tie_point(centre).unwrap();
    assert_eq!(
        (points.0[..3].to_vec(), points.1[..3].to_vec()),
        (reset.nodes.to_vec(), reset.weights.to_vec())
    );
    assert!(nearest.weights.iter().sum::<f32>() > 0.99);
}

#[test]
fn ties_that_there_cannot_be_are_named_and_change_nothing() {
    let own = scene(&model(BUNDLE), &plain());
    let node = middle(&own);
    let good = thread(&own, node, 5.0, 0.0, 1.0);
    hang(&own, &[good], 3);
    let before = own.save().unwrap();
    let held = own.model().indices(upt::IndexSet::HeldNodes)[0];
    type Change = Box<dyn Fn(&mut Tie)>;
    let bad: Vec<(Change, &str)> = vec![
        (
            Box::new(|tie| tie.spring.stiffness = f32::NAN),
            "not finite",
        ),
        (Box::new(|tie| tie.spring.stiffness = -1.0), "stiffness"),
        (Box::new(|tie| tie.spring.stiffness = 1e9), "stiffness"),
        (Box::new(|tie| tie.spring.slack_mm = -0.1), "slack_mm"),
        (Box::new(|tie| tie.break_mn = -3.0), "break_mn"),
        (
            Box::new(|tie| tie.point.nodes[0] = 1_000_000),
            "node 1000000",
        ),
        (Box::new(|tie| tie.point.weights = [0.3; 3]), "weights"),
        (Box::new(move |tie| tie.point.nodes = [held; 3]), "free"),
        (
            Box::new(|tie| {
                tie.end = TieEnd::Tool {
                    tool: 2,
                    place: Vector::ZERO,
                }
            }),
            "instrument 2",
        ),
        (
            Box::new(|tie| tie.end = TieEnd::World(Vector::splat(f32::INFINITY))),
            "not finite",
        ),
    ];
    for (change, word) in bad {
        let mut tie = good;
        change(&mut tie);
        let error = own
            .step(with(&[good, tie], Contact::None), None)
            .unwrap_err();
        assert!(
            error.to_string().contains(word) && error.to_string().contains("ties[1]"),
            "{error}"
        );
        assert_eq!(own.save().unwrap(), before, "{word}");
    }
    let many = vec![good; 257];
    let nodes = [node];
    let sparse = Contact::Sparse {
        nodes: &nodes,
        vectors: &[0.0, 0.0, -0.1],
    };
    for (input, word) in [
        (with(&many, Contact::None), "256"),
        (with(&[good], sparse), "prescribed"),
    ] {
        let error = own.step(input, None).unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
        assert_eq!(own.save().unwrap(), before, "{word}");
    }
    let bare = scene(&model("tiny-reduced"), &plain());
    let error = bare.step(
        with(
            &[thread(&bare, middle(&bare), 1.0, 0.0, 1.0)],
            Contact::None,
        ),
        None,
    );
    assert!(matches!(error, Err(Error::Unsupported(_))), "{error:?}");
}
