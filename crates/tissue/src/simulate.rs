//! One case from rest to the last frame: contact that is prescribed, tools, or loads alone.

use crate::contact::{ContactDomain, ContactError};
use crate::load_programmes::{LoadProgramme, LoadSizes};
use crate::mesh::{Boundary, Mesh};
use crate::programmes::{ProgrammeError, ToolCase, ToolProgramme, ToolScale};
use crate::schemes::{FRAME_S, FRAMES, Programme, Scheme};
use crate::solver::{ContactNode, FrameReport, SampleForce, Solver, SolverError, SolverOptions};
use crate::tool_tracks::ToolTracks;
use crate::trajectory::{Trajectory, TrajectoryHeader};
use contact::{Samples, Shape, Vector};
use std::collections::BTreeMap;
use std::time::Instant;

/// Name and version that trajectories carry.
pub const SOLVER_NAME: &str = concat!("libupt tled ", env!("CARGO_PKG_VERSION"));

/// A case that could not be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    #[error(transparent)]
    Contact(#[from] ContactError),
    #[error(transparent)]
    Programme(#[from] ProgrammeError),
    #[error(transparent)]
    Solver(#[from] SolverError),
    #[error("scheme `{0}` is a list of equilibria, not a motion; use `upt dataset` with --columns")]
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
    let header = header(mesh, boundary, scheme.name().into(), seed, &options);
    let mut trajectory = Trajectory::at_rest(
        TrajectoryHeader {
            site: programme.site(),
            ..header
        },
        mesh.node_count(),
    );
    for frame in 1..FRAMES {
        let contact = programme.contact(frame);
        let report = solver.step_frame(&contact, FRAME_S)?;
        record(&mut trajectory, &solver, &report);
        for entry in &contact {
            trajectory.contact_nodes.push(entry.node);
            trajectory.contact_vectors.push(entry.displacement);
        }
        close_row(&mut trajectory);
        trajectory.reaction.extend(report.reaction);
        progress(frame);
    }
    Ok(trajectory)
}

/// A case of tools to simulate.
#[derive(Clone, Copy, Debug)]
pub struct ToolOrder<'a> {
    pub programme: ToolProgramme,
    /// A shape of one's own in place of the table's.
    pub own: Option<&'a Shape>,
    pub seed: u64,
    /// What the table's sizes are multiplied by.
    pub scale: ToolScale,
    /// Loads that act meanwhile.
    pub load: Option<(LoadProgramme, LoadSizes)>,
    /// Frames that each step of the programme is recorded in.
    pub frames_per_step: usize,
    /// Its last frame is the one at whose end this is over, but not one of the first [`LEAST_FRAMES`].
    pub until: Option<Instant>,
}

/// Frames of a case that are simulated whatever the time.
pub const LEAST_FRAMES: usize = 24;

impl ToolOrder<'_> {
    /// A programme with the table's shape and sizes, a frame a step.
    pub fn new(programme: ToolProgramme, seed: u64) -> Self {
        Self {
            programme,
            own: None,
            seed,
            scale: ToolScale::TABLE,
            load: None,
            frames_per_step: 1,
            until: None,
        }
    }
}

/// Simulates a case of tools on `mesh`; `progress` hears of each finished frame and of how many there will be.
///
/// The collision field of a frame is what a host that prescribes contact would give: the nodes that bear a tool's force,
/// where they are at the frame's end.
pub fn simulate_tools(
    mesh: &Mesh,
    boundary: Boundary,
    order: ToolOrder<'_>,
    options: &SolverOptions,
    mut progress: impl FnMut(usize, usize),
) -> Result<Trajectory, SimulationError> {
    let ToolOrder {
        programme,
        own,
        seed,
        scale,
        until,
        ..
    } = order;
    let parts = order.frames_per_step.max(1);
    let case = ToolCase::scaled(programme, mesh, seed, own, scale)?.split(parts);
    let frame_s = FRAME_S / parts as f64;
    let mut solver = Solver::new(mesh, boundary, options.clone())?;
    let samples = mesh.samples(boundary);
    solver.set_tools(samples.clone(), &case.tools, &case.start)?;
    let name = format!("tool-{}", programme.name());
    let header = header(mesh, boundary, name, seed, options);
    let mut trajectory = Trajectory::at_rest(
        TrajectoryHeader {
            site: case.site,
            dt_s: frame_s,
            ..header
        },
        mesh.node_count(),
    );
    let mut tracks = ToolTracks::at_rest(&case.tools, &case.start);
    let held = mesh.held_nodes(boundary);
    for (frame, poses) in case.frames.iter().enumerate() {
        if let Some((programme, sizes)) = order.load {
            let time_s = (frame + 1) as f64 * frame_s;
            solver.set_loads(&programme.loads(sizes, mesh, time_s))?;
            if let Some(motion) = programme.support_at(time_s) {
                solver.set_support(motion, frame_s)?;
            }
        }
        let report = solver.step_tools(&[], poses, frame_s)?;
        record(&mut trajectory, &solver, &report);
        let moved = trajectory.frame(frame + 1);
        let (field, forces) = collision_field(&samples, &report.sample_forces, &held, moved);
        for entry in field {
            trajectory.contact_nodes.push(entry.node);
            trajectory.contact_vectors.push(entry.displacement);
        }
        trajectory.reaction.extend(forces);
        close_row(&mut trajectory);
        tracks.push(poses, &report);
        progress(frame + 1, case.frames.len());
        if frame + 1 >= LEAST_FRAMES && until.is_some_and(|until| Instant::now() > until) {
            break;
        }
    }
    trajectory.tools = Some(tracks);
    Ok(trajectory)
}

/// Simulates a programme of loads on `mesh`, nothing in contact; `progress` hears of each finished frame and of how many there will be.
pub fn simulate_loads(
    mesh: &Mesh,
    boundary: Boundary,
    (programme, sizes): (LoadProgramme, LoadSizes),
    options: &SolverOptions,
    mut progress: impl FnMut(usize, usize),
) -> Result<Trajectory, SimulationError> {
    let mut solver = Solver::new(mesh, boundary, options.clone())?;
    let name = format!("load-{}", programme.name());
    let header = header(mesh, boundary, name, 0, options);
    let mut trajectory = Trajectory::at_rest(header, mesh.node_count());
    let frames = (programme.duration_s() / FRAME_S).round() as usize;
    for frame in 1..=frames {
        let time_s = frame as f64 * FRAME_S;
        solver.set_loads(&programme.loads(sizes, mesh, time_s))?;
        if let Some(motion) = programme.support_at(time_s) {
            solver.set_support(motion, FRAME_S)?;
        }
        let report = solver.step_frame(&[], FRAME_S)?;
        record(&mut trajectory, &solver, &report);
        close_row(&mut trajectory);
        progress(frame, frames);
    }
    Ok(trajectory)
}

/// Nodes that bear forces at samples, ascending, where they are, and the force of the tissue on the tool at each, mN.
fn collision_field(
    samples: &Samples,
    forces: &[SampleForce],
    held: &[u32],
    displacement: &[[f32; 3]],
) -> (Vec<ContactNode>, Vec<[f32; 3]>) {
    let mut nodal: BTreeMap<u32, Vector> = BTreeMap::new();
    for entry in forces {
        for (node, weight) in samples.at(entry.sample).entries() {
            if held.binary_search(&node).is_err() {
                *nodal.entry(node).or_default() += Vector::from(entry.force) * weight;
            }
        }
    }
    let field = nodal.keys().map(|node| ContactNode {
        node: *node,
        displacement: displacement[*node as usize],
    });
    let forces = nodal.values().map(|force| (-*force).to_array());
    (field.collect(), forces.collect())
}

fn header(
    mesh: &Mesh,
    boundary: Boundary,
    scheme: String,
    seed: u64,
    options: &SolverOptions,
) -> TrajectoryHeader {
    TrajectoryHeader {
        mesh_name: mesh.name.clone(),
        mesh_sha256: mesh.hash(),
        boundary: boundary.as_str().into(),
        scheme,
        seed,
        site: [0.0; 3],
        material: options.material,
        dt_s: FRAME_S,
        inner_dt_s: options.inner_step_s,
        mass_scaling_s: options.mass_scaling_s,
        solver: SOLVER_NAME.into(),
    }
}

/// Adds the state at a frame's end.
fn record(trajectory: &mut Trajectory, solver: &Solver, report: &FrameReport) {
    let at = trajectory.displacement.len();
    let nodes = at / trajectory.frame_count();
    trajectory.displacement.resize(at + nodes, [0.0; 3]);
    solver.displacement(&mut trajectory.displacement[at..]);
    trajectory.strain_energy.push(report.strain_energy as f32);
    trajectory.kinetic_energy.push(report.kinetic_energy as f32);
    trajectory.external_work.push(report.external_work as f32);
    trajectory.min_det_f.push(report.min_det_f as f32);
}

/// Ends the frame's row of contact entries.
fn close_row(trajectory: &mut Trajectory) {
    let entries = trajectory.contact_nodes.len() as u32;
    trajectory.contact_offsets.push(entries);
}
