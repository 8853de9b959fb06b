//! A grasp across cuts, against the reference solver with the same grasper and blades.

use super::cuts::{liver, options, slit};
use super::*;
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{Solver, SolverOptions, Tool as Rigid, ToolPose};

/// A ball takes hold and lifts; a blade comes beside what it holds, and one through it; it goes on pulling, aside.
#[test]
fn a_grasp_holds_on_across_cuts_as_in_the_truth() {
    let model = liver();
    let scene = Scene::new(std::sync::Arc::clone(&model), &options()).unwrap();
    let path = std::path::Path::new("onnx/liver-coarse/mesh.safetensors");
    let mesh = Mesh::read(path).unwrap();
    let settings = SolverOptions {
        material: model.manifest.material,
        ..SolverOptions::default()
    };
    let mut truth = Solver::new(&mesh, Boundary::Fixed, settings).unwrap();
    let (_, normal) = site(&scene);
    let across = normal.cross(normal.any_orthonormal_vector());
    let at = |frame: i32| {
        let depth = (frame as f32 - 1.0).min(2.0) - 0.5 * (frame as f32 - 4.0).clamp(0.0, 10.0);
        let aside = 0.4 * (frame as f32 - 18.0).clamp(0.0, 10.0);
        let mut tool = pressing(&scene, depth, across * -aside);
        if frame >= 3 {
            tool.mode = Mode::Grasp;
        }
        tool
    };
    let rigid = Rigid {
        shape: Shape::Sphere { radius: 3.0 },
        friction: 0.0,
        tear_off_mn: 0.0,
    };
    let samples = mesh.samples(Boundary::Fixed);
    truth.set_tools(samples, &[rigid], &[at(0).pose]).unwrap();
    let mut found = Vec::new();
    for frame in 0..34 {
        if let Some(aside) = [(10, 5.0), (14, -0.5)].iter().find(|cut| cut.0 == frame) {
            let poses = slit(&scene, aside.1, 15.0);
            let wide = |edge: &[[f32; 3]]| edge.iter().map(|p| p.map(f64::from)).collect();
            let edges: Vec<_> = poses.chunks(2).map(wide).collect();
            let sweep = topology::Sweep::new(&edges).unwrap();
            let before = readings(&scene)[0];
            assert!(before.contacts > 2 && !before.torn);
            truth.cut(&sweep, frame as u32).unwrap();
            scene.cut(frame as u32, 2, &poses).unwrap();
        }
        let tool = at(frame);
        let pose = ToolPose {
            pose: tool.pose,
            grasp: tool.mode == Mode::Grasp,
        };
        let report = truth.step_tools(&[], &[pose], 0.05).unwrap();
        let mut wanted = vec![[0.0; 3]; truth.node_count()];
        truth.displacement(&mut wanted);
        let u = step(&scene, std::slice::from_ref(&tool));
        let count = mesh.node_count();
        let squares = u.iter().zip(wanted.as_flattened());
        let squares = squares.map(|(a, b)| f64::from((a - b).powi(2)));
        let square = squares.take(3 * count).sum::<f64>() / count as f64;
        let own = readings(&scene)[0];
        assert!(
            frame < 4 || (own.contacts > 2 && !own.torn),
            "{frame}: {own:?}"
        );
        let forces = [size(own.force), size(report.tools[0].force)];
        found.push((square, forces));
    }
    let mean = |range: std::ops::Range<usize>| {
        let len = range.len() as f64;
        found[range].iter().map(|one| one.0).sum::<f64>() / len
    };
    let parts = [mean(0..10), mean(10..14), mean(14..34)];
    println!("{parts:?} mm², {:?}", found[33].1);
    assert!(parts.iter().all(|mean| *mean < 0.005), "{parts:?}");
    // It pulls on, less than before, and as hard as in the truth.
    for at in [13, 17, 33] {
        let [own, wanted] = found[at].1;
        assert!(
            wanted > 5.0 && (own / wanted - 1.0).abs() < 0.05,
            "{at}: {own} for {wanted}"
        );
    }
    // To the bit from a state in between, and let go it goes home.
    let saved = scene.save().unwrap();
    let next = step(&scene, &[at(34)]);
    scene.restore(&saved).unwrap();
    assert_eq!(bits(&step(&scene, &[at(34)])), bits(&next));
    let far = pressing(&scene, -30.0, Vector::ZERO);
    let mut u = next;
    for _ in 0..40 {
        u = step(&scene, std::slice::from_ref(&far));
    }
    assert!(u.iter().all(|x| x.abs() < 0.5));
}
