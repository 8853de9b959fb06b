//! What an inner step costs, of an elastic body.

use super::Solver;
use super::fields::Node;

impl Solver {
    /// Bytes that an inner step streams through, and its floating-point operations:
    /// the figures behind the roofline in `docs/reference/solver.md`.
    pub fn step_cost(&self) -> StepCost {
        let partition = &self.partition;
        let slots: usize = partition.chunks.iter().map(|c| c.slot_count()).sum();
        let (octahedra, pairs, singles) =
            (&partition.octahedra, &partition.pairs, &partition.singles);
        let kinds = [
            (6, 4, octahedra.count(), octahedra.batches.len()),
            (5, 2, pairs.count(), pairs.batches.len()),
            (4, 1, singles.count(), singles.batches.len()),
        ];
        let mut cost = StepCost {
            // Displacement, increment and force both ways, rest positions.
            bytes: slots * 7 * std::mem::size_of::<Node>()
                + octahedra.bytes()
                + pairs.bytes()
                + singles.bytes(),
            flops: slots * elements::FLOPS_PER_NODE,
            gathers: 0,
        };
        for (nodes, tets, clusters, batches) in kinds {
            cost.flops += clusters * elements::flops(nodes, tets, &self.options.material.law);
            cost.gathers += elements::WIDTH * batches * nodes;
        }
        cost
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
