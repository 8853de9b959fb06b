//! The reference solver on a coarse mesh, embedded in the fine one.
//!
//! A coarse node inside of the contact patch (its nearest fine surface node is a contact node) is led to that node's
//! displacement; a patch that holds no coarse node leads the nearest coarse surface node to the patch's mean. The
//! coarse field is interpolated to the fine nodes; contact nodes then take `c`, held nodes 0.

use std::time::{Duration, Instant};

use super::Embedding;
use crate::mesh::{Boundary, Mesh};
use crate::schemes::FRAME_S;
use crate::solver::{ContactNode, Solver, SolverError, SolverOptions};

/// What can go wrong in [`CoarseTled`].
#[derive(Debug, thiserror::Error)]
pub enum CoarseTledError {
    /// The coarse mesh has no element.
    #[error("the coarse mesh `{0}` has no element to embed nodes in")]
    Empty(String),
    /// The coarse solver failed.
    #[error(transparent)]
    Solver(#[from] SolverError),
}

/// A coarse solver with the interpolation to a fine mesh.
pub struct CoarseTled {
    solver: Solver,
    embedding: Embedding,
    held: Vec<u32>,
    /// Free surface nodes of the coarse mesh and the nearest fine surface node of each.
    anchors: Vec<(u32, u32)>,
    coarse_positions: Vec<[f32; 3]>,
    fine_positions: Vec<[f32; 3]>,
    coarse_field: Vec<[f32; 3]>,
    last_step: Duration,
}

fn distance2(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum()
}

fn surface_nodes(mesh: &Mesh) -> Vec<u32> {
    let mut nodes: Vec<u32> = mesh.surface.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

impl CoarseTled {
    /// Embeds `fine` in `coarse` and makes the coarse solver.
    ///
    /// # Errors
    /// A coarse mesh without elements; what [`Solver::new`] refuses.
    pub fn new(
        coarse: &Mesh,
        fine: &Mesh,
        boundary: Boundary,
        options: SolverOptions,
    ) -> Result<Self, CoarseTledError> {
        let embedding = Embedding::new(coarse, fine)
            .ok_or_else(|| CoarseTledError::Empty(coarse.name.clone()))?;
        let coarse_held = coarse.held_nodes(boundary);
        let fine_surface = surface_nodes(fine);
        let anchors = surface_nodes(coarse)
            .into_iter()
            .filter(|node| coarse_held.binary_search(node).is_err())
            .filter_map(|node| {
                let at = coarse.positions[node as usize];
                let nearest = fine_surface.iter().copied().min_by(|&a, &b| {
                    distance2(fine.positions[a as usize], at)
                        .total_cmp(&distance2(fine.positions[b as usize], at))
                })?;
                Some((node, nearest))
            })
            .collect();
        Ok(Self {
            solver: Solver::new(coarse, boundary, options)?,
            embedding,
            held: fine.held_nodes(boundary),
            anchors,
            coarse_positions: coarse.positions.clone(),
            fine_positions: fine.positions.clone(),
            coarse_field: vec![[0.0; 3]; coarse.node_count()],
            last_step: Duration::ZERO,
        })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.solver.reset();
    }

    /// The coarse contact of a fine contact, ascending by node.
    fn coarse_contact(&self, nodes: &[u32], vectors: &[[f32; 3]]) -> Vec<ContactNode> {
        if nodes.is_empty() {
            return Vec::new();
        }
        let inside: Vec<ContactNode> = self
            .anchors
            .iter()
            .filter_map(|&(node, nearest)| {
                let at = nodes.iter().position(|&n| n == nearest)?;
                Some(ContactNode {
                    node,
                    displacement: vectors[at],
                })
            })
            .collect();
        if !inside.is_empty() {
            return inside;
        }
        let count = nodes.len() as f32;
        let mean = |of: &dyn Fn(usize) -> [f32; 3]| -> [f32; 3] {
            std::array::from_fn(|axis| (0..nodes.len()).map(|i| of(i)[axis]).sum::<f32>() / count)
        };
        let centre = mean(&|i| self.fine_positions[nodes[i] as usize]);
        let displacement = mean(&|i| vectors[i]);
        self.anchors
            .iter()
            .map(|&(node, _)| node)
            .min_by(|&a, &b| {
                distance2(self.coarse_positions[a as usize], centre)
                    .total_cmp(&distance2(self.coarse_positions[b as usize], centre))
            })
            .map(|node| vec![ContactNode { node, displacement }])
            .unwrap_or_default()
    }

    /// One frame of 50 ms: fine `nodes` (ascending) end it at `vectors` (mm). Writes the fine field `[K,3]`.
    ///
    /// # Errors
    /// What [`Solver::step_frame`] refuses.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        out: &mut [[f32; 3]],
    ) -> Result<(), CoarseTledError> {
        let started = Instant::now();
        let contact = self.coarse_contact(nodes, vectors);
        self.solver.step_frame(&contact, FRAME_S)?;
        self.solver.displacement(&mut self.coarse_field);
        self.embedding.interpolate(&self.coarse_field, out);
        for &node in &self.held {
            out[node as usize] = [0.0; 3];
        }
        super::prescribe(nodes, vectors, out);
        self.last_step = started.elapsed();
        Ok(())
    }

    /// Run time of the last step.
    pub fn last_time(&self) -> Duration {
        self.last_step
    }
}
