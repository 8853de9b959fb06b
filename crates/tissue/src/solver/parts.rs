//! What follows from the elements of a body: the partition, and what each slot and element carries.

use super::mass::LumpedMass;
use super::{SolverError, SolverOptions};
use elements::{PADDING, Partition, Tetrahedra};

/// See the module.
pub(super) struct Parts {
    pub partition: Partition,
    /// By slot: nodal mass, g (ghosts and padding zero).
    pub mass: Vec<f32>,
    /// By slot: four times the nodal rest volume times the bulk modulus, nJ, elements weighted by their stiffness.
    pub rest_volume: Vec<f32>,
    /// By element: square of its wave speed over the material's, that is its stiffness over its
    /// density (mass scaling).
    pub speed_squared: Vec<f32>,
    /// Over the body's own.
    pub added_mass: f64,
    /// By slot: held at zero.
    pub held: Vec<bool>,
}

impl Parts {
    /// Of elements of which each counts by a share of its volume; all count whole where `shares` is empty.
    pub fn new(
        body: Tetrahedra<'_>,
        shares: &[f32],
        held_nodes: &[u32],
        options: &SolverOptions,
    ) -> Result<Parts, SolverError> {
        let material = &options.material;
        let light: Vec<f32> = (shares.iter().enumerate())
            .map(|(tet, share)| share * body.stiffness_of(tet))
            .collect();
        let stiffness = if shares.is_empty() {
            body.stiffness
        } else {
            &light
        };
        let partition = Partition::new(Tetrahedra { stiffness, ..body }, material)?;
        let slots = partition.node_of_slot.len();
        let lumped = LumpedMass::new(body, shares, material, options.mass_scaling_s);
        let mut parts = Parts {
            mass: vec![0.0; slots],
            rest_volume: vec![0.0; slots],
            speed_squared: (0..body.tets.len())
                .map(|tet| body.stiffness_of(tet) / lumped.factor[tet])
                .collect(),
            added_mass: lumped.added,
            held: vec![false; slots],
            partition,
        };
        let bulk = material.bulk_pa();
        for (node, slot) in parts.partition.slot_of_node.iter().enumerate() {
            // A node of removed tissue has no slot.
            if *slot != PADDING {
                parts.mass[*slot as usize] = lumped.mass[node] as f32;
                parts.rest_volume[*slot as usize] = (4.0 * bulk * lumped.stiff_volume[node]) as f32;
            }
        }
        for node in held_nodes {
            let slot = parts.partition.slot_of_node[*node as usize];
            if slot != PADDING {
                parts.held[slot as usize] = true;
            }
        }
        Ok(parts)
    }
}
