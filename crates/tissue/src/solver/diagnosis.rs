//! What a frame reports, and why it failed: f64 passes over the elements, once a frame.

use super::stiffest::stiffest;
use super::ties::Ties;
use super::touch::{ToolPose, Touch};
use super::{ContactNode, FrameReport, Solver, SolverError};
use elements::Chunk;
use elements::shape_gradients;
use elements::{Deformation, Moduli, shape_energy};
use rayon::prelude::*;

/// Sums and extremes over the elements of the present state.
pub(super) struct Diagnosis {
    /// nJ.
    pub strain_energy: f64,
    pub min_det_f: f64,
    /// Mesh element with the smallest det F.
    pub worst_element: usize,
    /// Largest [`stiffest`] times the square of the element's relative wave speed, 1/mm²: proportional to the largest eigenvalue bound.
    pub largest_bound: f64,
}

impl Diagnosis {
    const NONE: Self = Self {
        strain_energy: 0.0,
        min_det_f: f64::INFINITY,
        worst_element: 0,
        largest_bound: 0.0,
    };

    /// Of this and the chunk after it.
    fn and(mut self, next: &Self) -> Self {
        self.strain_energy += next.strain_energy;
        self.largest_bound = self.largest_bound.max(next.largest_bound);
        self.note(next.min_det_f, next.worst_element);
        self
    }

    fn note(&mut self, determinant: f64, element: usize) {
        if determinant < self.min_det_f || determinant.is_nan() {
            self.min_det_f = determinant;
            self.worst_element = element;
        }
    }
}

impl Solver {
    /// Visits all elements; the same bits for any number of threads.
    pub(super) fn diagnose(&self) -> Diagnosis {
        let chunks = &self.partition.chunks;
        let parts: Vec<Diagnosis> = match &self.pool {
            None => chunks
                .iter()
                .map(|chunk| self.diagnose_chunk(chunk))
                .collect(),
            Some(pool) => pool.install(|| {
                let chunks = chunks.par_iter();
                chunks.map(|chunk| self.diagnose_chunk(chunk)).collect()
            }),
        };
        parts.iter().fold(Diagnosis::NONE, Diagnosis::and)
    }

    fn diagnose_chunk(&self, chunk: &Chunk) -> Diagnosis {
        let mut result = Diagnosis::NONE;
        let bulk = self.options.material.bulk_pa();
        let moduli = self.partition.moduli_of(chunk);
        let shear_over_bulk = moduli.shear_pa / bulk;
        self.partition.elements(chunk).for_each(|element| {
            let number = element.number as usize;
            let (mut rest, mut displacement) = ([[0.0; 3]; 4], [[0.0; 3]; 4]);
            for corner in 0..4 {
                let local = element.slots[corner] as usize / 2;
                let slot = match local.checked_sub(chunk.owned) {
                    None => chunk.first + local,
                    Some(ghost) => chunk.ghosts[ghost] as usize,
                };
                let (at, moved) = (
                    &self.partition.rest[chunk.first + local],
                    &self.fields.displacement[slot].0,
                );
                for k in 0..3 {
                    rest[corner][k] = at[k];
                    displacement[corner][k] = f64::from(moved[k]);
                }
            }
            let state = element_state((rest, element.fibre), displacement, moduli);
            let determinant = state.deformation.det;
            result.note(determinant, number);
            let speed_squared = f64::from(self.speed_squared[number]);
            result.largest_bound = result.largest_bound.max(state.bound * speed_squared);
            let isochoric = shape_energy(&state.deformation, moduli.law, determinant.max(1e-3));
            let density = 2.0 * shear_over_bulk * isochoric + (determinant - 1.0).powi(2);
            // `bulk` is a sixth of the element's modulus.
            result.strain_energy += 3.0 * f64::from(element.bulk.abs()) * state.volume * density;
        });
        result
    }

    /// The report of the frame that just ended.
    pub(super) fn report(&mut self, contact: &[ContactNode], steps: u32) -> FrameReport {
        let diagnosis = self.diagnose();
        self.critical_now =
            self.critical_at_rest * (self.bound_at_rest / diagnosis.largest_bound).sqrt();
        if !contact.is_empty() {
            self.update_forces();
        }
        let reaction = contact
            .iter()
            .map(|entry| {
                let slot = self.partition.slot_of_node[entry.node as usize] as usize;
                let [x, y, z, _] = self.fields.force[slot].0;
                [x * 1e-3, y * 1e-3, z * 1e-3]
            })
            .collect();
        FrameReport {
            time_s: self.time_s,
            strain_energy: diagnosis.strain_energy * 1e-6,
            kinetic_energy: self.kinetic_energy() * 1e-6,
            external_work: self.external_work,
            min_det_f: diagnosis.min_det_f,
            reaction,
            ties: self.ties.as_ref().map_or_else(Vec::new, Ties::reports),
            inner_steps: steps,
            tools: self.touch.as_ref().map_or_else(Vec::new, Touch::reports),
            sample_forces: self
                .touch
                .as_ref()
                .map_or_else(Vec::new, Touch::sample_forces),
            critical_step_s: self.critical_now,
        }
    }

    /// `1/2 sum m |d / dt|²`, nJ.
    fn kinetic_energy(&self) -> f64 {
        let mut sum = 0.0;
        for chunk in &self.partition.chunks {
            for slot in chunk.first..chunk.first + chunk.owned {
                let d = self.fields.increment[slot].0;
                let squared: f64 = d[..3].iter().map(|v| f64::from(*v).powi(2)).sum();
                sum += f64::from(self.mass[slot]) * squared;
            }
        }
        0.5 * sum / (self.dt * self.dt)
    }

    /// Runs the failed frame again up to the fault, to name time, element and cause.
    ///
    /// The caller restores the state afterwards.
    pub(super) fn explain(
        &mut self,
        inverted_at: Option<u32>,
        tools: &[ToolPose],
        steps: u32,
        dt: f64,
    ) -> SolverError {
        let step_ms = dt * 1e3;
        let Some(step) = inverted_at else {
            let node = self
                .partition
                .slot_of_node
                .iter()
                .position(|slot| {
                    let u = self.fields.displacement.get(*slot as usize);
                    !u.copied().unwrap_or_default().0[..3]
                        .iter()
                        .all(|v| v.abs() < 1e5)
                })
                .unwrap_or(0);
            let element = self
                .tets
                .iter()
                .position(|tet| tet.contains(&(node as u32)))
                .unwrap_or(0);
            return SolverError::Diverged {
                time_s: self.time_s + dt * f64::from(steps),
                node,
                element,
                cause: "displacement is not finite or above 100 m",
                step_ms,
            };
        };
        self.fields.clone_from(&self.backup);
        self.touch.clone_from(&self.touch_backup);
        let targets = self.paths.clone();
        for path in &mut self.paths {
            path.target = path.at(step - 1, steps);
        }
        self.dt = self.backup_dt;
        self.set_step(dt);
        if let Some(touch) = &mut self.touch {
            touch.begin(tools, steps, dt);
        }
        if let Some(load) = &mut self.load {
            load.begin(steps);
        }
        if step > 1 {
            self.run(step - 1);
        }
        self.paths = targets;
        let diagnosis = self.diagnose();
        SolverError::Inverted {
            time_s: self.time_s + dt * f64::from(step - 1),
            element: diagnosis.worst_element,
            det_f: diagnosis.min_det_f,
            step_ms,
        }
    }
}

struct ElementState {
    /// At rest, mm³.
    volume: f64,
    deformation: Deformation,
    bound: f64,
}

#[inline]
fn element_state(
    (rest, fibre): ([[f32; 3]; 4], [f32; 3]),
    displacement: [[f64; 3]; 4],
    moduli: Moduli,
) -> ElementState {
    let (slopes, volume) = shape_gradients(rest);
    let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut gradients = [[0.0; 3]; 4];
    for a in 0..3 {
        for j in 0..3 {
            let slope = slopes[a][j];
            gradients[a + 1][j] = slope;
            gradients[0][j] -= slope;
            for i in 0..3 {
                f[i][j] += slope * (displacement[a + 1][i] - displacement[0][i]);
            }
        }
    }
    let deformation = Deformation::of(f).along(fibre.map(f64::from));
    ElementState {
        volume: volume.abs(),
        bound: stiffest(&gradients, &deformation, moduli),
        deformation,
    }
}
