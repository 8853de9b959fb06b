//! A solver takes loads: checked, and put where the inner steps find them.

use super::body_load::{BodyLoad, Face, Loads};
use super::options::check_positive;
use super::support::{Support, SupportMotion};
use super::{Solver, SolverError};
use crate::mesh::tet_volume;

impl Solver {
    /// Sets the loads that the next frame ends with; it takes the body there from the present ones, and they stay.
    ///
    /// # Errors
    /// [`SolverError::Load`], with which nothing has changed.
    pub fn set_loads(&mut self, loads: &Loads) -> Result<(), SolverError> {
        if self.load.is_none() && *loads == Loads::default() {
            return Ok(());
        }
        self.check_loads(loads)?;
        let slots = self.partition.node_of_slot.len();
        let mass = self.mass_of_nodes();
        let load = self.load.get_or_insert_with(|| BodyLoad::with_slots(slots));
        for (node, slot) in self.partition.slot_of_node.iter().enumerate() {
            let own = loads.forces.get(node).copied().unwrap_or_default();
            let force = &mut load.dead[1][*slot as usize].0;
            for axis in 0..3 {
                let weight = mass[node] * loads.gravity[axis];
                force[axis] = (weight + 1e3 * f64::from(own[axis])) as f32;
            }
        }
        let before = std::mem::take(&mut load.pascal);
        load.pascal = vec![0.0; self.surface.len()];
        for pressure in &loads.pressures {
            for face in &pressure.faces {
                load.pascal[*face as usize] += pressure.pascal;
            }
        }
        load.faces.clear();
        for (row, face) in self.surface.iter().enumerate() {
            let pascal = [before.get(row).copied().unwrap_or(0.0), load.pascal[row]];
            if pascal != [0.0; 2] {
                load.faces.push(Face {
                    slots: face.map(|node| self.partition.slot_of_node[node as usize]),
                    rest: face.map(|node| self.positions[node as usize]),
                    pascal,
                });
            }
        }
        Ok(())
    }

    /// Sets where the support ends the next frame, which takes `duration_s`; the held nodes go there from where it is now, and stay after that.
    ///
    /// # Errors
    /// [`SolverError::Load`] for numbers that are not finite and a body that has been cut; nothing has changed.
    pub fn set_support(
        &mut self,
        motion: SupportMotion,
        duration_s: f64,
    ) -> Result<(), SolverError> {
        let fail = |field: &str, reason: &str| {
            Err(SolverError::Load {
                field: field.into(),
                reason: reason.into(),
            })
        };
        let SupportMotion {
            position,
            velocity,
            turn,
            turning,
        } = motion;
        let numbers = [position, velocity, turn, turning];
        if !numbers.as_flattened().iter().all(|v| v.is_finite()) {
            return fail("support", "is not finite");
        }
        check_positive("duration_s", duration_s)?;
        if self.topology.body.is_some() {
            return fail(
                "support",
                "moves the body as it was meshed; this one has been cut",
            );
        }
        let slots = self.partition.node_of_slot.len();
        let mass = self.mass_of_nodes();
        let load = self.load.get_or_insert_with(|| BodyLoad::with_slots(slots));
        let support = load.support.get_or_insert_with(|| {
            let nodes = self
                .partition
                .slot_of_node
                .iter()
                .zip(&self.positions)
                .zip(mass);
            let nodes = nodes.map(|((slot, rest), mass)| {
                let is_held = self.held[*slot as usize];
                (*slot, rest.map(f64::from), mass, is_held)
            });
            Support::new(self.options.material.damping_per_s, nodes)
        });
        support.lead(motion, duration_s);
        Ok(())
    }

    /// Of the body itself by node, g.
    pub(super) fn mass_of_nodes(&self) -> Vec<f64> {
        let mut mass = vec![0.0; self.positions.len()];
        let density = self.options.material.density_g_mm3();
        for tet in &self.tets {
            let share = 0.25 * density * tet_volume(&self.positions, *tet);
            tet.iter().for_each(|node| mass[*node as usize] += share);
        }
        mass
    }

    fn check_loads(&self, loads: &Loads) -> Result<(), SolverError> {
        let fail = |field: String, reason: &str| {
            Err(SolverError::Load {
                field,
                reason: reason.into(),
            })
        };
        if !loads.gravity.iter().all(|v| v.is_finite()) {
            return fail("gravity".into(), "is not finite");
        }
        if self.topology.body.is_some() {
            return fail(
                "all".into(),
                "act on the body as it was meshed; this one has been cut",
            );
        }
        let count = self.positions.len();
        if !loads.forces.is_empty() && loads.forces.len() != count {
            return fail("forces".into(), "must have a row a node, or none");
        }
        if let Some(node) = (loads.forces.iter()).position(|f| !f.iter().all(|v| v.is_finite())) {
            return fail(format!("forces[{node}]"), "is not finite");
        }
        for (index, pressure) in loads.pressures.iter().enumerate() {
            let field = format!("pressures[{index}]");
            if !pressure.pascal.is_finite() {
                return fail(field, "is not finite");
            }
            if pressure.faces.is_empty() {
                return fail(field, "has no faces to press on");
            }
            let known = |face: &u32| (*face as usize) < self.surface.len();
            if !pressure.faces.iter().all(known) {
                return fail(field, "names a face that the surface does not have");
            }
        }
        Ok(())
    }
}
