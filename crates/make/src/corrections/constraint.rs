//! Newton steps of the whole body at the stiffness at rest, while some nodes are held where a push put them.

use anyhow::Result;
use upt::kernels::Isa;
use upt::kernels::contact::ContactFactor;

use super::workbench::Workbench;

/// The stiffness with some nodes prescribed, by the factor of the free one and their compliance.
pub struct Constraint {
    dofs: Vec<usize>,
    /// `K^-1` columns of the prescribed dofs `[m,3K]`, mm/mN.
    columns: Vec<f32>,
    factor: ContactFactor,
}

impl Constraint {
    pub fn new(source: &Workbench, nodes: &[u32]) -> Result<Self> {
        let free = &source.stiffness.free;
        let held = &source.held_flags;
        let nodes: Vec<u32> = (nodes.iter().copied())
            .filter(|&node| !held[node as usize])
            .collect();
        let dofs: Vec<usize> = (nodes.iter())
            .filter_map(|&node| free.get(node))
            .flat_map(|at| [3 * at, 3 * at + 1, 3 * at + 2])
            .collect();
        let columns = source.responses(&nodes)?;
        let places: Vec<usize> = (nodes.iter())
            .flat_map(|&node| [0, 1, 2].map(|axis| 3 * node as usize + axis))
            .collect();
        let width = 3 * source.mesh.node_count();
        let mut factor = ContactFactor::with_capacity(dofs.len());
        let names: Vec<u32> = dofs.iter().map(|&dof| dof as u32).collect();
        factor.factor(Isa::detect(), &names, |upper| {
            for (row, column) in upper
                .chunks_exact_mut(dofs.len())
                .zip(columns.chunks_exact(width))
            {
                for (value, &place) in row.iter_mut().zip(&places) {
                    *value = f64::from(column[place]);
                }
            }
        })?;
        Ok(Self {
            dofs,
            columns,
            factor,
        })
    }

    /// `-K^-1 r` with the prescribed nodes where they are, `[K,3]`; `r` in µN.
    pub fn newton(&mut self, source: &Workbench, gradient: &[f32]) -> Vec<f32> {
        let free = &source.stiffness.free.nodes;
        let mut step: Vec<f64> = free
            .iter()
            .flat_map(|&node| {
                let at = 3 * node as usize;
                [0, 1, 2].map(|k| -1e-3 * f64::from(gradient[at + k]))
            })
            .collect();
        for &dof in &self.dofs {
            step[dof] = 0.0;
        }
        source.factor.solve(&mut step);
        let moved: Vec<f32> = self.dofs.iter().map(|&dof| step[dof] as f32).collect();
        let mut forces = vec![0.0; moved.len()];
        self.factor.solve(Isa::detect(), &moved, &mut forces);
        let columns = self.columns.chunks_exact(gradient.len());
        for (column, &force) in columns.zip(&forces) {
            for (&node, step) in free.iter().zip(step.as_chunks_mut::<3>().0) {
                let at = 3 * node as usize;
                for (step, value) in step.iter_mut().zip(&column[at..at + 3]) {
                    *step -= f64::from(force) * f64::from(*value);
                }
            }
        }
        let mut field = vec![0.0f32; gradient.len()];
        for (&node, step) in free.iter().zip(step.as_chunks::<3>().0) {
            let at = 3 * node as usize;
            field[at..at + 3].copy_from_slice(&step.map(|value| value as f32));
        }
        field
    }
}
