//! What acts on the body beside contact: gravity that turns, forces on nodes, pressure on the surface. A scene without loads keeps nothing of them.

use serde::{Deserialize, Serialize};

use super::support::{Carriage, Carried, SupportPose};
use crate::bundle::Mesh;
use crate::corrections::Load;
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::stored;

/// Pressures of a step at most.
pub const MAX_PRESSURES: usize = 32;
/// The largest gravity, in each direction, m/s².
pub const LARGEST_GRAVITY: f32 = 1e3;
/// The largest force on a node, in each direction, mN.
pub const LARGEST_FORCE: f32 = 1e6;
/// The largest pressure, Pa: ten times that of the air.
pub const LARGEST_PRESSURE: f32 = 1e6;

pub(super) const WHAT: &str = "the loads of a scene";

/// Loads at the end of a step; within the step they change on a line from those of the last. By default there are none. They act in scenes
/// that correct (`corrections`).
#[derive(Debug, Clone, Copy, Default)]
pub struct Loads<'a> {
    /// Gravity in the mesh's frame, m/s²; with a support in the world's.
    pub gravity: [f32; 3],
    /// Gravity under which the mesh was scanned, m/s²: what acts is the difference.
    pub gravity_at_rest: [f32; 3],
    /// Forces on the nodes `[K,3]`, mN.
    pub forces: Option<&'a [f32]>,
    /// At most [`MAX_PRESSURES`]; a face in several of them takes their sum.
    pub pressures: &'a [Pressure<'a>],
    /// Where what holds the body is at the end of the step, where it moves. All else stays in the mesh's frame, which goes with the support: displacements,
    /// tools, forces. The body feels the motion as inertia. Pass it in every step; one that goes farther than 40 mm or half a radian in a step is put there.
    pub support: Option<SupportPose>,
}

/// A pressure on a part of the surface.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pressure<'a> {
    /// The boundary triangles with all three corners among these nodes; empty: the domain.
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
        pressures: &[],
        support: None,
    };

    /// Whether they are not all zero, or a support is given.
    pub(crate) fn acts(&self) -> bool {
        self.acts_with(self.acceleration(None)) || self.support.is_some()
    }

    fn acts_with(&self, acceleration: [f32; 3]) -> bool {
        acceleration != [0.0; 3]
            || self.forces.is_some()
            || self.pressures.iter().any(|pressure| pressure.pascal != 0.0)
    }

    /// What acts of gravity, m/s².
    fn acceleration(&self, carriage: Option<&Carriage>) -> [f32; 3] {
        let gravity = carriage.map_or(self.gravity, |own| own.in_frame(self.gravity));
        std::array::from_fn(|axis| gravity[axis] - self.gravity_at_rest[axis])
    }

    /// # Errors
    /// [`Error::NonFinite`] and [`Error::Argument`], with the field.
    pub(crate) fn check(&self, mesh: &Mesh) -> Result<()> {
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
            if forces.len() != mesh.positions.len() {
                return Err(Error::Argument(format!(
                    "forces has {} numbers, must have three a node, {}",
                    forces.len(),
                    mesh.positions.len()
                )));
            }
            for (at, &value) in forces.iter().enumerate() {
                check_size(value, LARGEST_FORCE, "mN", || {
                    format!("forces: node {}", at / 3)
                })?;
            }
        }
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
            let count = mesh.node_count();
            if let Some(node) = pressure.nodes.iter().find(|node| **node as usize >= count) {
                return Err(Error::Argument(format!(
                    "pressures[{index}]: node {node} is beyond the mesh's {count} nodes"
                )));
            }
        }
        Ok(())
    }
}

fn check_size(value: f32, most: f32, unit: &str, name: impl Fn() -> String) -> Result<()> {
    if !value.is_finite() {
        return Err(Error::NonFinite(format!("{} is {value}", name())));
    }
    if value.abs() > most {
        return Err(Error::Argument(format!(
            "{} is {value} {unit}, must be at most {most}",
            name()
        )));
    }
    Ok(())
}

/// The loads of a state.
#[derive(Debug, Default, HeldBytes, Serialize, Deserialize)]
pub struct Acting {
    /// Forces that do not follow the body `[K,3]`, µN.
    #[serde(with = "stored")]
    dead: Vec<f32>,
    /// Gravity among them, mm/s².
    gravity: [f32; 3],
    /// Pressure by boundary triangle `[F]`, Pa.
    #[serde(with = "stored")]
    pascal: Vec<f32>,
    /// Whether any of it is not zero.
    acts: bool,
    /// The support, where the host gives one.
    pub(super) carried: Option<Carried>,
}

impl Acting {
    fn zeros(mesh: &Mesh) -> Result<Acting> {
        Ok(Acting {
            dead: memory::zeros(mesh.positions.len(), WHAT)?,
            gravity: [0.0; 3],
            pascal: memory::zeros(mesh.surface_faces.len() / 3, WHAT)?,
            acts: false,
            carried: None,
        })
    }

    pub(super) fn clear(&mut self) {
        self.dead.fill(0.0);
        self.gravity = [0.0; 3];
        self.pascal.fill(0.0);
        self.acts = false;
        self.carried = None;
    }

    /// A copy, where anything acts.
    pub(super) fn copy(&self) -> Result<Option<Acting>> {
        if !self.acts && self.carried.is_none() {
            return Ok(None);
        }
        Ok(Some(Acting {
            dead: memory::copied(&self.dead, WHAT)?,
            gravity: self.gravity,
            pascal: memory::copied(&self.pascal, WHAT)?,
            acts: self.acts,
            carried: self.carried,
        }))
    }

    /// Checks what was read.
    pub(super) fn admit(&self, mesh: &Mesh) -> Result<()> {
        stored::check(&self.dead, mesh.positions.len())?;
        stored::check(&self.gravity, 3)?;
        if self.carried.is_some_and(|carried| !carried.is_sound()) {
            return Err(Error::Snapshot("the support's motion is damaged".into()));
        }
        stored::check(&self.pascal, mesh.surface_faces.len() / 3)
    }
}

/// What a scene has for loads, made at the first step that has any.
#[derive(HeldBytes)]
pub struct LoadState {
    /// Of the last published state, and of the one being made.
    pub(super) last: Acting,
    pub(super) next: Acting,
    /// Faces under pressure in either, and the pressure there.
    faces: Vec<[u32; 3]>,
    pascal: [Vec<f32>; 2],
    /// Nodes of a region, and boundary triangles of the domain.
    marked: Vec<bool>,
    is_domain: Vec<bool>,
    /// Mean of the nodes at rest.
    middle: [f32; 3],
}

impl LoadState {
    pub(super) fn new(mesh: &Mesh) -> Result<LoadState> {
        let faces = mesh.surface_faces.len() / 3;
        let mut domain = memory::copied(&mesh.domain_faces, WHAT)?;
        let domain = domain.as_chunks_mut::<3>().0;
        domain.sort_unstable();
        let rows = mesh.surface_faces.as_chunks::<3>().0.iter();
        let is_domain = rows.map(|face| domain.binary_search(face).is_ok());
        let numbers = || memory::room(faces, WHAT);
        let nodes = mesh.positions.as_chunks::<3>().0;
        let middle = [0, 1, 2].map(|axis| {
            let sum: f64 = nodes.iter().map(|node| f64::from(node[axis])).sum();
            (sum / nodes.len().max(1) as f64) as f32
        });
        Ok(LoadState {
            middle,
            last: Acting::zeros(mesh)?,
            next: Acting::zeros(mesh)?,
            faces: memory::room(faces, WHAT)?,
            pascal: [numbers()?, numbers()?],
            marked: memory::filled(mesh.node_count(), false, WHAT)?,
            is_domain: memory::collected(faces, is_domain, WHAT)?,
        })
    }

    /// Takes the loads at the end of a step of `step_s` of a body of these masses, g, which is displaced by `u [K,3]` and moves at `v` (mm/s) at its start.
    pub(super) fn take(
        &mut self,
        loads: &Loads<'_>,
        mesh: &Mesh,
        mass: &[f32],
        (u, v, step_s): (&[f32], &[f32], f64),
    ) -> Result<()> {
        let next = &mut self.next;
        let pose = loads.support.map(|support| support.checked()).transpose()?;
        let carried = pose.map(|pose| Carried::follow(self.last.carried.as_ref(), &pose, step_s));
        next.carried = carried.map(|(carried, _)| carried);
        let carriage = carried.map(|(_, carriage)| carriage);
        let acceleration = loads.acceleration(carriage.as_ref());
        next.acts = loads.acts_with(acceleration) || carriage.is_some_and(|own| own.acts());
        let acceleration = acceleration.map(|a| 1e3 * a);
        next.gravity = acceleration;
        let carriage = carriage.filter(Carriage::acts);
        if let Some(carriage) = &carriage {
            let origin = carriage.borne(self.middle, [0.0; 3]);
            (next.gravity.iter_mut().zip(origin)).for_each(|(g, own)| *g += own);
        }
        let rest = mesh.positions.as_chunks::<3>().0;
        for ((node, dead), mass) in
            (next.dead.as_chunks_mut::<3>().0.iter_mut().enumerate()).zip(mass)
        {
            let at = |field: &[f32], axis| field.get(3 * node + axis).copied().unwrap_or(0.0);
            let borne = carriage.map_or([0.0; 3], |carriage| {
                let x = [0, 1, 2].map(|axis| rest[node][axis] + at(u, axis));
                carriage.borne(x, [0, 1, 2].map(|axis| at(v, axis)))
            });
            for axis in 0..3 {
                let own = loads.forces.map_or(0.0, |forces| forces[3 * node + axis]);
                dead[axis] = mass * (acceleration[axis] + borne[axis]) + 1e3 * own;
            }
        }
        next.pascal.fill(0.0);
        let faces = mesh.surface_faces.as_chunks::<3>().0;
        for (index, pressure) in loads.pressures.iter().enumerate() {
            self.marked.fill(false);
            let (nodes, marked) = (pressure.nodes, &mut self.marked);
            nodes.iter().for_each(|node| marked[*node as usize] = true);
            let mut is_on_none = true;
            for (row, (face, pascal)) in faces.iter().zip(&mut next.pascal).enumerate() {
                let is_in = match nodes.is_empty() {
                    true => self.is_domain[row],
                    false => face.iter().all(|node| marked[*node as usize]),
                };
                if is_in {
                    *pascal += pressure.pascal;
                    is_on_none = false;
                }
            }
            if is_on_none {
                return Err(Error::Argument(format!(
                    "pressures[{index}]: no boundary triangle has all three corners among its {} nodes; pass the nodes of whole faces",
                    pressure.nodes.len()
                )));
            }
        }
        self.faces.clear();
        self.pascal.iter_mut().for_each(Vec::clear);
        for (row, face) in faces.iter().enumerate() {
            let both = [self.last.pascal[row], next.pascal[row]];
            if both != [0.0; 2] {
                self.faces.push(*face);
                for (list, pascal) in self.pascal.iter_mut().zip(both) {
                    list.push(pascal);
                }
            }
        }
        Ok(())
    }

    /// Whether any acts in the last published state.
    pub(super) fn acted(&self) -> bool {
        self.last.acts
    }

    pub(super) fn acts(&self) -> bool {
        self.last.acts || self.next.acts
    }

    /// What the step being made has of them.
    pub(super) fn load(&self) -> Option<Load<'_>> {
        self.acts().then(|| Load {
            dead: [&self.last.dead, &self.next.dead],
            gravity: [self.last.gravity, self.next.gravity],
            faces: &self.faces,
            pascal: [&self.pascal[0], &self.pascal[1]],
            way: [0.0, 1.0],
        })
    }

    /// The state being made becomes the last.
    pub(super) fn commit(&mut self) {
        std::mem::swap(&mut self.last, &mut self.next);
    }
}

/// A copy of a host's loads, for a step that is submitted.
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
}

impl CopiedLoads {
    /// Takes loads. All lists have room before one changes.
    pub(super) fn take(&mut self, loads: &Loads<'_>) -> Result<()> {
        let forces = loads.forces.unwrap_or_default();
        let nodes = loads.pressures.iter().map(|pressure| pressure.nodes.len());
        memory::fit(&mut self.forces, forces.len(), WHAT)?;
        memory::fit(&mut self.nodes, nodes.sum(), WHAT)?;
        memory::fit(&mut self.pressures, loads.pressures.len(), WHAT)?;
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
        })
    }
}
