//! A copy of a host's loads and ties, for a step that is submitted.
//!
//! A step that is submitted is made later on another thread, when the host's lists may be gone; so
//! they are copied, and the copy is lent out as [`Loads`] when the step is made. Lists of lists lie
//! flat, one after the other, with their lengths beside them: a submission then allocates nothing
//! once its lists have had their size. The numbers of entries are within their bounds: a step is
//! checked before it is copied.

use ::contact::Tie;

use super::load_limits::WHAT;
use super::loads::{Loads, MAX_PRESSURES, Pressure};
use super::point_force::PointForce;
use super::support::SupportPose;
use super::supports::{GroupMotion, MAX_SUPPORTS};
use crate::error::Result;
use crate::memory;

/// See the module.
#[derive(Default)]
pub(super) struct CopiedLoads {
    /// Now, and at rest.
    gravity: [[f32; 3]; 2],
    support: Option<SupportPose>,
    /// Whether the host gave forces by node.
    has_forces: bool,
    /// By node of the intact mesh `[K,3]`, mN.
    forces: Vec<f32>,
    point_forces: Vec<PointForce>,
    /// One list of nodes after the other.
    nodes: Vec<u32>,
    /// How many of them each pressure has, and its size, Pa.
    pressures: Vec<(usize, f32)>,
    ties: Vec<Tie>,
    /// Support groups, and their displacements one list after the other.
    supports: Vec<CopiedGroup>,
    displacements: Vec<f32>,
}

/// A group, and how many numbers its displacements have.
#[derive(Clone, Copy)]
struct CopiedGroup {
    motion: GroupMotion<'static>,
    count: Option<usize>,
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
        memory::replace(&mut self.point_forces, loads.point_forces, WHAT)?;
        let given = |motion: &GroupMotion<'_>| motion.displacements.map(<[f32]>::len);
        let numbers = loads.supports.iter().filter_map(given);
        memory::fit(&mut self.displacements, numbers.sum(), WHAT)?;
        memory::fit(&mut self.supports, loads.supports.len(), WHAT)?;
        self.displacements.clear();
        self.supports.clear();
        for motion in loads.supports {
            self.displacements
                .extend_from_slice(motion.displacements.unwrap_or_default());
            self.supports.push(CopiedGroup {
                motion: GroupMotion {
                    displacements: None,
                    ..*motion
                },
                count: given(motion),
            });
        }
        self.gravity = [loads.gravity, loads.gravity_at_rest];
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
        let mut supports = [GroupMotion::default(); MAX_SUPPORTS];
        let mut numbers = &*self.displacements;
        for (support, copied) in supports.iter_mut().zip(&self.supports) {
            *support = copied.motion;
            if let Some(count) = copied.count {
                let (own, rest) = numbers.split_at(count);
                support.displacements = Some(own);
                numbers = rest;
            }
        }
        call(Loads {
            gravity: self.gravity[0],
            gravity_at_rest: self.gravity[1],
            forces: self.has_forces.then_some(&*self.forces),
            point_forces: &self.point_forces,
            pressures: &pressures[..self.pressures.len()],
            support: self.support,
            ties: &self.ties,
            supports: &supports[..self.supports.len().min(MAX_SUPPORTS)],
        })
    }
}
