//! One case from rest to the last frame.

use crate::contact::{ContactDomain, ContactError};
use crate::mesh::{Boundary, Mesh};
use crate::schemes::{FRAME_S, FRAMES, Programme, Scheme};
use crate::solver::{Solver, SolverError, SolverOptions};
use crate::trajectory::{Trajectory, TrajectoryHeader};

/// Name and version that trajectories carry.
pub const SOLVER_NAME: &str = concat!("libupt tled ", env!("CARGO_PKG_VERSION"));

/// A case that could not be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    #[error(transparent)]
    Contact(#[from] ContactError),
    #[error(transparent)]
    Solver(#[from] SolverError),
    #[error("scheme `{0}` is a list of equilibria, not a motion: use `upt dataset` with --columns")]
    Static(&'static str),
}

/// Simulates `scheme` with `seed` on `mesh`; `progress` hears of each finished frame.
///
/// The same inputs give the same trajectory, for any number of threads, on one
/// machine and instruction set.
pub fn simulate(
    mesh: &Mesh,
    boundary: Boundary,
    scheme: Scheme,
    seed: u64,
    options: &SolverOptions,
    mut progress: impl FnMut(usize),
) -> Result<Trajectory, SimulationError> {
    if scheme.is_static() {
        return Err(SimulationError::Static(scheme.name()));
    }
    let domain = ContactDomain::new(mesh, boundary)?;
    let programme = Programme::new(scheme, &domain, seed)?;
    let mut options = options.clone();
    options.material.damping_per_s *= scheme.damping_factor();
    let mut solver = Solver::new(mesh, boundary, options.clone())?;
    let nodes = mesh.node_count();
    let header = TrajectoryHeader {
        mesh_name: mesh.name.clone(),
        mesh_sha256: mesh.hash(),
        boundary: boundary.as_str().into(),
        scheme: scheme.name().into(),
        seed,
        site: programme.site(),
        material: options.material,
        dt_s: FRAME_S,
        inner_dt_s: options.inner_step_s,
        mass_scaling_s: options.mass_scaling_s,
        solver: SOLVER_NAME.into(),
    };
    let mut trajectory = Trajectory::at_rest(header, nodes);
    trajectory.displacement.resize(FRAMES * nodes, [0.0; 3]);
    for frame in 1..FRAMES {
        let contact = programme.contact(frame);
        let report = solver.step_frame(&contact, FRAME_S)?;
        solver.displacement(&mut trajectory.displacement[frame * nodes..(frame + 1) * nodes]);
        for entry in &contact {
            trajectory.contact_nodes.push(entry.node);
            trajectory.contact_vectors.push(entry.displacement);
        }
        trajectory
            .contact_offsets
            .push(trajectory.contact_nodes.len() as u32);
        trajectory.reaction.extend(report.reaction);
        trajectory.strain_energy.push(report.strain_energy as f32);
        trajectory.kinetic_energy.push(report.kinetic_energy as f32);
        trajectory.external_work.push(report.external_work as f32);
        trajectory.min_det_f.push(report.min_det_f as f32);
        progress(frame);
    }
    Ok(trajectory)
}
