//! The contact solver against closed forms, and its conditions over random problems.

use contact::{Contact, Law, Limits, Spring, Sweeps, Vector, Whole};
use proptest::prelude::*;

/// `W = 1/k I` for every contact: springs that do not know each other.
fn springs(n: usize, stiffness: f32) -> Vec<f32> {
    let mut w = vec![0.0; 9 * n * n];
    (0..3 * n).for_each(|i| w[i * (3 * n + 1)] = 1.0 / stiffness);
    w
}

fn touch(normal: Vector, gap: f32, slip: Vector, friction: f32) -> Contact {
    Contact {
        law: Law::Touch { friction },
        normal,
        gap,
        slip,
    }
}

#[test]
fn a_sphere_on_a_spring_pushes_with_stiffness_times_depth() {
    let mut sweeps = Sweeps::default();
    let normal = Vector::new(0.6, 0.0, 0.8);
    for depth in [0.1f32, 1.0, 4.0] {
        let mut forces = [Vector::ZERO];
        let contact = touch(normal, -depth, Vector::ZERO, 0.0);
        let outcome = sweeps.solve(
            &mut Whole::new(&springs(1, 25.0), 1),
            &[contact],
            &mut forces,
            Limits::default(),
        );
        assert!(outcome.converged);
        assert!((forces[0] - normal * 25.0 * depth).length() < 1e-4 * 25.0 * depth);
        assert!((sweeps.shift(0) - normal * depth).length() < 1e-5 * depth);
    }
    // Apart: nothing, whatever force came in.
    let mut forces = [normal * 10.0];
    let contact = touch(normal, 1.0, Vector::ZERO, 0.3);
    sweeps.solve(
        &mut Whole::new(&springs(1, 25.0), 1),
        &[contact],
        &mut forces,
        Limits::default(),
    );
    assert_eq!(forces[0], Vector::ZERO);
}

#[test]
fn it_sticks_below_mu_times_the_normal_force_and_slips_at_it() {
    let (normal, along) = (Vector::Z, Vector::new(0.6, 0.8, 0.0));
    let mut sweeps = Sweeps::default();
    for (slip, sticks) in [(0.2, true), (0.29, true), (0.31, false), (2.0, false)] {
        let mut forces = [Vector::ZERO];
        let contact = touch(normal, -1.0, along * slip, 0.3);
        sweeps.solve(
            &mut Whole::new(&springs(1, 10.0), 1),
            &[contact],
            &mut forces,
            Limits::default(),
        );
        assert!((forces[0].z - 10.0).abs() < 1e-3);
        let expected = if sticks { 10.0 * slip } else { 3.0 };
        assert!(
            (forces[0].dot(along) + expected).abs() < 1e-3,
            "{slip}: {:?}",
            forces[0]
        );
        let left = along * slip + Vector::new(sweeps.shift(0).x, sweeps.shift(0).y, 0.0);
        assert_eq!(left.length() < 1e-4, sticks, "{slip}: {left}");
    }
}

#[test]
fn a_bound_sample_follows_its_place_in_every_direction() {
    let mut sweeps = Sweeps::default();
    let way = Vector::new(0.5, -1.0, 2.0);
    let contact = Contact {
        law: Law::Bound,
        normal: Vector::Y,
        gap: 5.0,
        slip: way,
    };
    let mut forces = [Vector::ZERO];
    sweeps.solve(
        &mut Whole::new(&springs(1, 4.0), 1),
        &[contact],
        &mut forces,
        Limits::default(),
    );
    assert!((forces[0] + way * 4.0).length() < 1e-5);
    assert!((sweeps.shift(0) + way).length() < 1e-6);
}

#[test]
fn what_nothing_moves_takes_no_force() {
    let mut forces = [Vector::ONE, Vector::ONE];
    let contacts = [touch(Vector::Z, -1.0, Vector::ZERO, 0.5); 2];
    let mut w = springs(2, 1.0);
    for k in 0..3 {
        w[k * 7] = 0.0;
    }
    let outcome = Sweeps::default().solve(
        &mut Whole::new(&w, contacts.len()),
        &contacts,
        &mut forces,
        Limits::default(),
    );
    assert_eq!(forces[0], Vector::ZERO);
    assert!(
        outcome.converged && (forces[1].z - 2.0).abs() < 1e-5,
        "{forces:?}"
    );
}

/// A thread, the stiffer and the slacker the larger `part` (0 to 0.3) is.
fn tie(part: f32) -> Spring {
    Spring {
        stiffness: 300.0 * part,
        slack_mm: part,
        damping: if part < 0.1 { 0.1 } else { 0.0 },
        pushes: false,
    }
}

/// A problem: `W = G G^T + I / 4` scaled, contacts with random normals, gaps, slips.
fn problem() -> impl Strategy<Value = (Vec<f32>, Vec<Contact>)> {
    (2usize..9, 0.0f32..0.8).prop_flat_map(|(n, friction)| {
        let m = 3 * n;
        let numbers = prop::collection::vec(-1.0f32..1.0, m * m);
        let contacts = prop::collection::vec(
            (
                prop::array::uniform3(-1.0f32..1.0),
                -1.0f32..0.5,
                prop::array::uniform3(-0.5f32..0.5),
                any::<bool>(),
            ),
            n,
        );
        (numbers, contacts).prop_map(move |(g, contacts)| {
            let mut w = vec![0.0; m * m];
            for i in 0..m {
                for j in 0..=i {
                    let sum: f32 = (0..m).map(|k| g[i * m + k] * g[j * m + k]).sum();
                    let value = 0.25 * sum / m as f32 + if i == j { 0.25 } else { 0.0 };
                    w[i * m + j] = value;
                    w[j * m + i] = value;
                }
            }
            let contacts = contacts
                .into_iter()
                .map(|(normal, gap, slip, bound)| Contact {
                    law: match (bound, gap) {
                        (true, 0.3..) => Law::Bound,
                        // Stiff and soft, some of them slack.
                        (true, 0.0..) => Law::Tie(tie(gap).over(gap, 0.05)),
                        _ => Law::Touch { friction },
                    },
                    normal: (Vector::from(normal) + Vector::new(0.0, 0.0, 1e-3)).normalize(),
                    gap,
                    slip: Vector::from(slip),
                })
                .collect();
            (w, contacts)
        })
    })
}

/// The largest violation of the conditions at `forces`, mm and units of force alike.
fn violation(w: &[f32], contacts: &[Contact], forces: &[Vector]) -> f32 {
    let m = 3 * contacts.len();
    let flat: Vec<f32> = forces.iter().flat_map(|f| f.to_array()).collect();
    let shift: Vec<f32> = (0..m)
        .map(|i| (0..m).map(|j| w[i * m + j] * flat[j]).sum())
        .collect();
    let mut worst = 0.0f32;
    for (i, contact) in contacts.iter().enumerate() {
        let moved = Vector::from_slice(&shift[3 * i..]);
        let force = forces[i];
        match contact.law {
            Law::Tie(pull) => {
                let wanted = pull.force(contact.slip + moved);
                worst = worst.max((force - wanted).length() / (1.0 + 300.0 * 0.3));
            }
            Law::Bound => worst = worst.max((contact.slip + moved).abs().max_element()),
            Law::Touch { friction } => {
                let gap = contact.gap + moved.dot(contact.normal);
                let push = force.dot(contact.normal);
                worst = worst.max(-gap).max(-push).max(gap.min(push).abs());
                let across = |v: Vector| v - contact.normal * v.dot(contact.normal);
                let (slip, drag) = (across(contact.slip + moved), across(force));
                worst = worst.max(drag.length() - friction * push);
                // Slip only at the cone's edge, and against the force.
                let lost = friction * push * slip.length() + drag.dot(slip);
                worst = worst.max(lost.abs());
            }
        }
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_conditions_of_contact_hold((w, contacts) in problem()) {
        let mut forces = vec![Vector::ZERO; contacts.len()];
        let limits = Limits { tolerance_mm: 1e-6, most_sweeps: 5000, ..Limits::default() };
        let outcome = Sweeps::default().solve(&mut Whole::new(&w, contacts.len()), &contacts, &mut forces, limits);
        prop_assert!(outcome.sweeps >= 15);
        let worst = violation(&w, &contacts, &forces);
        prop_assert!(worst < 2e-3, "{worst} after {outcome:?}");
    }

    #[test]
    fn a_warm_start_stays_at_the_answer_and_bits_repeat((w, contacts) in problem()) {
        let limits = Limits { tolerance_mm: 1e-6, most_sweeps: 5000, ..Limits::default() };
        let mut sweeps = Sweeps::default();
        sweeps.reserve(contacts.len()).unwrap();
        let mut forces = vec![Vector::ZERO; contacts.len()];
        sweeps.solve(&mut Whole::new(&w, contacts.len()), &contacts, &mut forces, limits);
        let mut again = vec![Vector::ZERO; contacts.len()];
        let shifts: Vec<Vector> = (0..contacts.len()).map(|i| sweeps.shift(i)).collect();
        Sweeps::default().solve(&mut Whole::new(&w, contacts.len()), &contacts, &mut again, limits);
        prop_assert_eq!(&forces, &again);
        // Gaps and slips now belong to the forces found.
        let moved: Vec<Contact> = contacts
            .iter()
            .zip(&shifts)
            .map(|(c, s)| Contact { gap: c.gap + s.dot(c.normal), slip: c.slip + *s, ..*c })
            .collect();
        sweeps.solve(&mut Whole::new(&w, moved.len()), &moved, &mut again, Limits::default());
        for (a, b) in forces.iter().zip(&again) {
            prop_assert!((*a - *b).length() < 5e-3 * (1.0 + a.length()), "{a} {b}");
        }
    }
}
