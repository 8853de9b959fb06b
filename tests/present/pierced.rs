//! A thin tool in tissue that swings: no frame shows it pierced.

use super::*;
use contact::{Body, Pose, Rotation, Vector};
use upt::{Model, ModelOptions};

/// Of a step, s.
const STEP_S: f64 = 0.02;
/// Ends of steps, mm: a millimetre a step into a fold of the brain, and then still.
const WAY: [[f32; 3]; 10] = [
    [-74.163246, -67.115555, 44.01809],
    [-73.58331, -66.44547, 43.55476],
    [-73.00339, -65.77539, 43.09143],
    [-72.423454, -65.105316, 42.628105],
    [-71.84352, -64.435234, 42.164776],
    [-71.26359, -63.765156, 41.701447],
    [-70.683655, -63.095078, 41.23812],
    [-70.10372, -62.424995, 40.77479],
    [-69.52379, -61.754917, 40.311462],
    [-69.28091, -61.474277, 40.117413],
];
const ROTATION: [f32; 4] = [0.5703858, -0.0, 0.71393245, 0.4061533];
/// Steps.
const STEPS: usize = 14;
/// Points to an edge of a face that are looked at.
const FINE: usize = 5;

/// A cone of 16 sides on a shaft, its point at its lowest end.
fn cone() -> Shape {
    let wide = 20.0 * 17.0f32.to_radians().tan();
    let mut points = vec![[0.0, -20.0, 0.0]];
    for side in 0..16 {
        let (sin, cos) = (side as f32 * std::f32::consts::TAU / 16.0).sin_cos();
        points.extend([0.0, 20.0].map(|y| [wide * cos, y, wide * sin]));
    }
    Shape::Hull {
        points,
        margin: 0.0,
    }
}

/// How deep the surface lies in a body at a pose, mm.
fn depth(scene: &Scene, u: &[f32], body: &Body, pose: &Pose) -> f32 {
    let mesh = scene.mesh();
    let place = |node: u32| {
        let at = 3 * node as usize;
        Vector::new(
            mesh.positions[at] + u[at],
            mesh.positions[at + 1] + u[at + 1],
            mesh.positions[at + 2] + u[at + 2],
        )
    };
    let mut deepest = 0.0f32;
    for face in mesh.surface.faces.as_chunks::<3>().0 {
        let [a, b, c] = face.map(place);
        if body.nearest_at(pose, a).distance > 15.0 {
            continue;
        }
        for i in 0..=FINE {
            for j in 0..=FINE - i {
                let [s, t] = [i, j].map(|k| k as f32 / FINE as f32);
                let point = a + (b - a) * s + (c - a) * t;
                deepest = deepest.max(-body.nearest_at(pose, point).distance);
            }
        }
    }
    deepest
}

/// The tissue about the point swings on after the tool has stopped, and followed for half a step or a whole one it went 1.5 mm into the point.
#[test]
fn a_point_in_a_fold_is_shown_outside_of_the_tissue() {
    let model = Model::open(&fixture::shipped("brain"), &ModelOptions::default()).unwrap();
    let options = SceneOptions {
        step_s: STEP_S,
        ..SceneOptions::default()
    };
    let scene = Scene::new(model, &options).unwrap();
    let shape = cone();
    let body = Body::new(&shape).unwrap();
    let end = |step: usize| Vector::from(WAY[step.min(WAY.len() - 1)]);
    let mut deepest = 0.0f32;
    for step in 0..STEPS {
        let tool = |at: Vector| {
            let mut tool = Tool::new(&shape, at.to_array(), ROTATION).unwrap();
            tool.friction = 0.026040815;
            tool
        };
        scene
            .step(Contact::Tools(&[tool(end(step))]), None)
            .unwrap();
        for part in [0.5, 1.0] {
            let at = end(step).lerp(end(step + 1), part);
            let shown = present(&scene, f64::from(part) * STEP_S, &[tool(at)]);
            let pose = Pose::from_parts(at, Rotation::from_array(ROTATION));
            deepest = deepest.max(depth(&scene, &shown, &body, &pose));
        }
    }
    assert!(deepest < 1.0, "{deepest} mm");
}
