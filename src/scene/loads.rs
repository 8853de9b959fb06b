//! What acts on the body beside contact: gravity that turns, forces on nodes, pressure on the surface. A scene without loads keeps nothing of them.
//!
//! REQ-070: A bad load is named and changes nothing; forces that are the weight act as gravity does.

use serde::{Deserialize, Serialize};

use ::contact::Tie;

use super::load_limits::{LARGEST_FORCE, LARGEST_PRESSURE, WHAT, check_size};
use super::point_force::{self, PointForce};
use super::support::{Carriage, Carried, SupportPose};
use super::supports::{self, GroupMotion, GroupState};
use crate::bundle::Mesh;
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::options::LARGEST_GRAVITY;
use crate::stored;

/// Pressures of a step at most.
pub const MAX_PRESSURES: usize = 32;

/// Loads at the end of a step; within the step they change on a line from those of the last. By default there are none. They act in scenes
/// that correct (`corrections`).
#[derive(Debug, Clone, Copy, Default)]
pub struct Loads<'a> {
    /// Gravity in the mesh's frame, m/s²; with a support in the world's.
    pub gravity: [f32; 3],
    /// Gravity under which the mesh was scanned, m/s²: what acts is the difference. Zero: the bundle's, where `gravity` is not zero; without either
    /// nothing acts.
    pub gravity_at_rest: [f32; 3],
    /// Forces on the nodes of the intact mesh `[K,3]`, mN. In a body that has been cut the tissue at a node's place takes its force.
    pub forces: Option<&'a [f32]>,
    /// Forces at points of the tissue, at most [`MAX_POINT_FORCES`](crate::MAX_POINT_FORCES), beside those on nodes.
    pub point_forces: &'a [PointForce],
    /// At most [`MAX_PRESSURES`]; a face in several of them takes their sum.
    pub pressures: &'a [Pressure<'a>],
    /// Where what holds the body is at the end of the step, where it moves. All else stays in the mesh's frame, which goes with the support: displacements,
    /// tools, forces. The body feels the motion as inertia. Pass it in every step; one that goes farther than 40 mm or half a radian in a step is put there.
    pub support: Option<SupportPose>,
    /// Ties of the tissue, at most 256, beside tools or without any. A tie's place in the list is its identity: pass every tie in every step, in the same order.
    /// A broken one stays broken in its place, until it has a stiffness of 0 there or the list ends before it.
    pub ties: &'a [Tie],
    /// What support groups of the bundle do, each at most once; one that is not named is held where it was meshed (or where it was held again). Pass them in every step.
    pub supports: &'a [GroupMotion<'a>],
}

/// A pressure on a part of the surface.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pressure<'a> {
    /// The boundary triangles with all three corners among these nodes, of a cut body what is left of them; empty: the domain, and all that cuts and
    /// removal lay bare.
    pub nodes: &'a [u32],
    /// From outside on the body, Pa; negative for suction. It follows the surface as it moves.
    pub pascal: f32,
}

impl Loads<'_> {
    /// No loads.
    pub const NONE: Loads<'static> = Loads {
        gravity: [0.0; 3],
        gravity_at_rest: [0.0; 3],
        forces: None,
        point_forces: &[],
        pressures: &[],
        support: None,
        ties: &[],
        supports: &[],
    };

    /// The same with the gravity under which a bundle's mesh was scanned, where these turn it and tell no other.
    pub(super) fn scanned_under(self, gravity: [f32; 3]) -> Self {
        match self.gravity != [0.0; 3] && self.gravity_at_rest == [0.0; 3] {
            true => Loads {
                gravity_at_rest: gravity,
                ..self
            },
            false => self,
        }
    }

    /// Whether they are not all zero, or a support is given; ties are no loads here.
    pub(crate) fn acts(&self) -> bool {
        self.acts_with(self.acceleration(None))
            || self.support.is_some()
            || !self.supports.is_empty()
    }

    pub(super) fn acts_with(&self, acceleration: [f32; 3]) -> bool {
        acceleration != [0.0; 3]
            || self.forces.is_some()
            || !self.point_forces.is_empty()
            || self.pressures.iter().any(|pressure| pressure.pascal != 0.0)
    }

    /// What acts of gravity, m/s².
    pub(super) fn acceleration(&self, carriage: Option<&Carriage>) -> [f32; 3] {
        let gravity = carriage.map_or(self.gravity, |own| own.in_frame(self.gravity));
        std::array::from_fn(|axis| gravity[axis] - self.gravity_at_rest[axis])
    }

    /// Checks loads of a body whose intact mesh has `count` nodes.
    ///
    /// # Errors
    /// [`Error::NonFinite`] and [`Error::Argument`], with the field.
    pub(crate) fn check(&self, count: usize) -> Result<()> {
        for (name, gravity) in [
            ("gravity", self.gravity),
            ("gravity_at_rest", self.gravity_at_rest),
        ] {
            for (axis, value) in gravity.into_iter().enumerate() {
                check_size(value, LARGEST_GRAVITY, "m/s²", || {
                    format!("{name}[{axis}]")
                })?;
            }
        }
        if let Some(support) = &self.support {
            support.checked()?;
        }
        if let Some(forces) = self.forces {
            let wanted = 3 * count;
            if forces.len() != wanted {
                return Err(Error::Argument(format!(
                    "forces has {} numbers, must have three a node of the intact mesh, {wanted}",
                    forces.len()
                )));
            }
            for (at, &value) in forces.iter().enumerate() {
                check_size(value, LARGEST_FORCE, "mN", || {
                    format!("forces: node {}", at / 3)
                })?;
            }
        }
        point_force::check(self.point_forces, count)?;
        if self.pressures.len() > MAX_PRESSURES {
            return Err(Error::Argument(format!(
                "pressures has {} entries, must have at most {MAX_PRESSURES}",
                self.pressures.len()
            )));
        }
        for (index, pressure) in self.pressures.iter().enumerate() {
            check_size(pressure.pascal, LARGEST_PRESSURE, "Pa", || {
                format!("pressures[{index}].pascal")
            })?;
            if let Some(node) = pressure.nodes.iter().find(|node| **node as usize >= count) {
                return Err(Error::Argument(format!(
                    "pressures[{index}]: node {node} is beyond the mesh's {count} nodes"
                )));
            }
        }
        Ok(())
    }
}

/// The loads of a state.
#[derive(Debug, Default, HeldBytes, Serialize, Deserialize)]
pub struct Acting {
    /// Forces that do not follow the body `[K,3]`, µN.
    #[serde(with = "stored")]
    pub(super) dead: Vec<f32>,
    /// Gravity among them, mm/s².
    pub(super) gravity: [f32; 3],
    /// Pressure by boundary triangle of the intact mesh `[F]`, and behind it that on walls, Pa.
    #[serde(with = "stored")]
    pub(super) pascal: Vec<f32>,
    /// What a blade has done to the tissue since `[K,3]`, µN: the next step ends with it. Empty for nothing.
    #[serde(with = "stored")]
    pub(super) pushed: Vec<f32>,
    /// Whether any of it is not zero.
    pub(super) acts: bool,
    /// The support, where the host gives one.
    pub(super) carried: Option<Carried>,
    /// The support groups; empty where all are as they were meshed.
    pub(super) supports: Vec<GroupState>,
}

impl Acting {
    /// Nothing acts; one entry more than faces, for the whole domain's pressure.
    pub(super) fn zeros(mesh: &Mesh) -> Result<Acting> {
        Ok(Acting {
            dead: memory::zeros(mesh.positions.len(), WHAT)?,
            gravity: [0.0; 3],
            pascal: memory::zeros(mesh.surface.faces.len() / 3 + 1, WHAT)?,
            pushed: Vec::new(),
            acts: false,
            carried: None,
            supports: Vec::new(),
        })
    }

    /// Nothing acts any more; the room stays.
    pub(super) fn clear(&mut self) {
        self.dead.fill(0.0);
        self.gravity = [0.0; 3];
        self.pascal.fill(0.0);
        self.pushed.clear();
        self.acts = false;
        self.carried = None;
        self.supports.clear();
    }

    /// A copy, where anything acts.
    pub(super) fn copy(&self) -> Result<Option<Acting>> {
        let is_at_rest = self.carried.is_none() && self.supports.is_empty();
        if !self.acts && is_at_rest && self.pushed.is_empty() {
            return Ok(None);
        }
        let mut groups = Vec::new();
        supports::copy(&self.supports, &mut groups)?;
        Ok(Some(Acting {
            dead: memory::copied(&self.dead, WHAT)?,
            gravity: self.gravity,
            pascal: memory::copied(&self.pascal, WHAT)?,
            pushed: memory::copied(&self.pushed, WHAT)?,
            acts: self.acts,
            carried: self.carried,
            supports: groups,
        }))
    }

    /// Checks what was read.
    pub(super) fn admit(&self, mesh: &Mesh) -> Result<()> {
        stored::check(&self.dead, mesh.positions.len())?;
        stored::check(&self.gravity, 3)?;
        if !self.pushed.is_empty() {
            stored::check(&self.pushed, mesh.positions.len())?;
        }
        if self.carried.is_some_and(|carried| !carried.is_sound()) {
            return Err(Error::Snapshot("the support's motion is damaged".into()));
        }
        supports::admit(&self.supports, &mesh.supports)?;
        stored::check(&self.pascal, mesh.surface.faces.len() / 3 + 1)
    }
}
