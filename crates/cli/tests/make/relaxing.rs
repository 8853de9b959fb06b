//! A tool that is held in tissue which relaxes: the force falls as the solver's does.

use std::path::Path;

use contact::{Pose, Rotation, Shape, Vector};
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{Solver, SolverOptions, Tool, ToolPose};
use upt::{Contact, Model, ModelOptions, Scene, SceneOptions};

/// Frames of 50 ms: a press in 0.4 s, then still.
const PRESS: usize = 8;
const FRAMES: usize = 208;
const RADIUS: f32 = 10.0;
const DEPTH: f32 = 6.0;

fn height(frame: usize) -> f32 {
    let part = frame.min(PRESS) as f32 / PRESS as f32;
    30.0 + RADIUS + 0.5 - (0.5 + DEPTH) * part
}

/// Force along z by frame, mN.
fn of_the_solver(bundle: &Path, model: &Model) -> Vec<f32> {
    let mesh = Mesh::read(&bundle.join("mesh.safetensors")).unwrap();
    let options = SolverOptions {
        material: model.manifest.material,
        inner_step_s: 4e-4,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let tool = Tool {
        shape: Shape::Sphere { radius: RADIUS },
        friction: 0.0,
        tear_off_mn: 0.0,
    };
    let pose = |frame| Pose::from_parts(Vector::Z * height(frame), Rotation::IDENTITY);
    let samples = mesh.samples(Boundary::Fixed);
    solver.set_tools(samples, &[tool], &[pose(0)]).unwrap();
    let mut force = |frame| {
        let place = ToolPose {
            pose: pose(frame),
            grasp: false,
        };
        solver.step_tools(&[], &[place], 0.05).unwrap().tools[0].force[2]
    };
    (1..FRAMES).map(&mut force).collect()
}

fn of_the_library(model: std::sync::Arc<Model>) -> Vec<f32> {
    let scene = Scene::new(model, &SceneOptions::default()).unwrap();
    let shape = Shape::Sphere { radius: RADIUS };
    let step = |frame| {
        let place = [0.0, 0.0, height(frame)];
        let tool = upt::contact::Tool::new(&shape, place, [0.0, 0.0, 0.0, 1.0]).unwrap();
        scene.step(Contact::Tools(&[tool]), None).unwrap();
        scene.with_contact_report(|report| report.readings[0].force[2])
    };
    (1..FRAMES).map(step).collect()
}

/// Both forces fall by the same.
pub fn falls_as_the_solvers(bundle: &Path) {
    let model = Model::open(bundle, &ModelOptions::default()).unwrap();
    let truth = of_the_solver(bundle, &model);
    let own = of_the_library(model);
    for at in [PRESS - 1, PRESS + 2, PRESS + 20, FRAMES / 2, FRAMES - 2] {
        println!("frame {at}: {:.1} of {:.1} mN", own[at], truth[at]);
    }
    let last = FRAMES - 2;
    let off = (own[last] / truth[last] - 1.0).abs();
    assert!(off < 0.05, "{} of {} mN", own[last], truth[last]);
    let fallen = |forces: &[f32]| forces[last] / forces[PRESS - 1];
    assert!(fallen(&truth) < 0.8, "{}", fallen(&truth));
    let off = (fallen(&own) / fallen(&truth) - 1.0).abs();
    assert!(off < 0.05, "{} of {}", fallen(&own), fallen(&truth));
}
