//! What a scene records of all that it can be given comes out to the bit in another process, also with other instructions.

use std::sync::Arc;
use std::time::Duration;

use upt::{
    Blade, Contact, Corrections, Error, GroupMotion, IndexSet, Loads, Mode, Model, ModelOptions,
    PointForce, Pressure, Progress, Scene, SceneOptions, Shape, Spring, StepInput, SupportPose,
    Tie, TieEnd, TiePoint, Tool, Vector,
};

use super::of;
use fixture::{said, shipped, with_groups};

/// The liver that ships, its held nodes in two support groups.
fn grouped() -> (tempfile::TempDir, Arc<Model>) {
    let folder = with_groups(shipped("liver-coarse"));
    let options = ModelOptions {
        portable: true,
        ..ModelOptions::default()
    };
    let model = Model::open(folder.path(), &options).unwrap();
    (folder, model)
}

/// A place of the domain, and the node there.
fn site(model: &Model) -> (u32, Vector) {
    let domain = model.indices(IndexSet::DomainNodes);
    let node = domain[domain.len() / 2];
    let at = 3 * node as usize;
    (node, Vector::from_slice(&model.positions()[at..at + 3]))
}

fn tool(shape: &Shape, at: Vector) -> Tool {
    Tool::new(shape, at.to_array(), [0.0, 0.0, 0.0, 1.0]).unwrap()
}

/// A closed surface, and a hull of the same points: an octahedron.
fn octahedra(radius: f32) -> [Shape; 2] {
    let points: Vec<[f32; 3]> = [Vector::X, Vector::Y, Vector::Z]
        .into_iter()
        .flat_map(|axis| [axis * radius, -axis * radius])
        .map(|point| point.to_array())
        .collect();
    let faces = [
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    let hull = Shape::Hull {
        points: points.clone(),
        margin: 0.5,
    };
    let mesh = Shape::Mesh {
        points,
        faces: faces.to_vec(),
        margin: 0.5,
    };
    [hull, mesh]
}

/// Tools of all kinds that press and hold, beside ties, and all loads.
fn driven(scene: &Scene) {
    let (node, at) = site(scene.model());
    let positions = scene.model().positions();
    let own = |node: u32| TiePoint {
        nodes: [node; 3],
        weights: [1.0, 0.0, 0.0],
    };
    let domain = scene.model().indices(IndexSet::DomainNodes);
    let far = *domain.first().unwrap();
    let ends = [
        TieEnd::World(at + Vector::Z * 15.0),
        TieEnd::Support(at - Vector::Z * 12.0),
        TieEnd::Tool {
            tool: 0,
            place: Vector::Y,
        },
        TieEnd::Tissue(own(far)),
    ];
    let ties = ends.map(|end| Tie {
        point: own(node),
        end,
        spring: Spring {
            stiffness: 20.0,
            slack_mm: 1.0,
            damping: 0.01,
            pushes: false,
        },
        break_mn: 1e4,
    });
    let forces: Vec<f32> = (0..positions.len())
        .map(|at| if at % 97 == 0 { 0.3 } else { 0.0 })
        .collect();
    let shapes = [
        Shape::Sphere { radius: 5.0 },
        Shape::Capsule {
            half_length: 6.0,
            radius: 2.5,
        },
        Shape::Box {
            half_extents: [4.0, 3.0, 2.0],
        },
        Shape::Spatula {
            half_extents: [5.0, 3.0, 1.5],
            radius: 1.0,
        },
    ];
    let [hull, mesh] = octahedra(6.0);
    let bodies: Vec<Tool> = [&hull, &mesh].iter().map(|shape| tool(shape, at)).collect();
    for t in 0..4 {
        let down = Vector::Z * (6.0 - t as f32);
        let mut tools: Vec<Tool> = (shapes.iter().map(|shape| tool(shape, at)))
            .chain(bodies.clone())
            .collect();
        for (place, tool) in tools.iter_mut().enumerate() {
            tool.friction = 0.1 * place as f32;
            let aside = Vector::new(9.0 * (place % 3) as f32, 9.0 * (place / 3) as f32, 0.0);
            let turn = 0.1 * t as f32;
            let length = (1.0 + turn * turn).sqrt();
            let turned = [turn / length, 0.0, 0.0, 1.0 / length];
            let moved = Tool::of_body(tool.body.clone(), (at + down + aside).to_array(), turned);
            tool.pose = moved.unwrap().pose;
        }
        if t > 1 {
            tools[0].mode = Mode::Grasp;
            tools[0].tear_off_mn = 5e3;
        }
        let pressures = [
            Pressure {
                nodes: &[],
                pascal: 20.0,
            },
            Pressure {
                nodes: domain,
                pascal: -10.0,
            },
        ];
        let loads = Loads {
            gravity: [0.1, 0.0, -0.6],
            gravity_at_rest: [0.0, 0.0, -0.2],
            forces: Some(&forces),
            point_forces: &[PointForce {
                nodes: [domain[0], domain[1], domain[2], domain[3]],
                weights: [0.25; 4],
                force: [0.0, 0.0, 0.5 * t as f32],
            }],
            pressures: &pressures,
            support: Some(SupportPose {
                position: [0.2 * t as f32, 0.0, 0.0],
                rotation: [0.0, 0.0, 0.0, 1.0],
            }),
            ties: &ties,
            supports: &[],
        };
        let input = StepInput {
            loads,
            time_s: 0.05 * f64::from(t),
            ..StepInput::from(Contact::Tools(&tools))
        };
        match t {
            3 => {
                scene.submit(input).unwrap();
                assert_eq!(scene.wait(Duration::from_secs(60)).unwrap(), Progress::Done);
            }
            _ => scene.step(input, None).unwrap(),
        }
    }
}

/// Support groups, prescribed nodes and fields, and a step that is refused.
fn prescribed(scene: &Scene) {
    let (node, _) = site(scene.model());
    let own = scene.model().supports().nth(1).unwrap().1.len();
    let given = vec![0.1; 3 * own];
    let pose = Some(SupportPose {
        position: [0.0, 0.0, 0.3],
        rotation: [0.0, 0.0, 0.0, 1.0],
    });
    for motion in [
        GroupMotion {
            group: 0,
            pose,
            ..GroupMotion::default()
        },
        GroupMotion {
            group: 1,
            let_go: true,
            ..GroupMotion::default()
        },
        GroupMotion {
            group: 1,
            displacements: Some(&given),
            ..GroupMotion::default()
        },
    ] {
        let loads = Loads {
            supports: &[motion],
            ..Loads::default()
        };
        scene
            .step(
                StepInput {
                    loads,
                    ..StepInput::default()
                },
                None,
            )
            .unwrap();
    }
    let nodes = [node];
    let pushed = Contact::Sparse {
        nodes: &nodes,
        vectors: &[0.0, 0.0, -0.5],
    };
    scene.step(pushed, None).unwrap();
    let mut dense = vec![0.0; scene.model().positions().len()];
    dense[3 * node as usize + 2] = -0.75;
    scene.step(Contact::Dense(&dense), None).unwrap();
    let mut field = vec![0.0; dense.len()];
    scene.read(&mut field).unwrap();
    field.iter_mut().for_each(|u| *u *= 0.5);
    let from = StepInput {
        displacement: Some(&field),
        ..StepInput::from(Contact::Dense(&dense))
    };
    scene.step(from, None).unwrap();
    let wrong = Contact::Sparse {
        nodes: &nodes,
        vectors: &[f32::NAN, 0.0, 0.0],
    };
    assert!(matches!(scene.step(wrong, None), Err(Error::NonFinite(_))));
}

/// Operations on the body, a region, and the ways back.
fn operated(scene: &Scene) {
    let (node, at) = site(scene.model());
    let saved = scene.save().unwrap();
    let edge = |x: f32, z: f32| (at + Vector::new(x, 8.0, z)).to_array();
    let poses = [
        edge(-25.0, 12.0),
        edge(25.0, 12.0),
        edge(-25.0, -8.0),
        edge(25.0, -8.0),
    ];
    let blade = Blade {
        energy: 5.0,
        threshold_mn: 1.0,
        pushed_mn: 1.0 / 3.0,
        ahead: [0.0; 3],
    };
    // It is not pushed enough: nothing is cut, and the replay must say so too.
    assert_eq!(scene.cut_with(&blade, 0, 2, &poses).unwrap().area_mm2, 0.0);
    assert!(scene.cut(0, 2, &poses).unwrap().area_mm2 > 100.0);
    scene.step(Contact::None, None).unwrap();
    let [hull, _] = octahedra(5.0);
    assert!(scene.remove(&tool(&hull, at), 60.0).unwrap().removed_mm3 > 1.0);
    assert!(scene.tear(2, 1.001, 1).unwrap().is_changed);
    scene.scale_stiffness(&[0, 1, 2], 2.5).unwrap();
    scene.drop_fragments().unwrap();
    scene.step(Contact::Tools(&[]), None).unwrap();
    scene.set_region(Some(&[node, 3])).unwrap();
    let loads = Loads {
        gravity: [0.0, -0.3, -0.3],
        ..Loads::default()
    };
    scene
        .step(
            StepInput {
                loads,
                ..StepInput::default()
            },
            None,
        )
        .unwrap();
    scene.set_region(None).unwrap();
    scene.restore(&saved).unwrap();
    scene.step(Contact::None, None).unwrap();
    scene.scale_stiffness(&[5], 0.5).unwrap();
    scene.reset().unwrap();
    scene
        .step(
            Contact::Sparse {
                nodes: &[node],
                vectors: &[0.0, 0.0, -0.4],
            },
            None,
        )
        .unwrap();
}

/// Verifies REQ-095, REQ-097.
#[test]
fn all_that_a_scene_is_given_is_replayed_to_the_bit() {
    let (folder, model) = grouped();
    let options = SceneOptions {
        corrections: Corrections::Fixed(3),
        step_s: 1.0 / 30.0,
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(&model), &options).unwrap();
    assert!(matches!(scene.record(0), Err(Error::State(_))));
    scene.record(1).unwrap();
    assert!(matches!(scene.record(1), Err(Error::State(_))));
    driven(&scene);
    let mut first = scene.take_record().unwrap();
    prescribed(&scene);
    operated(&scene);
    scene.record(0).unwrap();
    assert!(matches!(scene.record(2), Err(Error::State(_))));
    first.extend(scene.take_record().unwrap());
    assert!(scene.take_record().unwrap().is_empty());
    let text = String::from_utf8(first.clone()).unwrap();
    for line in [
        "step",
        "hull",
        "cut",
        "remove",
        "tear",
        "scale_stiffness",
        "drop_fragments",
        "reset",
        "restore",
        "region",
        "end",
    ] {
        assert!(
            text.contains(&format!("\n{{\"{line}\":")),
            "{line} is not there: {text:.300}"
        );
    }
    assert_eq!(text.matches("\n{\"hull\":").count(), 3, "each once");
    // A recording that begins with a body that has been cut, in the middle of a motion.
    scene
        .cut(
            0,
            2,
            &[
                [-80.0, 60.0, 20.0],
                [80.0, 60.0, 20.0],
                [-80.0, 60.0, -80.0],
                [80.0, 60.0, -80.0],
            ],
        )
        .unwrap();
    scene.step(Contact::None, None).unwrap();
    scene.record(2).unwrap();
    driven(&scene);
    scene.record(0).unwrap();
    let second = scene.take_record().unwrap();
    assert!(second.windows(13).any(|text| text == b"\n{\"restore\":\""));
    for (name, text, told) in [
        ("first", first, "15 steps, 15 hashes"),
        ("second", second, "4 steps, 2 hashes"),
    ] {
        let file = folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        for isa in [None, Some("scalar")] {
            let same = of(folder.path(), &file, &["--verify", "--threads", "2"], isa);
            assert!(
                same.status.success() && said(&same).contains(told),
                "{name} {isa:?}: {}",
                said(&same)
            );
        }
    }
    let budget = Corrections::RecommendedWithin { budget_us: 500 };
    let clocked = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    let clocked = Scene::new(
        clocked,
        &SceneOptions {
            corrections: budget,
            ..options
        },
    )
    .unwrap();
    let told = clocked.record(1).unwrap_err().to_string();
    assert!(told.contains("corrections.budget_us"), "{told}");
}
