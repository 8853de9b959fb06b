//! A block of tissue on a table and a tool above it.

use contact::{Pose, Rotation, Shape, Vector};
use tissue::mesh::{Boundary, Mesh, box_phantom};
use tissue::solver::{FrameReport, Solver, SolverOptions, Tool, ToolPose};

/// 40 x 40 x 20 mm, its base held, tools on its top.
pub fn block() -> Mesh {
    box_phantom([40.0, 40.0, 20.0], [10, 10, 5]).unwrap()
}

/// The middle of the top.
pub const TOP: Vector = Vector::new(20.0, 20.0, 20.0);

pub fn level(at: Vector) -> Pose {
    Pose::from_parts(at, Rotation::IDENTITY)
}

pub fn sphere(radius: f32, friction: f32) -> Tool {
    Tool {
        shape: Shape::Sphere { radius },
        friction,
        tear_off_mn: 0.0,
    }
}

pub fn solver(mesh: &Mesh, threads: usize, damping_per_s: f64) -> Solver {
    let mut options = SolverOptions {
        threads,
        ..SolverOptions::default()
    };
    options.material.poisson = 0.45;
    options.material.damping_per_s = damping_per_s;
    Solver::new(mesh, Boundary::Fixed, options).unwrap()
}

/// Moves one tool through positions, one a frame.
pub fn drive(
    solver: &mut Solver,
    path: impl IntoIterator<Item = (Vector, bool)>,
    frame_s: f64,
) -> Vec<FrameReport> {
    path.into_iter()
        .map(|(at, grasp)| {
            let to = ToolPose {
                pose: level(at),
                grasp,
            };
            solver.step_tools(&[], &[to], frame_s).unwrap()
        })
        .collect()
}

/// Largest entry of the displacement, mm.
pub fn largest(solver: &Solver, mesh: &Mesh) -> f32 {
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    u.as_flattened()
        .iter()
        .fold(0.0, |m: f32, v| m.max(v.abs()))
}
