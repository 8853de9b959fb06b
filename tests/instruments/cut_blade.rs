//! Blades that feel the tissue: energy, threshold, and the same force as in the reference solver.

use super::cut_loads::Both;
use super::cuts::{liver, options};
use super::*;
use tissue::solver::Loads as TrueLoads;
use upt::{Blade, Error, StepInput};

const ENERGY: f64 = 25.0;

/// An edge of `length` mm, `aside` mm from the site, `depth` mm in.
fn edge(scene: &Scene, length: f32, aside: f32, depth: f32) -> [[f32; 3]; 2] {
    let (at, normal) = site(scene);
    let along = normal.any_orthonormal_vector();
    let across = normal.cross(along);
    let middle = Vector::from(at) + across * aside - normal * depth;
    [-0.5, 0.5].map(|part| (middle + along * (part * length)).to_array())
}

/// A blade goes 16 mm in, 1 mm a step: what it feels in both, where the tissue goes, and the energy of what it lays open.
#[test]
fn a_blade_feels_what_it_feels_in_the_truth() {
    let mut both = Both::new();
    let (_, normal) = site(&both.scene);
    let blade = Blade {
        energy: ENERGY,
        ahead: (-normal).to_array().map(f64::from),
        ..Blade::default()
    };
    let (mut work, mut area, mut squares, mut largest) =
        ([0.0; 2], 0.0f64, Vec::new(), [0.0f32; 2]);
    let mut forces = Vec::new();
    for frame in 0..24 {
        if frame < 18 {
            let depth = frame as f32 - 2.0;
            let poses = [depth, depth + 1.0].map(|depth| edge(&both.scene, 14.0, 2.0, depth));
            let wide = |edge: [[f32; 3]; 2]| edge.map(|p| p.map(f64::from)).to_vec();
            let sweep = topology::Sweep::new(&poses.map(wide)).unwrap();
            let wanted = both.truth.cut_with(&blade, &sweep, 0).unwrap();
            let found = (both.scene)
                .cut_with(&blade, 0, 2, poses.as_flattened())
                .unwrap();
            let push = [
                -Vector::from(found.force).dot(-normal),
                Vector::from(wanted.force().map(|f| f as f32)).dot(-normal),
            ];
            (0..2).for_each(|k| work[k] += push[k]);
            (0..2).for_each(|k| largest[k] = largest[k].max(push[k]));
            area += f64::from(found.area_mm2);
            forces.push(push);
        }
        let one = both.step(StepInput::default(), &TrueLoads::default(), &[]);
        squares.push((one.square, one.farthest));
        assert!(both.scene.stats().min_det > 0.2);
    }
    println!(
        "{forces:?}\n{squares:?}\nwork {work:?} of {}, area {area}",
        ENERGY * area
    );
    // A step of 1 mm: the sum of forces is the work, and that the energy of the area.
    assert!((f64::from(work[0]) - ENERGY * area).abs() < 0.05 * ENERGY * area);
    assert!(area > 150.0, "{area}");
    // Where the edge is all in: 25 mN/mm over 14 mm.
    let steady = forces[8..18].iter().map(|push| push[0]).sum::<f32>() / 10.0;
    assert!(
        (steady / (14.0 * ENERGY as f32) - 1.0).abs() < 0.15,
        "{steady}"
    );
    assert!((work[0] / work[1] - 1.0).abs() < 0.15, "{work:?}");
    assert!((largest[0] / largest[1] - 1.0).abs() < 0.15, "{largest:?}");
    // The tissue is pushed ahead, and comes back.
    let pushed = squares[..18].iter().map(|own| own.1).fold(0.0, f32::max);
    assert!(pushed > 1.0, "{pushed}");
    let mean = squares.iter().map(|own| own.0).sum::<f64>() / squares.len() as f64;
    assert!(mean < 0.01, "{mean}");
}

/// A blade that is pressed flat, or less than its threshold, presses by its body and does not cut; pushed on, it cuts; a state with its push is saved.
#[test]
fn a_blade_presses_until_it_cuts() {
    let scene = Scene::new(liver(), &options()).unwrap();
    let (_, normal) = site(&scene);
    let poses = |depth: f32| [depth, depth + 1.0].map(|depth| edge(&scene, 10.0, 0.0, depth));
    let mut began = None;
    let mut blade = Blade {
        energy: ENERGY,
        threshold_mn: 60.0,
        ahead: (-normal).to_array().map(f64::from),
        ..Blade::default()
    };
    for at in 0..12 {
        let depth = at as f32 - 1.0;
        let tool = pressing(&scene, depth, Vector::ZERO);
        step(&scene, std::slice::from_ref(&tool));
        blade.pushed_mn = f64::from(Vector::from(readings(&scene)[0].force).dot(normal));
        let flat = Blade {
            ahead: normal.any_orthonormal_vector().to_array().map(f64::from),
            ..blade
        };
        let before = scene.save().unwrap();
        let idle = scene
            .cut_with(&flat, 0, 2, poses(depth).as_flattened())
            .unwrap();
        assert_eq!(idle, upt::Cut::default());
        assert_eq!(scene.save().unwrap(), before);
        let cut = scene
            .cut_with(&blade, 0, 2, poses(depth).as_flattened())
            .unwrap();
        assert_eq!(cut.area_mm2 > 0.0, blade.pushed_mn >= 60.0, "{blade:?}");
        if cut.area_mm2 > 0.0 {
            assert!(Vector::from(cut.force).dot(normal) > 0.0);
            began = Some(depth);
            break;
        }
        assert_eq!(scene.save().unwrap(), before);
    }
    let depth = began.unwrap();
    assert!(depth > 0.5, "{depth}");
    // The push is state.
    let saved = scene.save().unwrap();
    let wanted = step(&scene, &[]);
    assert!(largest(&wanted) > 0.0);
    scene.restore(&saved).unwrap();
    assert_eq!(scene.save().unwrap(), saved);
    assert_eq!(bits(&step(&scene, &[])), bits(&wanted));
    // It goes on without being pushed as much.
    blade.pushed_mn = 0.0;
    let on = scene.cut_with(&blade, 0, 2, poses(depth + 1.0).as_flattened());
    assert!(on.unwrap().area_mm2 > 0.0);
    for bad in [-1.0, f64::NAN] {
        let own = Blade {
            energy: bad,
            ..blade
        };
        let saved = scene.save().unwrap();
        let found = scene.cut_with(&own, 0, 2, poses(depth).as_flattened());
        assert!(matches!(
            found,
            Err(Error::Argument(_) | Error::NonFinite(_))
        ));
        assert_eq!(scene.save().unwrap(), saved);
    }
}

fn largest(u: &[f32]) -> f32 {
    u.iter().fold(0.0, |most, x| most.max(x.abs()))
}
