//! Ties of an input: closed forms, the bits of the Rust interface, breaking, snapshots.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use upt::ffi::*;
use upt::{
    Contact, Corrections, Loads, Scene, SceneOptions, Spring, StepInput, Tie, TieEnd, TiePoint,
    TieReading, Vector,
};

use crate::{BUNDLE, awake, ball, rust, step, submitted, tool};
use fixture::host::{Host, indices, message};
use fixture::{bits, model, plain, scene};

pub fn thorough() -> SceneOptions {
    SceneOptions {
        corrections: Corrections::Fixed(20),
        ..plain()
    }
}

fn field(bits: &[u32]) -> Vec<f32> {
    bits.iter().map(|bits| f32::from_bits(*bits)).collect()
}

pub fn place(scene: &Scene, node: u32) -> Vector {
    let at = 3 * node as usize;
    Vector::from_slice(&scene.model().positions()[at..at + 3])
}

pub fn middle(scene: &Scene) -> u32 {
    let domain = scene.model().indices(upt::IndexSet::DomainNodes);
    domain[domain.len() / 2]
}

/// A thread from a node of the domain, `up` above where the node is at rest.
pub fn thread(scene: &Scene, node: u32, stiffness: f32, slack_mm: f32, up: f32) -> Tie {
    Tie {
        point: TiePoint {
            nodes: [node; 3],
            weights: [1.0, 0.0, 0.0],
        },
        end: TieEnd::Support(place(scene, node) + Vector::Z * up),
        spring: Spring {
            stiffness,
            slack_mm,
            ..Spring::default()
        },
        break_mn: 0.0,
    }
}

pub fn with<'a>(ties: &'a [Tie], contact: Contact<'a>) -> StepInput<'a> {
    let loads = Loads {
        ties,
        ..Loads::default()
    };
    StepInput {
        contact,
        loads,
        ..StepInput::default()
    }
}

pub fn hang(scene: &Scene, ties: &[Tie], steps: u32) -> (Vec<f32>, Vec<TieReading>) {
    let mut u = Vec::new();
    for _ in 0..steps {
        u = field(&rust(scene, with(ties, Contact::None)));
    }
    (u, scene.tie_readings().unwrap())
}

/// Soft, stiff and 1e4 N/m: the force is the spring's at the tie's length, and the tissue lies where the same force on the node takes it.
/// Verifies REQ-072.
#[test]
fn a_tie_pulls_as_its_spring_and_the_tissue_as_under_that_force() {
    for stiffness in [0.5f32, 20.0, 1e4] {
        let [tied, forced] = [0; 2].map(|_| scene(&model(BUNDLE), &thorough()));
        let node = middle(&tied);
        let tie = thread(&tied, node, stiffness, 2.0, 3.0);
        let (u, readings) = hang(&tied, &[tie], 50);
        let [reading] = readings[..] else {
            panic!("a tie")
        };
        let own = stiffness * (reading.length_mm - 2.0);
        let force = reading.force[2];
        println!(
            "{stiffness} N/m: {force} mN of {own}, {} mm",
            reading.length_mm
        );
        assert!(
            force > 0.05 && (force - own).abs() < 5e-3 * force + 2e-5 * stiffness,
            "{force} {own}"
        );
        let mut forces = vec![0.0; u.len()];
        forces[3 * node as usize..][..3].copy_from_slice(&reading.force);
        let loads = Loads {
            forces: Some(&forces),
            ..Loads::default()
        };
        let mut wanted = Vec::new();
        for _ in 0..50 {
            wanted = field(&rust(
                &forced,
                StepInput {
                    loads,
                    ..StepInput::default()
                },
            ));
        }
        let at = 3 * node as usize + 2;
        println!("{} for {} mm", u[at], wanted[at]);
        assert!(
            (u[at] - wanted[at]).abs() < 0.02 * wanted[at],
            "{} for {}",
            u[at],
            wanted[at]
        );
    }
}

pub fn raw(tie: &Tie) -> upt_tie {
    let (to, place, instrument) = match tie.end {
        TieEnd::Support(place) => (UPT_END_SUPPORT, place, 0),
        TieEnd::World(place) => (UPT_END_WORLD, place, 0),
        TieEnd::Tool { tool, place } => (UPT_END_INSTRUMENT, place, tool),
        TieEnd::Tissue(_) => (UPT_END_TISSUE, Vector::ZERO, 0),
    };
    let far = match tie.end {
        TieEnd::Tissue(far) => far,
        _ => tie.point,
    };
    upt_tie {
        to,
        nodes: tie.point.nodes,
        weights: tie.point.weights,
        place: place.to_array(),
        instrument,
        other_nodes: far.nodes,
        other_weights: far.weights,
        stiffness: tie.spring.stiffness,
        slack_mm: tie.spring.slack_mm,
        damping: tie.spring.damping,
        break_mn: tie.break_mn,
        pushes: tie.spring.pushes.into(),
        ..upt_tie::NONE
    }
}

/// Every kind of far end, with a ball pressed in and without, one breaking; by a step, a submitted step and on several threads, and frames after them.
#[test]
fn ties_give_the_same_bits_however_they_are_given() {
    let hosts = [Host::new(BUNDLE, awake), Host::new(BUNDLE, awake)];
    let [direct, worker] = &hosts;
    let threads = |threads| SceneOptions { threads, ..plain() };
    let [own, alone] = [2, 1].map(|count| scene(&model(BUNDLE), &threads(count)));
    let domain = indices(direct.model, UPT_SET_DOMAIN_NODES);
    let (first, last) = (domain[1], domain[domain.len() - 2]);
    let mut broke = 0;
    for t in 0..14 {
        let pressing = [ball(direct, 0.1 * t as f32)];
        let tools = [tool(&pressing[0])];
        let up = 0.3 * t as f32;
        let mut world = thread(&own, first, 5.0, 1.0, up);
        let TieEnd::Support(at) = world.end else {
            unreachable!()
        };
        world.end = TieEnd::World(at);
        world.spring.damping = 0.05;
        let mut brittle = thread(&own, domain[domain.len() / 3], 30.0, 0.0, up);
        brittle.break_mn = 8.0;
        let suture = Tie {
            end: TieEnd::Tissue(brittle.point),
            ..thread(&own, last, 2.0, 1.0, 0.0)
        };
        let mut rod = thread(&own, domain[domain.len() / 2 + 3], 3.0, 6.0, 4.0);
        rod.spring.pushes = true;
        let mut ties = vec![world, brittle, suture, rod];
        if t >= 5 {
            ties.push(Tie {
                end: TieEnd::Tool {
                    tool: 0,
                    place: Vector::new(0.0, 0.0, 2.0),
                },
                ..thread(&own, domain[domain.len() / 2], 4.0, 0.5, 0.0)
            });
        }
        let (drive, contact) = match t < 5 {
            true => (upt_input::NOTHING, Contact::None),
            false => (upt_input::of_instruments(&pressing), Contact::Tools(&tools)),
        };
        let given: Vec<upt_tie> = ties.iter().map(raw).collect();
        let input = upt_input {
            ties: given.as_ptr(),
            tie_count: given.len() as u64,
            ..drive
        };
        let made = rust(&own, with(&ties, contact));
        assert_eq!(
            rust(&alone, with(&ties, contact)),
            made,
            "threads, step {t}"
        );
        assert_eq!(step(direct, &input), made, "step {t}");
        assert_eq!(submitted(worker, &input), made, "submitted step {t}");
        let readings = own.tie_readings().unwrap();
        let mut told = vec![
            upt_tie_reading {
                struct_size: size_of::<upt_tie_reading>() as u32,
                broken: 0,
                broke: 0,
                reserved: [0; 2],
                force: [0.0; 3],
                length_mm: 0.0
            };
            ties.len()
        ];
        let status =
            unsafe { upt_scene_read_ties(direct.scene, told.as_mut_ptr(), told.len() as u64) };
        assert_eq!(status, UPT_OK, "{}", message());
        for (told, reading) in told.iter().zip(&readings) {
            assert_eq!(
                (told.force, told.length_mm),
                (reading.force, reading.length_mm)
            );
            assert_eq!(
                (told.broken, told.broke),
                (reading.broken.into(), reading.broke.into())
            );
        }
        broke += readings.iter().filter(|reading| reading.broke).count();
        if t >= 5 {
            // The tool feels its tie.
            let pull = Vector::from(readings[4].force).length();
            let own_contacts = own.with_contact_report(|report| report.pushes.len());
            let felt = own.with_contact_report(|report| Vector::from(report.readings[0].force));
            let pushed: Vector = own.with_contact_report(|report| {
                report
                    .pushes
                    .iter()
                    .map(|push| Vector::from(push.force))
                    .sum()
            });
            assert!(
                (felt - pushed + Vector::from(readings[4].force)).length() < 1e-3 * (1.0 + pull),
                "{own_contacts} contacts"
            );
        }
        let mut u = vec![0.0; 3 * own.node_count()];
        own.present(contact, 0.02, upt::View::Region, &mut u)
            .unwrap();
        let shown = bits(&u);
        assert_eq!(
            crate::frame(direct, &drive, 0.02),
            shown,
            "frame after step {t}"
        );
        // Frames leave no trace: the next step is compared again.
        assert!(u.iter().all(|u| u.is_finite()));
    }
    assert_eq!(broke, 1, "the brittle one, once");
}

/// A tie breaks at its force; it stays broken, also in a snapshot, heals where it has no stiffness for a step, and with the scene.
/// Verifies REQ-072.
#[test]
fn a_broken_tie_stays_broken_until_it_is_taken_off() {
    let [own, other] = [0; 2].map(|_| scene(&model(BUNDLE), &thorough()));
    let node = middle(&own);
    let pulled = |up: f32| Tie {
        break_mn: 5.0,
        ..thread(&own, node, 10.0, 0.0, up)
    };
    let mut strongest = 0.0f32;
    let mut broke_at = None;
    for t in 0..40 {
        let (_, readings) = hang(&own, &[pulled(0.1 * t as f32)], 1);
        strongest = strongest.max(Vector::from(readings[0].force).length());
        if readings[0].broke {
            assert!(broke_at.replace(t).is_none(), "it breaks once");
        }
        if let Some(step) = broke_at {
            assert!(
                readings[0].broken && readings[0].force == [0.0; 3],
                "{step}: {readings:?}"
            );
        }
    }
    assert!(
        broke_at.is_some() && strongest > 3.0 && strongest <= 5.0,
        "{broke_at:?} {strongest}"
    );
    let saved = own.save().unwrap();
    other.restore(&saved).unwrap();
    for _ in 0..3 {
        let mine = hang(&own, &[pulled(0.3)], 1);
        assert_eq!(hang(&other, &[pulled(0.3)], 1), mine);
        assert!(mine.1[0].broken);
    }
    let off = Tie {
        spring: Spring::default(),
        ..pulled(0.3)
    };
    assert!(!hang(&own, &[off], 1).1[0].broken);
    assert!(hang(&own, &[pulled(0.3)], 1).1[0].force[2] > 0.1, "healed");
    other.reset().unwrap();
    assert!(
        hang(&other, &[pulled(0.3)], 1).1[0].force[2] > 0.1,
        "healed"
    );
    // Taut ones in a snapshot, to the bit; and tissue whose tie has gone comes back to rest.
    let saved = other.save().unwrap();
    let next = hang(&other, &[pulled(0.35)], 3);
    own.restore(&saved).unwrap();
    assert_eq!(hang(&own, &[pulled(0.35)], 3), next);
    let (u, none) = hang(&own, &[], 60);
    assert!(none.is_empty() && u.iter().all(|u| u.abs() < 0.02));
}
