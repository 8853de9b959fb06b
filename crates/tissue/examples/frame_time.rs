//! Times solver frames on a mesh: `frame_time [mesh] [threads] [frames] [best]`.

use std::path::Path;
use tissue::mesh::{Boundary, Mesh, box_phantom};
use tissue::solver::{ContactNode, Isa, Solver, SolverOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mesh = match arguments.next().as_deref() {
        None | Some("box") => box_phantom([100.0, 100.0, 100.0], [26, 26, 26])?,
        Some(path) => Mesh::read(Path::new(path))?,
    };
    let threads = arguments.next().map_or(1, |v| v.parse().unwrap_or(1));
    let frames = arguments.next().map_or(3, |v| v.parse().unwrap_or(3));
    let only_best = arguments.next().is_some();
    let face = mesh.surface[mesh.domain[mesh.domain.len() / 2] as usize];
    let mut nodes = face.to_vec();
    nodes.sort_unstable();
    for isa in Isa::available()
        .into_iter()
        .filter(|isa| !only_best || *isa == Isa::detect())
    {
        let mut solver = Solver::new(
            &mesh,
            Boundary::Fixed,
            SolverOptions {
                threads,
                isa: Some(isa),
                ..SolverOptions::default()
            },
        )?;
        println!(
            "{isa:?}, {} nodes, {} tets, critical step {:.4} ms, {:?}",
            mesh.node_count(),
            mesh.tets.len(),
            solver.critical_step_at_rest_s() * 1e3,
            solver.step_cost(),
        );
        for frame in 1..=frames {
            let contact: Vec<ContactNode> = nodes
                .iter()
                .map(|node| ContactNode {
                    node: *node,
                    displacement: [0.0, 0.0, -0.1 * frame as f32],
                })
                .collect();
            let start = std::time::Instant::now();
            let report = solver.step_frame(&contact, 0.05)?;
            let micros = start.elapsed().as_secs_f64() * 1e6;
            println!(
                "  frame {frame}: {:.1} us a step, {:.1} ms a frame, {} steps, {:?}",
                micros / f64::from(report.inner_steps),
                micros / 1e3,
                report.inner_steps,
                (
                    report.strain_energy,
                    report.kinetic_energy,
                    report.external_work,
                    report.min_det_f,
                    report.reaction[0]
                ),
            );
        }
    }
    Ok(())
}
