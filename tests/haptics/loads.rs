//! Hands in tissue under loads: gravity, and what relaxing tissue remembers.

use super::fixture::relaxing;
use super::*;
use upt::{Loads, StepInput};

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
