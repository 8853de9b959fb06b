//! Total Lagrangian explicit dynamics (TLED; Miller et al. 2007) on linear tetrahedra.
//!
//! Compressible neo-Hookean elements, lumped mass, mass-proportional damping,
//! central differences, f32 state. One [`Solver::step_frame`] moves the body by a
//! frame (50 ms in the paper, 500 inner steps of 0.1 ms); contact nodes are led
//! on straight lines to their prescribed displacement. The result has the same
//! bits for any number of threads.

mod barrier;
mod cluster;
mod diagnosis;
mod dispatch;
mod error;
mod kernel;
mod lanes;
mod march;
mod mass;
mod partition;
mod stability;

pub use dispatch::Simd;
pub use error::SolverError;

use crate::material::Material;
use crate::mesh::{Boundary, Mesh};
use dispatch::Kernels;
use kernel::Law;
use march::{Fields, March, Node, Path};
use mass::LumpedMass;
use partition::Partition;

/// How the pressure of an element is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pressure {
    /// `kappa (J - 1)` of the element itself; locks near incompressibility.
    #[default]
    Element,
    /// Mean of the corners' average nodal pressure (Bonet and Burton 1998): softer, about twice the cost.
    AverageNodal,
}

/// What happens when the asked inner step is above the stable one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Substep {
    /// The frame is cut into more inner steps; a frame that fails is repeated with half the step.
    #[default]
    Automatic,
    /// [`SolverError::StepTooLong`].
    Refuse,
}

/// Settings of a [`Solver`].
#[derive(Clone, Debug)]
pub struct SolverOptions {
    /// Default: brain tissue, see [`Material`].
    pub material: Material,
    /// Asked inner step, s. Default 1e-4.
    pub inner_step_s: f64,
    /// Part of the estimated critical step that is used. Default 0.8.
    pub safety: f64,
    /// Selective mass scaling: elements whose own critical step is shorter get mass until it is this long, s.
    /// Default 0: none. See [`Solver::added_mass`].
    pub mass_scaling_s: f64,
    /// Default [`Substep::Automatic`].
    pub substep: Substep,
    /// Default [`Pressure::Element`].
    pub pressure: Pressure,
    /// Default 1.
    pub threads: usize,
    /// Default: the best set of this processor.
    pub simd: Option<Simd>,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            material: Material::default(),
            inner_step_s: 1e-4,
            safety: 0.8,
            mass_scaling_s: 0.0,
            substep: Substep::Automatic,
            pressure: Pressure::Element,
            threads: 1,
            simd: None,
        }
    }
}

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
    /// Work done by the contact nodes since rest, mJ.
    pub external_work: f64,
    /// Smallest det F over the elements.
    pub min_det_f: f64,
    /// Elastic force of the tissue on the instrument, a row a contact node, mN.
    pub reaction: Vec<[f32; 3]>,
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
    options: SolverOptions,
    kernels: Kernels,
    law: Law,
    partition: Partition,
    /// By slot: nodal mass, g (ghosts and padding zero).
    mass: Vec<f32>,
    /// By slot: four times the nodal rest volume, mm³, elements weighted by their stiffness.
    rest_volume: Vec<f32>,
    /// By mesh element: square of its wave speed over the material's, that is its stiffness over its
    /// density (mass scaling).
    speed_squared: Vec<f32>,
    added_mass: f64,
    /// By slot: held at zero.
    held: Vec<bool>,
    fields: Fields,
    backup: Fields,
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
        options.material.validate()?;
        check_positive("inner_step_s", options.inner_step_s)?;
        check_positive("safety", options.safety)?;
        if !(options.mass_scaling_s.is_finite() && options.mass_scaling_s >= 0.0) {
            return Err(SolverError::Option {
                field: "mass_scaling_s",
                value: options.mass_scaling_s,
                wanted: "zero or positive",
            });
        }
        let simd = options.simd.unwrap_or_else(Simd::detect);
        let kernels = Kernels::of(simd).ok_or(SolverError::SimdUnavailable(simd))?;
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
        let partition = Partition::new(mesh);
        let slots = partition.node_of_slot.len();
        let lumped = LumpedMass::new(mesh, &options.material, options.mass_scaling_s);
        let mut mass = vec![0.0; slots];
        let mut rest_volume = vec![0.0; slots];
        for (node, slot) in partition.slot_of_node.iter().enumerate() {
            mass[*slot as usize] = lumped.mass[node] as f32;
            rest_volume[*slot as usize] = (4.0 * lumped.stiff_volume[node]) as f32;
        }
        let mut held = vec![false; slots];
        for node in mesh.held_nodes(boundary) {
            held[partition.slot_of_node[node as usize] as usize] = true;
        }
        let zero = vec![Node::default(); slots];
        let fields = Fields {
            displacement: zero.clone(),
            increment: zero.clone(),
            force: zero,
        };
        let mut solver = Self {
            positions: mesh.positions.clone(),
            tets: mesh.tets.clone(),
            kernels,
            law: Law {
                shear: options.material.shear_pa() as f32,
                bulk: options.material.bulk_pa() as f32,
            },
            partition,
            mass,
            rest_volume,
            speed_squared: (0..mesh.tets.len())
                .map(|tet| mesh.stiffness_of(tet) / lumped.factor[tet])
                .collect(),
            added_mass: lumped.added,
            held,
            backup: fields.clone(),
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
        solver.reset();
        Ok(solver)
    }

    /// Back to rest at time zero.
    pub fn reset(&mut self) {
        for field in [
            &mut self.fields.displacement,
            &mut self.fields.increment,
            &mut self.fields.force,
        ] {
            field.fill(Node::default());
        }
        self.paths.clear();
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
        check_positive("duration_s", duration_s)?;
        self.check_contact(contact)?;
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
        let paths_before = std::mem::take(&mut self.paths);
        let mut refinements = 0;
        loop {
            self.lead(contact);
            match self.march(steps, duration_s) {
                Ok(work) => {
                    self.time_s += duration_s;
                    self.external_work += work;
                    return Ok(self.report(contact, steps));
                }
                Err(error) => {
                    self.fields.clone_from(&self.backup);
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

    /// Writes the displacement, `[K,3]` mm, in the mesh's node order.
    ///
    /// Panics when `out` does not have `K` rows.
    pub fn displacement(&self, out: &mut [[f32; 3]]) {
        assert_eq!(out.len(), self.positions.len(), "one row a node");
        for (row, slot) in out.iter_mut().zip(&self.partition.slot_of_node) {
            let [x, y, z, _] = self.fields.displacement[*slot as usize].0;
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

    /// Bytes that an inner step streams through, and its floating-point operations:
    /// the figures behind the roofline in `docs/reference-solver.md`.
    pub fn step_cost(&self) -> StepCost {
        let partition = &self.partition;
        let slots: usize = partition.chunks.iter().map(|c| c.slot_count()).sum();
        let constants =
            partition.octahedra.bytes() + partition.pairs.bytes() + partition.singles.bytes();
        let corners = lanes::WIDTH
            * (6 * partition.octahedra.batches.len()
                + 5 * partition.pairs.batches.len()
                + 4 * partition.singles.batches.len());
        StepCost {
            bytes: constants + slots * 6 * std::mem::size_of::<Node>(),
            flops: self.tets.len() * kernel::FLOPS_PER_TET
                + corners * kernel::FLOPS_PER_CORNER
                + self.positions.len() * 9,
            gathers: corners,
        }
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

    /// Sets the frame's contact paths from the present positions.
    fn lead(&mut self, contact: &[ContactNode]) {
        self.paths.clear();
        for entry in contact {
            let slot = self.partition.slot_of_node[entry.node as usize];
            let [x, y, z, _] = self.fields.displacement[slot as usize].0;
            self.paths.push(Path {
                slot,
                start: [x, y, z],
                target: entry.displacement,
            });
        }
        self.paths.sort_unstable_by_key(|path| path.slot);
    }

    /// Gains `g` for the step, increments rescaled to it.
    fn set_step(&mut self, dt: f64) {
        let scale = (dt / self.dt) as f32;
        let gain = dt * dt / (1.0 + 0.5 * self.options.material.damping_per_s * dt);
        for chunk in &self.partition.chunks {
            for slot in chunk.first..chunk.first + chunk.owned {
                let increment = &mut self.fields.increment[slot].0;
                if scale != 1.0 {
                    increment.iter_mut().for_each(|v| *v *= scale);
                }
                increment[3] = if self.held[slot] {
                    0.0
                } else {
                    (gain / f64::from(self.mass[slot])) as f32
                };
            }
        }
        for path in &self.paths {
            self.fields.increment[path.slot as usize].0[3] = 0.0;
        }
        self.dt = dt;
    }

    /// Runs one attempt at a frame; returns the external work, mJ.
    fn march(&mut self, steps: u32, duration_s: f64) -> Result<f64, SolverError> {
        let dt = duration_s / f64::from(steps);
        self.set_step(dt);
        let tallies = self.run(steps);
        let inverted = tallies
            .iter()
            .map(|tally| tally.inverted_at)
            .filter(|step| *step > 0)
            .min();
        if inverted.is_some() || !self.is_finite() {
            return Err(self.explain(inverted, steps, dt));
        }
        Ok(tallies.iter().map(|tally| tally.work).sum::<f64>() * 1e-6)
    }

    fn run(&mut self, steps: u32) -> Vec<march::Tally> {
        let mut fields = std::mem::take(&mut self.fields);
        let tallies = self.marcher(steps).run(&mut fields, self.pool.as_ref());
        self.fields = fields;
        tallies
    }

    fn marcher(&self, steps: u32) -> March<'_> {
        let damping = self.options.material.damping_per_s;
        March {
            partition: &self.partition,
            kernels: self.kernels,
            law: self.law,
            averaged: self.options.pressure == Pressure::AverageNodal,
            rest_volume: &self.rest_volume,
            mass: &self.mass,
            beta: ((1.0 - 0.5 * damping * self.dt) / (1.0 + 0.5 * damping * self.dt)) as f32,
            dt: self.dt,
            damping,
            paths: &self.paths,
            steps,
        }
    }

    /// Internal forces of the present state into `fields.force`.
    fn update_forces(&mut self) {
        let mut fields = std::mem::take(&mut self.fields);
        self.marcher(0).forces(&mut fields, self.pool.as_ref());
        self.fields = fields;
    }

    /// Every owned displacement is finite and no larger than a hundred metres.
    fn is_finite(&self) -> bool {
        self.partition.chunks.iter().all(|chunk| {
            self.fields.displacement[chunk.first..chunk.first + chunk.owned]
                .iter()
                .all(|node| node.0[..3].iter().all(|v| v.abs() < 1e5))
        })
    }
}

/// See [`Solver::step_cost`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepCost {
    /// Bytes read or written at least once an inner step.
    pub bytes: usize,
    /// Floating-point operations of an inner step.
    pub flops: usize,
    /// Nodes gathered, and scattered to, by the clusters of an inner step: four a tetrahedron without clusters.
    pub gathers: usize,
}

fn check_positive(field: &'static str, value: f64) -> Result<(), SolverError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SolverError::Option {
            field,
            value,
            wanted: "positive",
        })
    }
}
