//! Total Lagrangian explicit dynamics (TLED; Miller et al. 2007) on linear tetrahedra.
//!
//! Compressible hyperelastic elements, lumped mass, mass-proportional damping,
//! central differences, f32 state. One [`Solver::step_frame`] moves the body by a
//! frame (50 ms in the paper, 500 inner steps of 0.1 ms); contact nodes are led
//! on straight lines to their prescribed displacement. The result has the same
//! bits for any number of threads.
//!
//! REQ-080: The reference solver agrees with CalculiX and with closed forms.

mod barrier;
mod body_load;
mod cost;
mod cut_body;
mod cutting;
mod diagnosis;
mod error;
mod fields;
mod frame;
mod groups;
mod loading;
mod march;
mod mass;
mod options;
mod parts;
mod relaxing;
mod remember;
mod stability;
mod stiffest;
mod support;
mod ties;
mod touch;
mod touch_phase;
mod tying;
// Against the energy of `statics`.
#[cfg(all(test, feature = "linear"))]
mod tests;

pub use body_load::{Loads, SurfacePressure};
pub use cost::StepCost;
pub use error::SolverError;
pub use lanes::Isa;
pub use options::{Pressure, SolverOptions, Substep};
pub use support::SupportMotion;
pub use ties::TieReport;
pub use touch::{SampleForce, Tool, ToolPose, ToolReport};

use crate::mesh::{Boundary, Mesh};
use body_load::BodyLoad;
use cut_body::Topology;
use elements::{Kernels, PADDING, Partition};
use fields::{Fields, Node};
use march::Path;
use options::check_positive;
use parts::Parts;
use relaxing::Relaxing;
use ties::Ties;
use touch::Touch;

/// One prescribed node of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactNode {
    pub node: u32,
    /// Displacement from rest at the end of the frame, mm.
    pub displacement: [f32; 3],
}

/// State of the body at the end of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameReport {
    /// Time since rest, s.
    pub time_s: f64,
    /// mJ.
    pub strain_energy: f64,
    /// mJ, from the half-step velocities.
    pub kinetic_energy: f64,
    /// Work done by contact nodes, tools, loads and ties since rest, mJ.
    pub external_work: f64,
    /// Smallest det F over the elements.
    pub min_det_f: f64,
    /// Elastic force of the tissue on the instrument, a row a contact node, mN.
    pub reaction: Vec<[f32; 3]>,
    /// A row a tool.
    pub tools: Vec<ToolReport>,
    /// Forces at samples of the surface, by tool and sample.
    pub sample_forces: Vec<SampleForce>,
    /// A row a tie.
    pub ties: Vec<TieReport>,
    /// Inner steps taken.
    pub inner_steps: u32,
    /// Estimated critical step at this state, s.
    pub critical_step_s: f64,
}

/// A frame is repeated with half the step at most this often.
const MAX_REFINEMENTS: u32 = 3;

/// Soft tissue in motion. One thread at a time; it uses its own threads inside a call.
pub struct Solver {
    positions: Vec<[f32; 3]>,
    tets: Vec<[u32; 4]>,
    surface: Vec<[u32; 3]>,
    options: SolverOptions,
    kernels: Kernels,
    /// What cuts have done.
    topology: Topology,
    partition: Partition,
    /// By slot: nodal mass, g (ghosts and padding zero).
    mass: Vec<f32>,
    /// By slot: four times the nodal rest volume times the bulk modulus, nJ, elements weighted by their stiffness.
    rest_volume: Vec<f32>,
    /// By mesh element: square of its wave speed over the material's, that is its stiffness over its
    /// density (mass scaling).
    speed_squared: Vec<f32>,
    added_mass: f64,
    /// By slot: held at zero.
    held: Vec<bool>,
    fields: Fields,
    backup: Fields,
    touch: Option<Touch>,
    touch_backup: Option<Touch>,
    load: Option<BodyLoad>,
    ties: Option<Ties>,
    ties_backup: Option<Ties>,
    relaxing: Option<Relaxing>,
    relaxing_backup: Option<Relaxing>,
    paths: Vec<Path>,
    pool: Option<rayon::ThreadPool>,
    /// Inner step that the increments in `fields` belong to, s.
    dt: f64,
    /// The same for `backup`.
    backup_dt: f64,
    time_s: f64,
    external_work: f64,
    critical_at_rest: f64,
    critical_now: f64,
    /// Largest element bound at rest, 1/mm².
    bound_at_rest: f64,
}

impl Solver {
    /// Prepares a mesh at rest. Checks the mesh, the material and the options.
    pub fn new(
        mesh: &Mesh,
        boundary: Boundary,
        options: SolverOptions,
    ) -> Result<Self, SolverError> {
        mesh.validate()?;
        options.validate()?;
        mesh.check_laws(&options.material)?;
        let isa = options.isa.unwrap_or_else(Isa::detect);
        let kernels = Kernels::of(isa).ok_or(SolverError::IsaUnavailable(isa))?;
        let pool = match options.threads {
            0 | 1 => None,
            threads => Some(
                rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .map_err(|error| SolverError::Threads {
                        threads,
                        reason: error.to_string(),
                    })?,
            ),
        };
        let held_nodes = mesh.held_nodes(boundary);
        let parts = Parts::new(mesh.tetrahedra(), &[], &held_nodes, &options)?;
        let relaxing = Relaxing::new(&parts.partition)?;
        let slots = parts.partition.node_of_slot.len();
        let zero = vec![Node::default(); slots];
        let fields = Fields {
            displacement: zero.clone(),
            increment: zero.clone(),
            force: zero,
        };
        let mut solver = Self {
            positions: mesh.positions.clone(),
            tets: mesh.tets.clone(),
            surface: mesh.surface.clone(),
            kernels,
            topology: Topology::new(mesh, held_nodes),
            partition: parts.partition,
            mass: parts.mass,
            rest_volume: parts.rest_volume,
            speed_squared: parts.speed_squared,
            added_mass: parts.added_mass,
            held: parts.held,
            backup: fields.clone(),
            touch: None,
            touch_backup: None,
            load: None,
            ties: None,
            ties_backup: None,
            relaxing_backup: relaxing.clone(),
            relaxing,
            fields,
            paths: Vec::new(),
            pool,
            dt: options.inner_step_s,
            backup_dt: options.inner_step_s,
            time_s: 0.0,
            external_work: 0.0,
            critical_at_rest: 0.0,
            critical_now: 0.0,
            bound_at_rest: 0.0,
            options,
        };
        solver.critical_at_rest = solver.estimate_critical_step();
        solver.bound_at_rest = solver.diagnose().largest_bound;
        solver.critical_at_rest *= solver.tautness_at_rest();
        solver.reset();
        Ok(solver)
    }

    /// Back to rest at time zero, without tools, loads and ties. A body that has been cut stays so.
    pub fn reset(&mut self) {
        for field in [
            &mut self.fields.displacement,
            &mut self.fields.increment,
            &mut self.fields.force,
        ] {
            field.fill(Node::default());
        }
        self.paths.clear();
        self.touch = None;
        self.load = None;
        self.ties = None;
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.clear();
        }
        self.dt = self.options.inner_step_s;
        self.time_s = 0.0;
        self.external_work = 0.0;
        self.critical_now = self.critical_at_rest;
    }

    /// Moves the body by `duration_s`; `contact` is ascending by node, each node once.
    ///
    /// Contact nodes go from where they are to their displacement on a straight
    /// line and end exactly there; all other nodes are free or held. On an error
    /// the state is as before the call.
    pub fn step_frame(
        &mut self,
        contact: &[ContactNode],
        duration_s: f64,
    ) -> Result<FrameReport, SolverError> {
        self.step_tools(contact, &[], duration_s)
    }

    /// The same with tools ([`Solver::set_tools`]), each moved to its pose within the frame.
    ///
    /// A node may be prescribed and touched: it then goes where it is told, and the tool does not hold it back.
    pub fn step_tools(
        &mut self,
        contact: &[ContactNode],
        tools: &[ToolPose],
        duration_s: f64,
    ) -> Result<FrameReport, SolverError> {
        check_positive("duration_s", duration_s)?;
        self.check_contact(contact)?;
        self.check_tools(tools)?;
        let asked = (duration_s / self.options.inner_step_s).round().max(1.0) as u32;
        let allowed = self.options.safety * self.critical_now;
        let mut steps = asked;
        if duration_s / f64::from(asked) > allowed {
            if self.options.substep == Substep::Refuse {
                return Err(SolverError::StepTooLong {
                    time_s: self.time_s,
                    step_ms: duration_s / f64::from(asked) * 1e3,
                    allowed_ms: allowed * 1e3,
                    critical_ms: self.critical_now * 1e3,
                });
            }
            steps = (duration_s / allowed).ceil() as u32;
        }
        self.backup.clone_from(&self.fields);
        self.backup_dt = self.dt;
        self.touch_backup.clone_from(&self.touch);
        self.ties_backup.clone_from(&self.ties);
        self.relaxing_backup.clone_from(&self.relaxing);
        let paths_before = std::mem::take(&mut self.paths);
        let mut refinements = 0;
        loop {
            self.lead(contact);
            match self.march(tools, steps, duration_s) {
                Ok(work) => {
                    self.time_s += duration_s;
                    self.external_work += work;
                    if self.load.as_mut().is_some_and(BodyLoad::arrive) {
                        self.place_loads()?;
                    }
                    if let Some(ties) = &mut self.ties {
                        ties.arrive();
                    }
                    return Ok(self.report(contact, steps));
                }
                Err(error) => {
                    self.fields.clone_from(&self.backup);
                    self.touch.clone_from(&self.touch_backup);
                    self.ties.clone_from(&self.ties_backup);
                    self.relaxing.clone_from(&self.relaxing_backup);
                    self.dt = self.backup_dt;
                    if self.options.substep == Substep::Refuse || refinements == MAX_REFINEMENTS {
                        self.paths = paths_before;
                        return Err(error);
                    }
                    refinements += 1;
                    steps *= 2;
                }
            }
        }
    }

    /// Writes the displacement, `[K,3]` mm, in the mesh's node order, then those of the nodes that cuts added. Zero where all tissue around a
    /// node has been removed.
    ///
    /// Panics when `out` does not have `K` rows.
    pub fn displacement(&self, out: &mut [[f32; 3]]) {
        assert_eq!(out.len(), self.positions.len(), "one row a node");
        for (row, slot) in out.iter_mut().zip(&self.partition.slot_of_node) {
            // Nothing is left around a node without a slot.
            let found = self.fields.displacement.get(*slot as usize);
            let [x, y, z, _] = found.copied().unwrap_or_default().0;
            *row = [x, y, z];
        }
    }

    /// Estimated critical step at rest, s.
    pub fn critical_step_at_rest_s(&self) -> f64 {
        self.critical_at_rest
    }

    /// Mass that scaling added, over the body's own.
    pub fn added_mass(&self) -> f64 {
        self.added_mass
    }

    /// Seconds since rest.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    fn check_contact(&self, contact: &[ContactNode]) -> Result<(), SolverError> {
        for (index, entry) in contact.iter().enumerate() {
            let fail = |reason| {
                Err(SolverError::Contact {
                    index,
                    node: entry.node,
                    reason,
                })
            };
            if entry.node as usize >= self.positions.len() {
                return fail("the mesh has no such node");
            }
            if self.partition.slot_of_node[entry.node as usize] == PADDING {
                return fail("the tissue around it has been removed; leave it out");
            }
            if index > 0 && contact[index - 1].node >= entry.node {
                return fail("nodes must be ascending, each once");
            }
            if !entry.displacement.iter().all(|v| v.is_finite()) {
                return fail("the displacement is not finite");
            }
            if self.held[self.partition.slot_of_node[entry.node as usize] as usize] {
                return fail("the node is held by the boundary condition; leave it out");
            }
        }
        Ok(())
    }
}
