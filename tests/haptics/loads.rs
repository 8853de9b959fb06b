//! Hands in tissue under loads: gravity, ties, and what relaxing tissue remembers.

use super::*;
use contact::Vector;
use fixture::relaxing;
use upt::{Loads, Spring, StepInput, Tie, TieEnd, TiePoint};

/// Under a hand that holds still the force falls as the steps say, and runs on between them.
#[test]
fn a_hand_that_stays_feels_the_tissue_relax() {
    let branches = serde_json::json!([{"share": 0.4, "tau_s": 0.1}, {"share": 0.3, "tau_s": 0.8}]);
    let (_folder, model) = relaxing(branches, 1.0);
    let scene = scene(&model, &corrected());
    let mut hand = hand(&scene);
    let (mut told, mut felt_there) = (Vec::new(), Vec::new());
    let (mut last, mut jump) = (0.0f32, 0.0f32);
    for t in 0..60 {
        step(&scene, &[ball(&scene, 1.0)]);
        told.push(felt(&scene)[2]);
        for k in 0..50 {
            let time = DT * f64::from(t) + 1e-3 * f64::from(k);
            let force = 1e3 * hand.render(&pose(&scene, 1.0, time)).unwrap().force_n[2];
            if t > 4 {
                jump = jump.max((force - last).abs());
            }
            last = force;
        }
        felt_there.push(last);
    }
    assert!(told[59] < 0.8 * told[3], "{} of {} mN", told[59], told[3]);
    for t in 5..59 {
        // Within a step the hand goes on with the step's own force; the next says what it has fallen to.
        let (now, next) = (told[t], told[t + 1]);
        let own = felt_there[t];
        assert!(
            (0.97 * next..1.03 * now).contains(&own),
            "step {t}: {own} between {now} and {next} mN"
        );
    }
    assert!(jump < 0.02 * told[3], "{jump} mN in a millisecond");
}

/// A load that goes on as it was moves nothing that a hand feels between two steps.
#[test]
fn a_hand_that_stays_feels_no_more_of_gravity_than_the_step_told() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    let loads = Loads {
        gravity: [4.0, 0.0, 5.0],
        ..Loads::default()
    };
    for t in 0..40 {
        let tools = [ball(&scene, 1.0)];
        let input = StepInput {
            contact: Contact::Tools(&tools),
            loads,
            ..StepInput::default()
        };
        scene.step(input, None).unwrap();
        for k in 0..50 {
            let time = DT * f64::from(t) + 1e-3 * f64::from(k);
            let force = hand.render(&pose(&scene, 1.0, time)).unwrap();
            if t == 39 && k == 49 {
                let told = felt(&scene);
                let beside = [0, 1, 2].map(|k| 1e3 * force.force_n[k] - told[k]);
                assert!(told[2] > 1.0, "{told:?}");
                assert!(size(&beside) < 0.03 * size(&told), "{force:?} {told:?}");
            }
        }
    }
}

/// A tool that is tied to the tissue feels the tie at its own pose: what the step told where it stays, and more at once where it draws away.
#[test]
fn a_hand_feels_the_ties_of_its_tool() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut hand = hand(&scene);
    let place = top(&scene);
    let node = scene
        .mesh()
        .domain
        .nodes
        .iter()
        .copied()
        .find(|node| scene.mesh().positions[3 * *node as usize..][..3] == place)
        .unwrap();
    let tie = Tie {
        point: TiePoint {
            nodes: [node; 3],
            weights: [1.0, 0.0, 0.0],
        },
        end: TieEnd::Tool {
            tool: 0,
            place: Vector::ZERO,
        },
        spring: Spring {
            stiffness: 15.0,
            slack_mm: 4.0,
            ..Spring::default()
        },
        break_mn: 0.0,
    };
    let mut told = Vec::new();
    // 6 mm above the tissue it is drawn up by another 2 mm, at the end within one step.
    let depth = |t: u32, k: u32| match (t, k) {
        (0..40, _) => -6.0,
        (40, _) => -6.0 - 0.02 * f64::from(k),
        _ => -7.0,
    };
    let (mut felt_there, mut within) = (Vec::new(), Vec::new());
    for t in 0..60u32 {
        let tools = [ball(&scene, depth(t, 0))];
        let ties = [tie];
        let input = StepInput {
            contact: Contact::Tools(&tools),
            loads: Loads {
                ties: &ties,
                ..Loads::default()
            },
            ..StepInput::default()
        };
        scene.step(input, None).unwrap();
        told.push(felt(&scene)[2]);
        for k in 0..50 {
            let time = DT * f64::from(t) + 1e-3 * f64::from(k);
            let force = hand.render(&pose(&scene, depth(t, k), time)).unwrap();
            let force = 1e3 * force.force_n[2];
            if t == 40 {
                within.push(force);
            }
            felt_there.push(force);
        }
    }
    assert!(told[39] < -20.0, "{} mN", told[39]);
    let rests = felt_there[50 * 39 + 49];
    assert!(
        (rests / told[39] - 1.0).abs() < 0.02,
        "{rests} {} mN",
        told[39]
    );
    // Drawn up by 0.98 mm it pulls harder in each millisecond, about as hard as the steps say that come to rest there.
    assert!(
        within
            .windows(2)
            .skip(2)
            .all(|pair| pair[1] <= pair[0] + 1e-3)
    );
    let (end, rest) = (within[49], told[59]);
    println!("{rests} mN, drawn up {end}, the steps {rest}");
    assert!(
        end < rests - 3.0 && (end / rest - 1.0).abs() < 0.1,
        "{end} {rest}"
    );
    // Cut, it pulls no more.
    step(&scene, &[ball(&scene, -7.0)]);
    for k in 0..100 {
        let time = DT * 60.0 + 1e-3 * f64::from(k);
        hand.render(&pose(&scene, -7.0, time)).unwrap();
    }
    let force = hand.render(&pose(&scene, -7.0, DT * 63.0)).unwrap().force_n;
    assert!(size(&force) < 1e-3, "{force:?}");
}
