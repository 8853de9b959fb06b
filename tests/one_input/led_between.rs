//! Support groups between steps: in frames and in a hand's loop.

use upt::haptics::{HapticOptions, HapticPose};
use upt::{Contact, Error, GroupMotion, StepInput, SupportPose, View};

use super::{at, largest, led, moved, nodes, open};
use crate::{BUNDLE, ball, tool};
use fixture::host::Host;
use fixture::{bits, plain, scene};

const DT: f64 = 0.05;

/// Up by a millimetre and down, five times in two seconds.
fn lifted(seconds: f64) -> SupportPose {
    SupportPose {
        position: [
            0.0,
            0.0,
            (0.5 - 0.5 * (5.0 * std::f64::consts::PI * seconds).cos()) as f32,
        ],
        rotation: [0.0, 0.0, 0.0, 1.0],
    }
}

fn apart(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    squares.sum::<f64>() / (a.len() / 3) as f64
}

/// A frame has a group where the host has it then, to the bit of its place, and the tissue around follows: at the time of the next step the frame is nearer to
/// that step than one in which the group goes on as it went. What is wrong is refused; nothing of a frame stays.
#[test]
fn a_frame_has_a_group_where_it_is_at_that_time() {
    let (_folder, model) = open();
    let [scene, other] = [0; 2].map(|_| scene(&model, &plain()));
    let own = nodes(&scene, 1);
    let mut u = vec![0.0; 3 * scene.node_count()];
    let (mut shown, mut again) = (u.clone(), u.clone());
    let mut sums = [0.0f64; 2];
    for t in 0..40 {
        let now = DT * f64::from(t);
        if t > 0 {
            for part in [0.5, 1.0] {
                let to = lifted(now - DT + part * DT);
                let groups = [moved(1, to)];
                let show = |input, out: &mut [f32]| {
                    scene.present(input, part * DT, View::Region, out).unwrap();
                };
                show(led(&groups), &mut shown);
                show(led(&[]), &mut again);
                if t > 1 {
                    for row in at(&shown, &own).as_chunks::<3>().0 {
                        assert_eq!(row[2], to.position[2], "step {t}");
                    }
                    assert_eq!(largest(&at(&shown, &nodes(&scene, 0))), 0.0);
                }
            }
        }
        let groups = [moved(1, lifted(now))];
        scene.step(led(&groups), Some(&mut u)).unwrap();
        if t > 2 {
            sums[0] += apart(&shown, &u);
            sums[1] += apart(&again, &u);
        }
        // Frames leave no trace.
        other.step(led(&groups), Some(&mut again)).unwrap();
        assert_eq!(bits(&again), bits(&u), "step {t}");
    }
    println!(
        "frames with the groups {:e} mm², without {:e}",
        sums[0] / 37.0,
        sums[1] / 37.0
    );
    assert!(sums[0] < 0.25 * sums[1], "{sums:?}");
    let wrong = [GroupMotion {
        group: 2,
        ..GroupMotion::default()
    }];
    let refused = scene.present(led(&wrong), 0.01, View::Region, &mut shown);
    assert!(matches!(refused, Err(Error::Argument(text)) if text.contains("group 2")));
    let far = [moved(
        1,
        SupportPose {
            position: [90.0, 0.0, 0.0],
            ..lifted(0.0)
        },
    )];
    let refused = scene.present(led(&far), 0.01, View::Region, &mut shown);
    assert!(matches!(refused, Err(Error::Argument(text)) if text.contains("90.0 mm")));
}

/// A ball that rests is pressed into by tissue that its supports lift: between steps a hand feels that as the steps do.
#[test]
fn a_hand_feels_tissue_that_a_support_carries() {
    let (_folder, model) = open();
    let scene = scene(&model, &plain());
    let host = Host::new(BUNDLE, crate::awake);
    let ball = tool(&ball(&host, 0.5));
    let options = HapticOptions {
        latency_s: Some(0.0),
        blend_s: 0.0,
        ..HapticOptions::new(0, ball.clone())
    };
    let mut hand = scene.haptics(&options).unwrap();
    let tools = [ball.clone()];
    let (mut sums, mut last, mut before) = ([0.0f64; 2], 0.0f32, 0.0f32);
    for t in 0..30 {
        let now = DT * f64::from(t);
        let to = SupportPose {
            position: [0.0, 0.0, (6.0 * (now - 0.3).max(0.0)) as f32],
            ..lifted(0.0)
        };
        let groups = [moved(0, to), moved(1, to)];
        let contact = Contact::Tools(&tools);
        let input = StepInput {
            contact,
            ..led(&groups)
        };
        scene.step(input, None).unwrap();
        let told = scene.with_contact_report(|report| report.readings[0].force[2]);
        if t > 8 {
            sums[0] += f64::from(last - told).abs();
            sums[1] += f64::from(before - told).abs();
        }
        before = told;
        for tick in 1..=50 {
            let pose = HapticPose {
                time_s: now + 1e-3 * f64::from(tick),
                position_m: ball.pose.translation.to_array().map(|x| 1e-3 * x),
                rotation: [0.0, 0.0, 0.0, 1.0],
                velocity: None,
            };
            last = 1e3 * hand.render(&pose).unwrap().force_n[2];
        }
    }
    println!(
        "the hand is {:.1} mN off at a step's end, the step before {:.1}",
        sums[0] / 21.0,
        sums[1] / 21.0
    );
    assert!(sums[0] < 0.5 * sums[1], "{sums:?}");
}
