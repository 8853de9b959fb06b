//! Loads beside contact: gravity, forces on the nodes, and pressure on faces of the surface.
//!
//! Gravity pulls on the mass of the body itself, never on what mass scaling adds. Pressure follows the surface: a face of now with
//! the area vector `A n` takes `-p A n`, a third at each corner. Loads change on a line over a frame. Forces are µN inside.

use super::fields::Node;
use super::support::Support;
use elements::vector::{cross, subtract};
use topology::Push;

/// Loads at the end of a frame. By default there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loads {
    /// Gravity beyond that under which the mesh is in equilibrium, mm/s².
    pub gravity: [f64; 3],
    /// On the nodes of the mesh `[K,3]`, mN; empty for none. In a body that has been cut the tissue at a node's place takes its force
    /// ([`topology::Body::carriers`]).
    pub forces: Vec<[f32; 3]>,
    /// At points of the tissue, given by nodes of the body as it is now, mN.
    pub points: Vec<Push>,
    /// A face in several of them takes their sum.
    pub pressures: Vec<SurfacePressure>,
}

/// Pressure on a region of the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfacePressure {
    /// Rows of the mesh's `surface`; of a body that has been cut, what is left of them.
    pub faces: Vec<u32>,
    /// Whether it acts on what cuts and removal lay bare, too.
    pub walls: bool,
    /// From outside on the body, Pa; negative for suction.
    pub pascal: f64,
}

/// A point that lies at weights on nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub rest: [f64; 3],
    /// Slots and weights, whose sum is 1; those that are not needed weigh nothing.
    pub parts: [(u32, f64); 4],
}

/// A triangle under pressure.
#[derive(Clone, Debug)]
pub(super) struct Face {
    pub corners: [Corner; 3],
    /// At the start and the end of the frame, Pa.
    pub pascal: [f64; 2],
}

/// The loads of a solver, from the first time that it has any.
#[derive(Clone, Debug, Default)]
pub(super) struct BodyLoad {
    /// Forces that do not follow the body, by slot, at the start of the frame and at its end.
    pub dead: [Vec<Node>; 2],
    pub faces: Vec<Face>,
    /// The loads at its start and its end, as they were set.
    pub set: [Loads; 2],
    /// What a blade does to the tissue at its start and its end.
    pub pushed: [Vec<Push>; 2],
    /// Inner steps of the frame.
    pub steps: u32,
    /// The support, where it moves.
    pub support: Option<Support>,
    /// Forces of an inner step, by slot.
    pub now: Vec<Node>,
}

impl BodyLoad {
    /// None yet, for a body of so many slots.
    pub fn with_slots(slots: usize) -> Self {
        BodyLoad {
            dead: [vec![Node::default(); slots], vec![Node::default(); slots]],
            now: vec![Node::default(); slots],
            ..BodyLoad::default()
        }
    }

    /// Starts a frame of `steps` inner steps.
    pub fn begin(&mut self, steps: u32) {
        self.steps = steps;
    }

    /// Computes `now` at inner step `step` of the frame, and moves the support there.
    ///
    /// # Safety
    /// `displacement` holds every slot, and nobody else looks there.
    pub unsafe fn evaluate(&mut self, displacement: *mut Node, step: u32) {
        let part = f64::from(step) / f64::from(self.steps);
        let (from, to) = (&self.dead[0], &self.dead[1]);
        for ((now, from), to) in self.now.iter_mut().zip(from).zip(to) {
            let part = part as f32;
            *now = Node(std::array::from_fn(|k| {
                from.0[k] + part * (to.0[k] - from.0[k])
            }));
        }
        if let Some(support) = &self.support {
            // SAFETY: the caller's.
            unsafe { support.move_to(displacement, (step, self.steps), &mut self.now) };
        }
        for face in &self.faces {
            let [a, b, c] = [0, 1, 2].map(|k: usize| {
                let Corner { mut rest, parts } = face.corners[k];
                for (slot, weight) in parts.into_iter().filter(|part| part.1 > 0.0) {
                    // SAFETY: the caller's.
                    let moved = unsafe { (*displacement.add(slot as usize)).0 };
                    let at = rest.iter_mut().zip(moved);
                    at.for_each(|(at, moved)| *at += weight * f64::from(moved));
                }
                rest
            });
            let twice = cross(subtract(b, a), subtract(c, a));
            let pascal = face.pascal[0] + part * (face.pascal[1] - face.pascal[0]);
            let parts = face.corners.iter().flat_map(|corner| corner.parts);
            for (slot, weight) in parts.filter(|part| part.1 > 0.0) {
                let force = &mut self.now[slot as usize].0;
                for (force, twice) in force.iter_mut().zip(twice) {
                    *force -= (weight * pascal * twice / 6.0) as f32;
                }
            }
        }
    }

    /// The end of the frame becomes the start of the next; says whether a blade pushed that does so no more.
    pub fn arrive(&mut self) -> bool {
        let [from, to] = &mut self.dead;
        from.copy_from_slice(to);
        for face in &mut self.faces {
            face.pascal[0] = face.pascal[1];
        }
        let [before, now] = &mut self.set;
        before.clone_from(now);
        if let Some(support) = &mut self.support {
            support.arrive();
        }
        self.pushed.swap(0, 1);
        self.pushed[1].clear();
        !self.pushed[0].is_empty()
    }
}

/// Adds the loads of an inner step to the forces of `own` slots.
///
/// # Safety
/// The slots are this worker's.
pub(super) unsafe fn add(now: *const Node, force: *mut Node, own: std::ops::Range<usize>) {
    for slot in own {
        // SAFETY: the caller's.
        unsafe {
            let (load, force) = (&*now.add(slot), &mut *force.add(slot));
            for k in 0..3 {
                force.0[k] += load.0[k];
            }
        }
    }
}

/// Work of the loads over half of the increments of now, nJ: central differences take the mean of two.
///
/// # Safety
/// The slots are this worker's.
pub(super) unsafe fn half_work(
    now: *const Node,
    increment: *const Node,
    own: std::ops::Range<usize>,
) -> f64 {
    let mut work = 0.0;
    for slot in own {
        // SAFETY: the caller's.
        let (load, moved) = unsafe { ((*now.add(slot)).0, (*increment.add(slot)).0) };
        for k in 0..3 {
            work += 0.5 * f64::from(load[k]) * f64::from(moved[k]);
        }
    }
    work
}
