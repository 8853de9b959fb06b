//! Linear-elastic quasi-static response with a fitted decay after release.
//!
//! `u' = L(c)` while in contact and `u' = decay * u` when free. Compliance columns of contact nodes are
//! solved when a node is first touched and kept, so a step at a known site is a dense solve of `3m x 3m`
//! and a product of `3m` columns.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use crate::linear::{
    Compliance, Factor, Lame, LinearError, Stiffness, compliance_columns, contact_forces,
};
use crate::mesh::{Boundary, Mesh};

/// Fields `[K,3]` of a unit force in each direction at one node, and the same in f64 at that many dofs.
type NodeColumns = [Vec<f32>; 3];

/// The baseline: one mesh, one boundary condition, a state.
pub struct LinearQuasiStatic {
    stiffness: Stiffness,
    factor: Factor,
    columns: HashMap<u32, NodeColumns>,
    state: Vec<[f32; 3]>,
    decay: f32,
    last_step: Duration,
    last_solve: Duration,
}

impl LinearQuasiStatic {
    /// Assembles and factorises. `decay` is the factor per frame after release (see [`super::DecayFit`]).
    ///
    /// # Errors
    /// See [`LinearError`].
    pub fn new(
        mesh: &Mesh,
        boundary: Boundary,
        lame: Lame,
        decay: f32,
        threads: usize,
    ) -> Result<Self, LinearError> {
        let held = mesh.held_nodes(boundary);
        let stiffness = Stiffness::assemble(mesh, &held, lame)?;
        let factor = Factor::new(&stiffness, &mesh.positions, threads)?;
        Ok(Self {
            stiffness,
            factor,
            columns: HashMap::new(),
            state: vec![[0.0; 3]; mesh.node_count()],
            decay,
            last_step: Duration::ZERO,
            last_solve: Duration::ZERO,
        })
    }

    /// Back to rest; columns that were solved are kept.
    pub fn reset(&mut self) {
        self.state.fill([0.0; 3]);
    }

    /// Solves the columns of nodes that were never touched before.
    fn touch(&mut self, nodes: &[u32]) -> Result<(), LinearError> {
        let mut new: Vec<u32> = nodes
            .iter()
            .copied()
            .filter(|node| !self.columns.contains_key(node))
            .collect();
        new.sort_unstable();
        new.dedup();
        if new.is_empty() {
            return Ok(());
        }
        let width = 3 * self.state.len();
        let mut rows: Vec<Vec<f32>> = Vec::with_capacity(3 * new.len());
        compliance_columns(&self.stiffness, &self.factor, &new, 48, |_, fields| {
            rows.extend(fields.chunks_exact(width).map(<[f32]>::to_vec));
            Ok(())
        })?;
        let mut rows = rows.into_iter();
        for node in new {
            let mut next = || rows.next().unwrap_or_default();
            self.columns.insert(node, [next(), next(), next()]);
        }
        Ok(())
    }

    /// One frame: `nodes` end it at `vectors` (mm). Writes the field `[K,3]` and keeps it as the state.
    ///
    /// # Errors
    /// A contact node that is held or outside of the mesh; a singular contact block. The state is then unchanged.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        out: &mut [[f32; 3]],
    ) -> Result<(), LinearError> {
        if nodes.len() != vectors.len() {
            return Err(LinearError::Count {
                nodes: nodes.len(),
                vectors: vectors.len(),
            });
        }
        let started = Instant::now();
        self.touch(nodes)?;
        self.last_solve = started.elapsed();
        if nodes.is_empty() {
            for u in self.state.iter_mut().flatten() {
                *u *= self.decay;
            }
        } else {
            let size = 3 * nodes.len();
            let mut block = vec![0.0; size * size];
            for (i, node) in nodes.iter().enumerate() {
                for axis in 0..3 {
                    let column = &self.columns[node][axis];
                    for (j, other) in nodes.iter().enumerate() {
                        for k in 0..3 {
                            let value = 0.5 * f64::from(column[3 * *other as usize + k]);
                            block[(3 * i + axis) * size + 3 * j + k] += value;
                            block[(3 * j + k) * size + 3 * i + axis] += value;
                        }
                    }
                }
            }
            let compliance = Compliance {
                nodes: nodes.to_vec(),
                block,
            };
            let rows: Vec<usize> = (0..nodes.len()).collect();
            let prescribed: Vec<[f64; 3]> = vectors.iter().map(|v| v.map(f64::from)).collect();
            let forces = contact_forces(&compliance, &rows, &prescribed)?.forces;
            self.state.fill([0.0; 3]);
            for (i, node) in nodes.iter().enumerate() {
                for axis in 0..3 {
                    let force = forces[3 * i + axis] as f32;
                    let column = &self.columns[node][axis];
                    for (u, a) in self.state.as_flattened_mut().iter_mut().zip(column) {
                        *u += force * a;
                    }
                }
            }
            super::prescribe(nodes, vectors, &mut self.state);
        }
        out.copy_from_slice(&self.state);
        self.last_step = started.elapsed();
        Ok(())
    }

    /// Run time of the last step, and the part of it that solved columns of newly touched nodes.
    pub fn last_times(&self) -> (Duration, Duration) {
        (self.last_step, self.last_solve)
    }
}
