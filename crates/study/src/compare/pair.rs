//! A scene and the reference solver that get the same contacts.

use anyhow::Result;
use tissue::solver::{ContactNode, Solver, SolverOptions};

use super::observer::{Moment, Observer, Truth};
use crate::bench::{Bench, Touch};

const FRAME_S: f64 = 0.05;

/// Both, in step.
pub struct Pair {
    observer: Observer,
    solver: Solver,
    truth: Vec<[f32; 3]>,
}

/// A bench's contact for the solver: ascending.
pub fn contact(touch: &Touch) -> Vec<ContactNode> {
    let (nodes, vectors) = touch;
    let mut contact: Vec<ContactNode> = nodes
        .iter()
        .zip(vectors.as_chunks().0)
        .map(|(&node, &displacement)| ContactNode { node, displacement })
        .collect();
    contact.sort_by_key(|entry| entry.node);
    contact
}

/// The solver's options with the bundle's material.
pub fn options(bench: &Bench) -> SolverOptions {
    SolverOptions {
        material: bench.model.manifest.material,
        ..SolverOptions::default()
    }
}

impl Pair {
    pub fn new(bench: &Bench) -> Result<Self> {
        Ok(Self {
            observer: Observer::new(bench)?,
            solver: Solver::new(&bench.mesh, bench.boundary, options(bench))?,
            truth: vec![[0.0; 3]; bench.mesh.node_count()],
        })
    }

    pub fn sleeps(&self) -> bool {
        self.observer.sleeps()
    }

    /// Moves both by a frame. Fails where the solver does.
    pub fn step(&mut self, contact: &[ContactNode]) -> Result<Moment> {
        let report = self.solver.step_frame(contact, FRAME_S)?;
        self.solver.displacement(&mut self.truth);
        let nodes: Vec<u32> = contact.iter().map(|entry| entry.node).collect();
        let vectors: Vec<[f32; 3]> = contact.iter().map(|entry| entry.displacement).collect();
        let truth = Truth {
            displacement: &self.truth,
            reaction: &report.reaction,
            energy: report.strain_energy + report.kinetic_energy,
        };
        self.observer.step(&nodes, &vectors, &truth)
    }
}
