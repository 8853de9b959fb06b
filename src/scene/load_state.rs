//! What a scene has for loads: those of the last published state, and of the one being made.
//!
//! The body bears the sum of dead loads (forces that keep their direction: gravity, forces on
//! nodes, inertia of a support that moves) and of pressure, which follows the surface. In the step
//! both go on a line from the last state's to the new one's, so each is kept twice. At node `i` of
//! mass `m_i` the dead load is
//!
//! `f_i = m_i (g + a_i) + F_i + P_i`
//!
//! with gravity `g`, the acceleration `a_i` that the support's motion adds, the host's force `F_i`
//! and what a blade has pushed, `P_i`. Masses are g, accelerations mm/s², so loads are µN; a host's
//! forces come as mN.

use topology::{Body, Push};

use super::load_limits::WHAT;
use super::loads::{Acting, Loads};
use super::node_forces::NodeForces;
use super::pressed::Pressed;
use super::support::{Carriage, Carried};
use super::supports::{self, Moved};
use crate::bundle::Mesh;
use crate::corrections::{Held, Load};
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};

/// What a scene has for loads, made at the first step that has any.
#[derive(HeldBytes)]
pub struct LoadState {
    /// Of the last published state, and of the one being made.
    pub(super) last: Acting,
    pub(super) next: Acting,
    pressure: Pressure,
    forces: NodeForces,
    /// Mean of the nodes at rest.
    middle: [f32; 3],
    /// What holds the body in the step being made; none where that is what the bundle holds, at rest.
    pub(super) held: Option<Box<Held>>,
    moved: Moved,
}

/// Where pressure acts.
#[derive(HeldBytes)]
struct Pressure {
    /// What it may act on.
    pressed: Pressed,
    /// Triangles under pressure in the last published state or the one being made, and the pressure there in each.
    faces: Vec<[u32; 3]>,
    pascal: [Vec<f32>; 2],
    /// Nodes of a region, and boundary triangles of the domain.
    marked: Vec<bool>,
    is_domain: Vec<bool>,
}

impl LoadState {
    /// For a mesh as a body that was made of it is now; `domain_faces` are those of the intact mesh.
    pub(super) fn new(mesh: &Mesh, body: Option<&Body>, domain_faces: &[u32]) -> Result<LoadState> {
        let faces = mesh.surface.faces.len() / 3;
        let mut domain = memory::copied(domain_faces, WHAT)?;
        let domain = domain.as_chunks_mut::<3>().0;
        domain.sort_unstable();
        let rows = mesh.surface.faces.as_chunks::<3>().0.iter();
        let is_domain = rows.map(|face| domain.binary_search(face).is_ok());
        let pressed = Pressed::new(mesh, body)?;
        let most = pressed.triangles.len();
        let numbers = || memory::room(most, WHAT);
        let forces = NodeForces::new(mesh, body)?;
        let count = forces.count();
        let nodes = &mesh.positions.as_chunks::<3>().0[..count];
        let middle = [0, 1, 2].map(|axis| {
            let sum: f64 = nodes.iter().map(|node| f64::from(node[axis])).sum();
            (sum / nodes.len().max(1) as f64) as f32
        });
        Ok(LoadState {
            forces,
            middle,
            held: None,
            moved: Moved::default(),
            last: Acting::zeros(mesh)?,
            next: Acting::zeros(mesh)?,
            pressure: Pressure {
                faces: memory::room(most, WHAT)?,
                pascal: [numbers()?, numbers()?],
                pressed,
                marked: memory::filled(count, false, WHAT)?,
                is_domain: memory::collected(faces, is_domain, WHAT)?,
            },
        })
    }

    /// Takes what acted on the body before it changed: a node has the part of its mass in what its source bore; `mass` are those of before and now.
    pub(super) fn follow(
        &mut self,
        before: &Acting,
        mass: [&[f32]; 2],
        source: impl Fn(usize) -> usize,
    ) -> Result<()> {
        let own = &mut self.last;
        let spread = |from: &[f32], to: &mut [f32]| {
            for (node, to) in to.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                let at = source(node);
                let part = mass[1][node] / mass[0][at].max(f32::MIN_POSITIVE);
                *to = [0, 1, 2].map(|axis| part * from[3 * at + axis]);
            }
        };
        spread(&before.dead, &mut own.dead);
        if !before.pushed.is_empty() {
            own.pushed = memory::zeros(own.dead.len(), WHAT)?;
            spread(&before.pushed, &mut own.pushed);
        }
        own.pascal.copy_from_slice(&before.pascal);
        own.gravity = before.gravity;
        own.acts = before.acts;
        own.carried = before.carried;
        Ok(())
    }

    /// Takes what a blade has done to the tissue since the last step.
    /// They are added to what stands there: several cuts may come between two steps. mN become µN.
    pub(super) fn push(&mut self, pushes: &[Push]) -> Result<()> {
        let pushed = &mut self.last.pushed;
        if pushed.is_empty() {
            *pushed = memory::zeros(self.last.dead.len(), WHAT)?;
        }
        for push in pushes {
            for (node, weight) in push.nodes.into_iter().zip(push.weights) {
                let own = &mut pushed[3 * node as usize..][..3];
                for (own, force) in own.iter_mut().zip(push.force) {
                    *own += (1e3 * weight * force) as f32;
                }
            }
        }
        Ok(())
    }

    /// Takes the loads at the end of a step of `step_s` of a body of these masses, g, which is displaced by `u [K,3]` and moves at `v` (mm/s) at its start; `cut` is what cuts have made of it.
    pub(super) fn take(
        &mut self,
        loads: &Loads<'_>,
        mesh: &Mesh,
        mass: &[f32],
        (u, v, step_s): (&[f32], &[f32], f64),
        cut: Option<&Body>,
    ) -> Result<()> {
        self.forces.take(loads.point_forces, cut)?;
        let forces = &self.forces;
        supports::follow(
            mesh,
            loads.supports,
            (&self.last.supports, u),
            (&mut self.next.supports, &mut self.held, &mut self.moved),
        )?;
        let next = &mut self.next;
        let pose = loads.support.map(|support| support.checked()).transpose()?;
        let carried = pose.map(|pose| Carried::follow(self.last.carried.as_ref(), &pose, step_s));
        next.carried = carried.map(|(carried, _)| carried);
        let carriage = carried.map(|(_, carriage)| carriage);
        // Gravity in the body's frame, which turns with the support, m/s².
        let acceleration = loads.acceleration(carriage.as_ref());
        // A blade's push is part of the loads at the end of one step: it acts there once.
        next.pushed.clear();
        let pushed = &self.last.pushed;
        next.acts = loads.acts_with(acceleration)
            || carriage.is_some_and(|own| own.acts())
            || supports::acts(&next.supports)
            || !pushed.is_empty();
        let acceleration = acceleration.map(|a| 1e3 * a);
        // The modes' guess answers to an even acceleration; of what a moving support adds it takes that of the body's middle.
        next.gravity = acceleration;
        let carriage = carriage.filter(Carriage::acts);
        let carriage = carriage.map(|carriage| carriage.borne());
        if let Some(carriage) = &carriage {
            let origin = carriage.at(self.middle, [0.0; 3]);
            (next.gravity.iter_mut().zip(origin)).for_each(|(g, own)| *g += own);
        }
        let rest = mesh.positions.as_chunks::<3>().0;
        for ((node, dead), mass) in
            (next.dead.as_chunks_mut::<3>().0.iter_mut().enumerate()).zip(mass)
        {
            let at = |field: &[f32], axis| field.get(3 * node + axis).copied().unwrap_or(0.0);
            let borne = carriage.map_or([0.0; 3], |carriage| {
                let x = [0, 1, 2].map(|axis| rest[node][axis] + at(u, axis));
                carriage.at(x, [0, 1, 2].map(|axis| at(v, axis)))
            });
            // A host gives forces by the intact mesh's nodes, mN; here they are µN, as the residual is.
            let own = forces.on(node, loads.forces);
            for axis in 0..3 {
                let push = pushed.get(3 * node + axis).copied().unwrap_or(0.0);
                dead[axis] = mass * (acceleration[axis] + borne[axis]) + 1e3 * own[axis] + push;
            }
        }
        // Pressures add up where regions overlap; the last entry is that of the whole domain, for faces that cuts lay open.
        next.pascal.fill(0.0);
        let faces = mesh.surface.faces.as_chunks::<3>().0;
        for (index, pressure) in loads.pressures.iter().enumerate() {
            self.pressure.marked.fill(false);
            let (nodes, marked) = (pressure.nodes, &mut self.pressure.marked);
            nodes
                .iter()
                .for_each(|node| marked[forces.parent(*node as usize)] = true);
            let mut is_on_none = true;
            for (row, (face, pascal)) in faces.iter().zip(&mut next.pascal).enumerate() {
                let is_in = match nodes.is_empty() {
                    true => self.pressure.is_domain[row],
                    false => face.iter().all(|node| marked[*node as usize]),
                };
                if is_in {
                    *pascal += pressure.pascal;
                    is_on_none = false;
                }
            }
            if nodes.is_empty() {
                next.pascal[faces.len()] += pressure.pascal;
            }
            // Given but of no effect: a host that passes nodes inside of the body, or corners of
            // different faces, would see no pressure and not know why.
            if is_on_none {
                return Err(Error::Argument(format!(
                    "pressures[{index}]: no boundary triangle has all three corners among its {} nodes; pass the nodes of whole faces",
                    pressure.nodes.len()
                )));
            }
        }
        // Faces under pressure at either end of the step: pressure changes linearly over it.
        self.pressure.faces.clear();
        self.pressure.pascal.iter_mut().for_each(Vec::clear);
        for (row, corners) in &self.pressure.pressed.triangles {
            let both = [&self.last, &*next].map(|acting| acting.pascal[*row as usize]);
            if both != [0.0; 2] {
                self.pressure.faces.push(*corners);
                for (list, pascal) in self.pressure.pascal.iter_mut().zip(both) {
                    list.push(pascal);
                }
            }
        }
        Ok(())
    }

    /// Support groups that are let go in the step that was made last, a bit each.
    pub(super) fn let_go(&self) -> u64 {
        self.held.as_ref().map_or(0, |held| held.let_go)
    }

    /// Whether any acts in the last published state or the one being made.
    pub(super) fn acts(&self) -> bool {
        self.last.acts || self.next.acts
    }

    /// Whether gravity turns in the step being made.
    ///
    /// Gravity that stays as it is needs no answer of its own: the state that the step starts from
    /// hangs under it already.
    pub(super) fn turns(&self) -> bool {
        self.last.gravity != self.next.gravity
    }

    /// What the step being made has of them.
    pub(super) fn load(&self) -> Option<Load<'_>> {
        self.acts().then(|| Load {
            dead: [&self.last.dead, &self.next.dead],
            gravity: [self.last.gravity, self.next.gravity],
            faces: &self.pressure.faces,
            points: &self.pressure.pressed.points,
            pascal: [&self.pressure.pascal[0], &self.pressure.pascal[1]],
            way: [0.0, 1.0],
        })
    }

    /// The state being made becomes the last.
    /// What is left in `next` is of the step before; the next `take` writes all of it.
    pub(super) fn commit(&mut self) {
        std::mem::swap(&mut self.last, &mut self.next);
    }
}
