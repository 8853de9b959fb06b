//! A copy of a host's loads and ties, for a step that is submitted.

use ::contact::Tie;

use super::loads::{Loads, MAX_PRESSURES, Pressure, WHAT};
use super::support::SupportPose;
use crate::error::Result;
use crate::memory;

/// See the module.
#[derive(Default)]
pub(super) struct CopiedLoads {
    gravity: [f32; 3],
    gravity_at_rest: [f32; 3],
    support: Option<SupportPose>,
    has_forces: bool,
    forces: Vec<f32>,
    /// One list of nodes after the other.
    nodes: Vec<u32>,
    /// How many of them each pressure has, and its size, Pa.
    pressures: Vec<(usize, f32)>,
    ties: Vec<Tie>,
}

impl CopiedLoads {
    /// Takes loads. All lists have room before one changes.
    pub(super) fn take(&mut self, loads: &Loads<'_>) -> Result<()> {
        let forces = loads.forces.unwrap_or_default();
        let nodes = loads.pressures.iter().map(|pressure| pressure.nodes.len());
        memory::fit(&mut self.forces, forces.len(), WHAT)?;
        memory::fit(&mut self.nodes, nodes.sum(), WHAT)?;
        memory::fit(&mut self.pressures, loads.pressures.len(), WHAT)?;
        memory::replace(&mut self.ties, loads.ties, WHAT)?;
        self.gravity = loads.gravity;
        self.gravity_at_rest = loads.gravity_at_rest;
        self.support = loads.support;
        self.has_forces = loads.forces.is_some();
        self.forces.clear();
        self.forces.extend_from_slice(forces);
        self.nodes.clear();
        self.pressures.clear();
        for pressure in loads.pressures {
            self.nodes.extend_from_slice(pressure.nodes);
            let own = (pressure.nodes.len(), pressure.pascal);
            self.pressures.push(own);
        }
        Ok(())
    }

    /// Calls with the loads.
    pub(super) fn with<T>(&self, call: impl FnOnce(Loads<'_>) -> T) -> T {
        let mut pressures = [Pressure::default(); MAX_PRESSURES];
        let mut nodes = &*self.nodes;
        for (pressure, &(count, pascal)) in pressures.iter_mut().zip(&self.pressures) {
            let (own, rest) = nodes.split_at(count);
            *pressure = Pressure { nodes: own, pascal };
            nodes = rest;
        }
        call(Loads {
            gravity: self.gravity,
            gravity_at_rest: self.gravity_at_rest,
            forces: self.has_forces.then_some(&*self.forces),
            pressures: &pressures[..self.pressures.len()],
            support: self.support,
            ties: &self.ties,
        })
    }
}
