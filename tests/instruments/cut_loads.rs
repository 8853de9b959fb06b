//! Loads and prescribed nodes on cut bodies, against the reference solver with the same cuts.
//!
//! A force at a point of an element that a blade has parted is borne by the lip on which the point lies, and by none where that has been removed.

use super::cuts::{liver, options, slit};
use super::*;
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{ContactNode, Loads as TrueLoads, Solver, SolverOptions, SurfacePressure};
use topology::Push;
use upt::{Error, Loads, PointForce, Pressure, StepInput};

/// A scene of the liver and the reference solver of the same body.
pub(super) struct Both {
    pub scene: Scene,
    pub truth: Solver,
    pub mesh: Mesh,
}

impl Both {
    pub fn new() -> Both {
        let model = liver();
        let path = std::path::Path::new("onnx/liver-coarse/mesh.safetensors");
        let mesh = Mesh::read(path).unwrap();
        let material = SolverOptions {
            material: model.manifest.material,
            ..SolverOptions::default()
        };
        Both {
            truth: Solver::new(&mesh, Boundary::Fixed, material).unwrap(),
            scene: Scene::new(model, &options()).unwrap(),
            mesh,
        }
    }

    fn cut(&mut self, stroke: u32, poses: &[[f32; 3]; 4]) {
        let wide = |edge: &[[f32; 3]]| edge.iter().map(|p| p.map(f64::from)).collect();
        let edges: Vec<_> = poses.chunks(2).map(wide).collect();
        let sweep = topology::Sweep::new(&edges).unwrap();
        self.truth.cut(&sweep, stroke).unwrap();
        self.scene.cut(stroke, 2, poses).unwrap();
    }

    /// A step of both; mean squared distance of the mesh's nodes, mm², the farthest displacement of the truth, mm, and its reaction.
    pub fn step(
        &mut self,
        input: StepInput<'_>,
        loads: &TrueLoads,
        contact: &[ContactNode],
    ) -> Found {
        self.truth.set_loads(loads).unwrap();
        let report = self.truth.step_frame(contact, 0.05).unwrap();
        let mut wanted = vec![[0.0; 3]; self.truth.node_count()];
        self.truth.displacement(&mut wanted);
        let mut u = vec![0.0; 3 * self.scene.node_count()];
        self.scene.step(input, Some(&mut u)).unwrap();
        // Where a corner lies at the edge of what is snapped, one of them may have a node more.
        assert!(self.scene.node_count().abs_diff(wanted.len()) <= 2);
        let squares = u.iter().zip(wanted.as_flattened());
        let squares = squares.map(|(a, b)| f64::from((a - b).powi(2)));
        let count = self.mesh.node_count();
        Found {
            square: squares.take(3 * count).sum::<f64>() / count as f64,
            farthest: wanted.iter().map(|u| size(*u)).fold(0.0, f32::max),
            pull: report.reaction.iter().map(|f| Vector::from(*f)).sum(),
            u,
        }
    }
}

pub(super) struct Found {
    pub square: f64,
    pub farthest: f32,
    pub pull: Vector,
    pub u: Vec<f32>,
}

/// Gravity that turns, a force on each of some nodes and pressure on the surface and in the slit, while the blade comes.
#[test]
fn a_cut_body_sags_as_the_truth_does() {
    let mut both = Both::new();
    let count = both.mesh.node_count();
    let (at, normal) = site(&both.scene);
    let near = |p: &[f32; 3]| (Vector::from(*p) - Vector::from(at)).length() < 18.0;
    let push = (normal * 6.0).to_array();
    let forces: Vec<[f32; 3]> = (both.mesh.positions.iter())
        .map(|p| if near(p) { push } else { [0.0; 3] })
        .collect();
    assert!(forces.iter().filter(|f| **f != [0.0; 3]).count() > 5);
    let mut found = Vec::new();
    for frame in 0..40 {
        if frame == 10 {
            both.cut(0, &slit(&both.scene, 3.0, 18.0));
        }
        if frame == 18 {
            both.cut(1, &slit(&both.scene, -4.0, 25.0));
        }
        let part = (frame as f32 / 8.0).min(1.0);
        let gravity = [-1.5 * part, -0.5 * part, 0.0];
        let pascal = if frame > 24 { 60.0 } else { 0.0 };
        let pressures = [Pressure { nodes: &[], pascal }];
        let input = StepInput {
            loads: Loads {
                gravity,
                forces: Some(forces.as_flattened()),
                pressures: &pressures,
                ..Loads::default()
            },
            ..StepInput::default()
        };
        let loads = TrueLoads {
            gravity: gravity.map(|g| 1e3 * f64::from(g)),
            forces: forces.clone(),
            pressures: vec![SurfacePressure {
                faces: both.mesh.domain.clone(),
                pascal: f64::from(pascal),
                walls: true,
            }],
            ..TrueLoads::default()
        };
        found.push(both.step(input, &loads, &[]));
        assert!(both.scene.stats().min_det > 0.3, "{frame}");
    }
    assert!(both.scene.node_count() > count);
    let mean = |range: std::ops::Range<usize>| {
        let len = range.len() as f64;
        found[range].iter().map(|one| one.square).sum::<f64>() / len
    };
    let parts = [mean(0..10), mean(10..18), mean(18..25), mean(25..40)];
    println!("{parts:?} mm², farthest {}", found[39].farthest);
    assert!(found[39].farthest > 3.0);
    // Before the blade, and after it.
    assert!(parts.iter().all(|mean| *mean < 0.005), "{parts:?}");
    assert!(found[39].square < 0.002, "{}", found[39].square);
}

/// A region's pressure stays on what is left of it, a load goes on across a cut and an undo to the bit, and bad loads change nothing.
#[test]
fn loads_go_on_across_cuts_and_undo() {
    let model = liver();
    let scene = Scene::new(std::sync::Arc::clone(&model), &options()).unwrap();
    let nodes = scene.mesh().domain.nodes.clone();
    let pressures = [Pressure {
        nodes: &nodes,
        pascal: 80.0,
    }];
    let input = StepInput {
        loads: Loads {
            gravity: [0.0, 0.0, -2.0],
            pressures: &pressures,
            ..Loads::default()
        },
        ..StepInput::default()
    };
    let step = |scene: &Scene| {
        let mut u = vec![0.0; 3 * scene.node_count()];
        scene.step(input, Some(&mut u)).unwrap();
        u
    };
    for _ in 0..6 {
        step(&scene);
    }
    let mut before = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut before).unwrap();
    scene.cut(0, 2, &slit(&scene, 3.0, 18.0)).unwrap();
    let mut now = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut now).unwrap();
    assert_eq!(bits(&now[..before.len()]), bits(&before));
    let first = step(&scene);
    // Nothing leaps: the load at the moment of the cut is that of before.
    let leap = first.iter().zip(&now).map(|(a, b)| (a - b).abs());
    assert!(leap.fold(0.0, f32::max) < 3.0);
    let parted = scene.save().unwrap();
    let wanted = step(&scene);
    scene.restore(&parted).unwrap();
    assert_eq!(scene.save().unwrap(), parted);
    assert_eq!(bits(&step(&scene)), bits(&wanted));
    let threads = SceneOptions {
        threads: 2,
        ..options()
    };
    let other = Scene::new(model, &threads).unwrap();
    other.restore(&parted).unwrap();
    assert_eq!(bits(&step(&other)), bits(&wanted));
    // Forces are on the nodes of the intact mesh.
    let saved = scene.save().unwrap();
    let forces = vec![0.0; 3 * scene.node_count()];
    let bad = StepInput {
        loads: Loads {
            forces: Some(&forces),
            ..Loads::default()
        },
        ..StepInput::default()
    };
    assert!(matches!(scene.step(bad, None), Err(Error::Argument(_))));
    assert_eq!(scene.save().unwrap(), saved);
}

/// Forces at points of one lip of a slit, on the surface and inside, a millimetre from the blade: it opens, as the truth's does, and where the tissue is gone they are refused.
#[test]
fn forces_at_points_of_a_lip_open_the_slit() {
    let mut both = Both::new();
    both.cut(0, &slit(&both.scene, 3.0, 18.0));
    let (at, normal) = site(&both.scene);
    let across = normal.cross(normal.any_orthonormal_vector());
    let place = |aside: f32, depth: f32| Vector::from(at) + across * (3.0 + aside) - normal * depth;
    let places = [1.0, -1.0].map(|side| [0.5, 8.0].map(|depth| place(side, depth).to_array()));
    both.scene
        .attach_points(Some(places.as_flattened().as_flattened()))
        .unwrap();
    let model = std::sync::Arc::clone(both.scene.model());
    let lips = places.map(|places| PointForce::at(&model, &places).unwrap());
    let acting = |lip: usize, part: f32| {
        let mut points = lips[lip].clone();
        let way = across * [1.0, -1.0][lip];
        (points.iter_mut()).for_each(|point| point.force = (way * 40.0 * part).to_array());
        points
    };
    for lip in [0, 1] {
        let mut squares = Vec::new();
        for frame in 0..24 {
            let points = acting(lip, (frame as f32 / 8.0).min(1.0));
            let body = both.truth.body().unwrap();
            let push = |point: &PointForce| {
                let (weights, tets) = (point.weights.map(f64::from), &both.mesh.tets);
                let element = tets.iter().position(|tet| *tet == point.nodes).unwrap();
                Push {
                    nodes: body.nodes_at(element as u32, &weights),
                    weights,
                    force: point.force.map(f64::from),
                }
            };
            let loads = TrueLoads {
                points: points.iter().map(push).collect(),
                ..TrueLoads::default()
            };
            let input = with_points(&points);
            squares.push(both.step(input, &loads, &[]).square);
            assert!(both.scene.stats().min_det > 0.2, "{:?}", both.scene.stats());
        }
        let mut u = [0.0; 12];
        both.scene.read_view(upt::View::Points, &mut u).unwrap();
        // How far each point has gone the way that its lip goes when the slit opens.
        let gone = [0, 1, 2, 3].map(|point: usize| {
            let way = across * [1.0, -1.0][point / 2];
            Vector::from_slice(&u[3 * point..][..3]).dot(way)
        });
        let (own, other) = (&gone[2 * lip..][..2], &gone[2 - 2 * lip..][..2]);
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        println!("{own:?} mm, the other lip {other:?}, {mean} mm², {squares:?}");
        for (own, other) in own.iter().zip(other) {
            assert!(*own > 0.5 && own + other > 0.25 * own, "{gone:?}");
        }
        assert!(mean < 0.005 && squares[23] < 0.002, "{squares:?}");
    }
    let mut u = [0.0; 12];
    both.scene.read_view(upt::View::Points, &mut u).unwrap();
    let there = Vector::from(places[1][0]) + Vector::from_slice(&u[6..9]);
    let scene = &both.scene;
    scene.remove(&ball(9.0, there.to_array()), 1e6).unwrap();
    let saved = scene.save().unwrap();
    let mut points = [acting(0, 0.0)[0], acting(1, 0.1)[0]];
    match scene.step(with_points(&points), None) {
        Err(Error::Argument(text)) => assert!(
            text.contains("point_forces[1]") && text.contains("nothing left"),
            "{text}"
        ),
        other => panic!("{other:?}"),
    }
    assert_eq!(scene.save().unwrap(), saved);
    points[1].force = [0.0; 3];
    scene.step(with_points(&points), None).unwrap();
}

fn with_points(point_forces: &[PointForce]) -> StepInput<'_> {
    StepInput {
        loads: Loads {
            point_forces,
            ..Loads::default()
        },
        ..StepInput::default()
    }
}

/// One lip is led aside by its nodes, copies among them, as the truth's is.
#[test]
fn nodes_of_a_lip_are_led_and_let_go() {
    let mut both = Both::new();
    both.cut(0, &slit(&both.scene, 3.0, 18.0));
    let (at, normal) = site(&both.scene);
    let along = normal.any_orthonormal_vector();
    let across = normal.cross(along);
    let rest = |node: u32| -> Vector {
        let body = both.truth.body().unwrap();
        Vector::from(both.mesh.positions[body.parent(node) as usize])
    };
    // Real nodes of the one lip near the surface.
    let is_led = |node: &u32| {
        let off = rest(*node) - Vector::from(at);
        let aside = off.dot(across) - 3.0;
        (-14.0..0.0).contains(&aside) && off.dot(along).abs() < 12.0 && off.dot(normal) > -8.0
    };
    let led: Vec<u32> = (0..both.mesh.node_count() as u32).filter(is_led).collect();
    assert!(led.len() > 2, "{led:?}");
    let (mut found, mut forces) = (Vec::new(), Vec::new());
    for frame in 0..30 {
        let way = across * (-6.0 * (frame as f32 / 10.0).min(1.0));
        let held = (1..20).contains(&frame);
        let contact: Vec<ContactNode> = (led.iter().filter(|_| held))
            .map(|node| ContactNode {
                node: *node,
                displacement: way.to_array(),
            })
            .collect();
        let vectors: Vec<f32> = contact.iter().flat_map(|one| one.displacement).collect();
        let input = StepInput::from(match held {
            true => Contact::Sparse {
                nodes: &led,
                vectors: &vectors,
            },
            false => Contact::None,
        });
        let one = both.step(input, &TrueLoads::default(), &contact);
        if held {
            for (node, wanted) in led.iter().zip(vectors.chunks(3)) {
                assert_eq!(&one.u[3 * *node as usize..][..3], wanted);
            }
            let mut out = vec![0.0; 3 * led.len()];
            both.scene.contact_force(&mut out).unwrap();
            let sum: Vector = out.chunks(3).map(Vector::from_slice).sum();
            let off = (sum + one.pull).length().min((sum - one.pull).length());
            forces.push([off, one.pull.length()]);
        }
        found.push(one);
    }
    let mean = |range: std::ops::Range<usize>| {
        let len = range.len() as f64;
        found[range].iter().map(|one| one.square).sum::<f64>() / len
    };
    let parts = [mean(1..12), mean(12..20), mean(20..30)];
    println!("{parts:?} mm², {forces:?}");
    assert!(parts[0] < 0.005 && parts[1] < 0.001, "{parts:?}");
    // Let go at once it swings, which a step of 50 ms sees late, and comes to rest.
    assert!(parts[2] < 0.5 && found[29].square < 0.01, "{parts:?}");
    let [off, pull] = forces[18];
    assert!(pull > 200.0 && off < 0.02 * pull, "{forces:?}");
}
