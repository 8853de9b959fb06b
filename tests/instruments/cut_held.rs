//! What holds a cut body: a support that moves, support groups that are led, let go and held again, ties.

use super::cuts::{options, slit};
use super::*;
use upt::{
    Error, GroupMotion, Loads, Model, ModelOptions, Spring, StepInput, SupportPose, Tie, TieEnd,
    TiePoint,
};

/// A liver whose held nodes are two groups, with the folder that it reads on from.
fn open() -> (tempfile::TempDir, Scene) {
    let folder = fixture::with_groups(fixture::shipped("liver-coarse"));
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    (folder, Scene::new(model, &options()).unwrap())
}

fn with(loads: Loads<'_>) -> StepInput<'_> {
    StepInput {
        loads,
        ..StepInput::default()
    }
}

fn go(scene: &Scene, loads: Loads<'_>) -> Vec<f32> {
    let mut u = vec![0.0; 3 * scene.node_count()];
    scene.step(with(loads), Some(&mut u)).unwrap();
    u
}

fn up(height: f32) -> Option<SupportPose> {
    Some(SupportPose {
        position: [0.0, 0.0, height],
        rotation: [0.0, 0.0, 0.0, 1.0],
    })
}

fn led(group: u32, height: f32) -> GroupMotion<'static> {
    GroupMotion {
        group,
        pose: up(height),
        ..GroupMotion::default()
    }
}

fn at(u: &[f32], nodes: &[u32]) -> Vec<f32> {
    let rows = nodes.iter().map(|node| &u[3 * *node as usize..][..3]);
    rows.flatten().copied().collect()
}

fn apart(a: &[f32], b: &[f32]) -> f32 {
    let pairs = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    pairs.fold(0.0, f32::max)
}

/// A blade through what holds the middle of a group, 16 mm wide.
fn through(scene: &Scene, nodes: &[u32]) -> [[f32; 3]; 4] {
    let positions = scene.model().positions();
    let place = |node: &u32| Vector::from_slice(&positions[3 * *node as usize..][..3]);
    let mean = nodes.iter().map(place).sum::<Vector>() / nodes.len() as f32;
    let near = |a: &&u32, b: &&u32| {
        let far = |node: &u32| (place(node) - mean).length();
        far(a).total_cmp(&far(b))
    };
    let middle = place(nodes.iter().min_by(near).unwrap());
    let point = |y: f32, z: f32| (middle + Vector::from([0.4, y, z])).to_array();
    [
        point(-8.0, -8.0),
        point(8.0, -8.0),
        point(-8.0, 8.0),
        point(8.0, 8.0),
    ]
}

/// Both groups together carry a cut body, copies of what they hold among it, and so does the support as a whole; and it goes home.
#[test]
fn a_cut_body_is_carried_without_strain() {
    let (_folder, scene) = open();
    let own = scene.model().supports().nth(1).unwrap().1.to_vec();
    scene.cut(0, 2, &slit(&scene, 3.0, 18.0)).unwrap();
    let slits = scene.node_count();
    scene.cut(1, 2, &through(&scene, &own)).unwrap();
    assert!(scene.node_count() > slits, "the blade has met nothing held");
    let mut u = Vec::new();
    for t in 0..100 {
        let height = 0.25 * t.min(20) as f32;
        let supports = [led(0, height), led(1, height)];
        u = go(
            &scene,
            Loads {
                supports: &supports,
                ..Loads::default()
            },
        );
    }
    let wanted = [0.0, 0.0, 5.0].repeat(scene.node_count());
    println!("{} mm from a rigid motion", apart(&u, &wanted));
    assert!(apart(&u, &wanted) < 0.02, "{} mm", apart(&u, &wanted));
    let mut most = 0.0f32;
    for t in 0..160 {
        let supports = [led(0, 5.0), led(1, 5.0)];
        u = go(
            &scene,
            Loads {
                support: up(0.2 * t.min(20) as f32),
                supports: &supports,
                ..Loads::default()
            },
        );
        most = most.max(apart(&u, &wanted));
    }
    // On the way it lags, and in the support's frame it comes to rest where it was.
    assert!(most > 1e-3 && apart(&u, &wanted) < 0.02, "{most} mm");
    for _ in 0..20 {
        let supports = [led(0, 0.0), led(1, 0.0)];
        u = go(
            &scene,
            Loads {
                supports: &supports,
                ..Loads::default()
            },
        );
    }
    assert!(at(&u, &own).iter().all(|u| *u == 0.0));
}

/// A group is let go under gravity, what it held is cut meanwhile, and it is held again where it is; to the bit from a snapshot.
#[test]
fn what_is_let_go_is_cut_and_held_again() {
    let (_folder, scene) = open();
    let own = scene.model().supports().nth(1).unwrap().1.to_vec();
    let gravity = [0.0, -0.5, -0.2];
    let free = [GroupMotion {
        group: 1,
        let_go: true,
        ..GroupMotion::default()
    }];
    let under = |supports| Loads {
        gravity,
        supports,
        ..Loads::default()
    };
    let mut u = Vec::new();
    for _ in 0..8 {
        u = go(&scene, under(&free));
    }
    let far = apart(&at(&u, &own), &vec![0.0; 3 * own.len()]);
    assert!(far > 0.1, "{far} mm");
    scene.cut(0, 2, &through(&scene, &own)).unwrap();
    let mut now = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut now).unwrap();
    assert_eq!(bits(&now[..u.len()]), bits(&u));
    for _ in 0..12 {
        u = go(&scene, under(&free));
        assert!(scene.stats().min_det > 0.1, "{:?}", scene.stats());
    }
    let sunk = at(&u, &own);
    let saved = scene.save().unwrap();
    let next = go(&scene, under(&[]));
    assert!(apart(&at(&next, &own), &sunk) < 1e-5);
    scene.restore(&saved).unwrap();
    assert_eq!(scene.save().unwrap(), saved);
    assert_eq!(bits(&go(&scene, under(&[]))), bits(&next));
    // Cut once more while it is held there; the displacements that lead it are those of the intact group's nodes.
    scene.cut(1, 2, &slit(&scene, 3.0, 18.0)).unwrap();
    u = go(&scene, under(&[]));
    assert!(apart(&at(&u, &own), &sunk) < 1e-5);
    let given: Vec<f32> = sunk.iter().map(|u| 0.9 * u).collect();
    let to = [GroupMotion {
        group: 1,
        displacements: Some(&given),
        ..GroupMotion::default()
    }];
    u = go(&scene, under(&to));
    assert!(apart(&at(&u, &own), &given) < 1e-5);
    scene.reset().unwrap();
    assert!(go(&scene, Loads::default()).iter().all(|u| *u == 0.0));
}

/// A tie holds on across a cut; one whose tissue is taken away is told, and changes nothing.
#[test]
fn ties_hold_what_is_left() {
    let (_folder, scene) = open();
    let (place, normal) = site(&scene);
    let near = |a: &&u32, b: &&u32| {
        let positions = scene.model().positions();
        let far = |node: u32| {
            (Vector::from_slice(&positions[3 * node as usize..][..3]) - Vector::from(place))
                .length()
        };
        far(**a).total_cmp(&far(**b))
    };
    let domain = scene.model().indices(upt::IndexSet::DomainNodes);
    let node = *domain.iter().min_by(near).unwrap();
    let thread = |stiffness: f32| {
        [Tie {
            point: TiePoint {
                nodes: [node; 3],
                weights: [1.0, 0.0, 0.0],
            },
            end: TieEnd::World(Vector::from(place) + normal * 20.0),
            spring: Spring {
                stiffness,
                slack_mm: 16.0,
                ..Spring::default()
            },
            break_mn: 0.0,
        }]
    };
    let ties = thread(60.0);
    let pulled = |ties| Loads {
        ties,
        ..Loads::default()
    };
    for _ in 0..20 {
        go(&scene, pulled(&ties));
    }
    let reading = |scene: &Scene| size(scene.tie_readings().unwrap()[0].force);
    let whole = reading(&scene);
    assert!(whole > 20.0, "{whole} mN");
    scene.cut(0, 2, &slit(&scene, 5.0, 18.0)).unwrap();
    go(&scene, pulled(&ties));
    let first = reading(&scene);
    for _ in 0..20 {
        go(&scene, pulled(&ties));
    }
    // Softer tissue yields.
    let parted = reading(&scene);
    println!("{whole} mN, {first} after the cut, {parted} at rest");
    assert!((first / whole - 1.0).abs() < 0.2 && parted < 0.99 * whole && parted > 0.3 * whole);
    let saved = scene.save().unwrap();
    let next = go(&scene, pulled(&ties));
    scene.restore(&saved).unwrap();
    assert_eq!(bits(&go(&scene, pulled(&ties))), bits(&next));
    let mut u = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut u).unwrap();
    let there = Vector::from(place) + Vector::from_slice(&u[3 * node as usize..][..3]);
    scene.remove(&ball(18.0, there.to_array()), 1e6).unwrap();
    let saved = scene.save().unwrap();
    match scene.step(with(pulled(&ties)), None) {
        Err(Error::Argument(text)) => assert!(
            text.contains("ties[0]") && text.contains("nothing left"),
            "{text}"
        ),
        other => panic!("{other:?}"),
    }
    assert_eq!(scene.save().unwrap(), saved);
    go(&scene, pulled(&thread(0.0)));
    assert_eq!(reading(&scene), 0.0);
    for _ in 0..10 {
        go(&scene, Loads::default());
    }
    assert!(scene.stats().min_det > 0.2, "{:?}", scene.stats());
}
