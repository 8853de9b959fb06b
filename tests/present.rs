//! The tissue between steps: what a frame shows of it.
#![cfg(feature = "instruments")]

#[path = "present/pierced.rs"]
mod pierced;
#[path = "present/relaxing.rs"]
mod relaxing;

use contact::Shape;
use fixture::{bits, model, plain, scene};
use upt::contact::Tool;
use upt::{Contact, Corrections, Error, Scene, SceneOptions, View};

const DT: f64 = 0.05;

fn corrected() -> SceneOptions {
    fixture::corrected(8)
}

/// A ball of radius 3 mm that goes 8 mm/s into the middle of the top, there at `t` steps.
fn pressing(scene: &Scene, t: f64) -> Vec<Tool> {
    let mesh = scene.mesh();
    let place = |node: u32| [0, 1, 2].map(|axis| mesh.positions[3 * node as usize + axis]);
    let count = mesh.domain.nodes.len() as f32;
    let middle = [0, 1].map(|axis| {
        let along = mesh.domain.nodes.iter().map(|&node| place(node)[axis]);
        along.sum::<f32>() / count
    });
    let nearest = mesh.domain.nodes.iter().min_by(|a, b| {
        let far = |node: u32| {
            (0..2)
                .map(|k| (place(node)[k] - middle[k]).powi(2))
                .sum::<f32>()
        };
        far(**a).total_cmp(&far(**b))
    });
    let [x, y, z] = place(*nearest.unwrap());
    let centre = [x, y, z + 3.0 - 0.4 * t as f32];
    let shape = Shape::Sphere { radius: 3.0 };
    vec![Tool::new(&shape, centre, [0.0, 0.0, 0.0, 1.0]).unwrap()]
}

fn step(scene: &Scene, tools: &[Tool]) -> Vec<f32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    scene.step(Contact::Tools(tools), Some(&mut u)).unwrap();
    u
}

fn present(scene: &Scene, seconds: f64, tools: &[Tool]) -> Vec<f32> {
    let mut u = vec![f32::NAN; 3 * scene.region_count()];
    scene
        .present(Contact::Tools(tools), seconds, View::Region, &mut u)
        .unwrap();
    u
}

fn farthest(a: &[f32], b: &[f32]) -> f32 {
    let pairs = a.as_chunks::<3>().0.iter().zip(b.as_chunks::<3>().0);
    let far = |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>();
    pairs.map(|(a, b)| far(a, b)).fold(0.0, f32::max).sqrt()
}

#[test]
fn at_its_own_time_a_step_is_shown_as_it_is() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    for t in 1..6 {
        let tools = pressing(&scene, f64::from(t));
        let u = step(&scene, &tools);
        assert_eq!(bits(&present(&scene, 0.0, &tools)), bits(&u));
        present(&scene, 0.03, &tools);
    }
}

#[test]
fn a_frame_is_nearer_to_the_next_step_than_the_last_one_is() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let square =
        |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum() };
    let (mut of_frames, mut of_last) = (0.0, 0.0);
    let mut last = step(&scene, &pressing(&scene, 1.0));
    for t in 2..10 {
        let tools = pressing(&scene, f64::from(t));
        let shown = present(&scene, DT, &tools);
        let next = step(&scene, &tools);
        of_frames += square(&shown, &next);
        of_last += square(&last, &next);
        last = next;
    }
    assert!(of_frames < 0.3 * of_last, "{of_frames} of {of_last}");
}

#[test]
fn frames_run_on_when_a_step_arrives() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut before: Option<Vec<f32>> = None;
    let (mut within, mut arriving) = (0.0f32, 0.0f32);
    for t in 1..12 {
        step(&scene, &pressing(&scene, f64::from(t)));
        for frame in 1..=5 {
            let part = f64::from(frame) / 5.0;
            let shown = present(&scene, part * DT, &pressing(&scene, f64::from(t) + part));
            if let Some(before) = &before
                && t > 3
            {
                let jump = farthest(&shown, before);
                match frame {
                    1 => arriving = arriving.max(jump),
                    _ => within = within.max(jump),
                }
            }
            before = Some(shown);
        }
    }
    assert!(
        arriving < within + 0.05,
        "{arriving} mm at a step, {within} within"
    );
}

/// Verifies REQ-052.
#[test]
fn the_arrival_of_a_step_moves_nothing_at_its_moment() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    for t in 1..8 {
        let now = pressing(&scene, f64::from(t) + 0.2);
        let before = (t > 1).then(|| present(&scene, 1.2 * DT, &now));
        step(&scene, &pressing(&scene, f64::from(t)));
        let after = present(&scene, 0.2 * DT, &now);
        if let Some(before) = before {
            assert!(farthest(&before, &after) < 1e-4);
        }
        let later = present(&scene, 0.9 * DT, &pressing(&scene, f64::from(t) + 0.9));
        assert!(farthest(&after, &later) < 0.5);
    }
}

#[test]
fn a_host_that_took_a_step_for_the_one_before_shows_the_step_as_it_is() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    for t in 1..4 {
        step(&scene, &pressing(&scene, f64::from(t)));
        present(&scene, 0.02, &pressing(&scene, f64::from(t) + 0.4));
    }
    let u = step(&scene, &pressing(&scene, 4.0));
    // The step has come in while the host still counts from the one before.
    let shown = present(&scene, 0.001, &pressing(&scene, 4.02));
    assert!(farthest(&shown, &u) < 0.05);
}

/// Velocities are followed for two steps; the way over to a step that has arrived goes on after them.
#[test]
fn a_host_that_is_behind_sees_new_steps() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    for t in 1..8 {
        step(&scene, &pressing(&scene, f64::from(t)));
        present(&scene, DT, &pressing(&scene, f64::from(t + 1)));
    }
    for _ in 0..60 {
        present(&scene, 2.5 * DT, &[]);
        step(&scene, &[]);
    }
    let u = step(&scene, &[]);
    let shown = present(&scene, 2.5 * DT, &[]);
    assert!(farthest(&shown, &u) < 0.05, "{}", farthest(&shown, &u));
}

#[test]
fn a_frame_may_be_made_while_a_step_is_in_flight_and_changes_nothing() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    for t in 1..5 {
        step(&scene, &pressing(&scene, f64::from(t)));
    }
    present(&scene, 0.01, &pressing(&scene, 4.2));
    let before = scene.save().unwrap();
    present(&scene, 0.02, &pressing(&scene, 4.4));
    assert!(scene.save().unwrap() == before);
    scene
        .submit(Contact::Tools(&pressing(&scene, 5.0)))
        .unwrap();
    for frame in 0..20 {
        let shown = present(&scene, 0.002 * f64::from(frame), &pressing(&scene, 4.5));
        assert!(shown.iter().all(|x| x.is_finite()));
    }
    scene.wait(std::time::Duration::from_secs(600)).unwrap();
}

#[test]
fn a_region_is_shown_in_its_order() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    for t in 1..5 {
        step(&scene, &pressing(&scene, f64::from(t)));
    }
    let tools = pressing(&scene, 4.5);
    let all = present(&scene, 0.025, &tools);
    let nodes: Vec<u32> = (0..scene.node_count() as u32).rev().step_by(3).collect();
    scene.set_region(Some(&nodes)).unwrap();
    let some = present(&scene, 0.025, &tools);
    for (&node, u) in nodes.iter().zip(some.chunks_exact(3)) {
        assert_eq!(bits(u), bits(&all[3 * node as usize..][..3]), "node {node}");
    }
}

#[test]
fn points_at_nodes_go_with_them() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let rest = scene.mesh().positions.clone();
    let tools = pressing(&scene, 4.5);
    let mut points = vec![0.0; rest.len()];
    let none = scene.present(Contact::Tools(&tools), 0.01, View::Points, &mut points);
    assert!(matches!(none, Err(Error::State(_))));
    scene.attach_points(Some(&rest)).unwrap();
    for t in 1..5 {
        step(&scene, &pressing(&scene, f64::from(t)));
        scene
            .present(Contact::Tools(&tools), 0.01, View::Points, &mut points)
            .unwrap();
        assert!(farthest(&present(&scene, 0.01, &tools), &points) < 1e-3);
    }
    scene
        .present(Contact::Tools(&tools), 0.025, View::Points, &mut points)
        .unwrap();
    assert!(farthest(&present(&scene, 0.025, &tools), &points) < 1e-3);
    assert!(matches!(
        scene.present(Contact::Tools(&tools), 0.01, View::Points, &mut points[3..]),
        Err(Error::Argument(_))
    ));
    // Other points, in flight too.
    scene.attach_points(Some(&rest[..9])).unwrap();
    scene
        .submit(Contact::Tools(&pressing(&scene, 5.0)))
        .unwrap();
    scene
        .present(Contact::Tools(&tools), 0.03, View::Points, &mut points[..9])
        .unwrap();
    scene.wait(std::time::Duration::from_secs(600)).unwrap();
}

/// A tool that comes in at 8 mm/s and stops half way to the next step.
#[test]
fn tissue_stops_with_its_tool() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mut u = Vec::new();
    for t in 1..6 {
        // The frames tell where the tool was in the steps.
        u = step(&scene, &pressing(&scene, f64::from(t)));
        present(&scene, 0.0, &pressing(&scene, f64::from(t)));
    }
    let on = present(&scene, 0.025, &pressing(&scene, 5.5));
    let runs = farthest(&on, &u);
    assert!(runs > 0.1, "{runs}");
    // It has stopped where the step left it: so has the tissue, but far from it.
    let stopped = present(&scene, 0.025, &pressing(&scene, 5.0));
    let left = farthest(&stopped, &u);
    assert!(left < 0.5 * runs, "{left} of {runs}");
}

fn present_contacts(scene: &Scene, seconds: f64, nodes: &[u32], vectors: &[f32]) -> Vec<f32> {
    let mut u = vec![f32::NAN; 3 * scene.region_count()];
    scene
        .present(
            Contact::Sparse { nodes, vectors },
            seconds,
            View::Region,
            &mut u,
        )
        .unwrap();
    u
}

#[test]
fn a_collision_field_is_presented_as_instruments_are() {
    let scene = scene(&model("tiny-corrected"), &corrected());
    let mesh = scene.mesh();
    let free = |node: &&u32| !mesh.held_nodes.contains(node);
    let nodes: Vec<u32> = mesh
        .domain
        .nodes
        .iter()
        .filter(free)
        .take(4)
        .copied()
        .collect();
    let at = |t: f64| [0.0, 0.0, -0.3 * t as f32].repeat(4);
    let step = |t: f64| {
        let vectors = at(t);
        let contact = Contact::Sparse {
            nodes: &nodes,
            vectors: &vectors,
        };
        let mut u = vec![0.0; 3 * scene.node_count()];
        scene.step(contact, Some(&mut u)).unwrap();
        u
    };
    let (mut of_frames, mut of_last) = (0.0, 0.0);
    let mut last = Vec::new();
    for t in 1..8 {
        let now = f64::from(t);
        last = step(now);
        let own = present_contacts(&scene, 0.0, &nodes, &at(now));
        assert_eq!(bits(&own), bits(&last), "its own time");
        // Nodes are where they are asked to be, at any time.
        let half = present_contacts(&scene, 0.5 * DT, &nodes, &at(now + 0.5));
        for &node in &nodes {
            let place = half[3 * node as usize + 2];
            assert!(
                (place + 0.3 * (now as f32 + 0.5)).abs() < 1e-3,
                "{place} at {now}"
            );
        }
        if t > 3 {
            let whole = present_contacts(&scene, DT, &nodes, &at(now + 1.0));
            let next = step(now + 1.0);
            of_frames += farthest(&whole, &next);
            of_last += farthest(&last, &next);
            last = next;
            break;
        }
    }
    assert!(of_frames < 0.3 * of_last, "{of_frames} of {of_last}");
    // Let go: the tissue moves back.
    let node = nodes[0] as usize;
    let free = present_contacts(&scene, 0.03, &[], &[]);
    assert!(free[3 * node + 2] > last[3 * node + 2] + 0.05);
    let wrong = scene.present(
        Contact::Sparse {
            nodes: &[1 << 30],
            vectors: &[0.0; 3],
        },
        0.01,
        View::Region,
        &mut vec![0.0; free.len()],
    );
    assert!(matches!(wrong, Err(Error::Argument(_))));
}

#[test]
fn what_cannot_be_is_refused() {
    let model = model("tiny-corrected");
    let one = scene(&model, &corrected());
    step(&one, &pressing(&one, 1.0));
    let mut out = vec![0.0; 3 * one.node_count()];
    let tools = pressing(&one, 1.0);
    assert!(matches!(
        one.present(Contact::Tools(&tools), f64::NAN, View::Region, &mut out),
        Err(Error::NonFinite(_))
    ));
    assert!(matches!(
        one.present(Contact::Tools(&tools), -0.01, View::Region, &mut out),
        Err(Error::Argument(_))
    ));
    assert!(matches!(
        one.present(Contact::Tools(&tools), 0.01, View::Region, &mut out[3..]),
        Err(Error::Argument(_))
    ));
    let rough = Tool {
        friction: -1.0,
        ..tools[0].clone()
    };
    assert!(matches!(
        one.present(Contact::Tools(&[rough]), 0.01, View::Region, &mut out),
        Err(Error::Argument(_))
    ));
    let none = SceneOptions {
        corrections: Corrections::None,
        ..plain()
    };
    let plain_scene = scene(&model, &none);
    let refused = plain_scene.present(Contact::Tools(&tools), 0.01, View::Region, &mut out);
    assert!(matches!(refused, Err(Error::Unsupported(_))));
}
