//! Loads beside contact: gravity, forces on the nodes, and pressure on faces of the surface.
//!
//! Gravity pulls on the mass of the body itself, never on what mass scaling adds. Pressure follows the surface: a face of now with
//! the area vector `A n` takes `-p A n`, a third at each corner. Loads change on a line over a frame. Forces are µN inside.

use super::fields::Node;
use super::support::Support;
use elements::vector::{cross, subtract};

/// Loads at the end of a frame. By default there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loads {
    /// Gravity beyond that under which the mesh is in equilibrium, mm/s².
    pub gravity: [f64; 3],
    /// On the nodes `[K,3]`, mN; empty for none.
    pub forces: Vec<[f32; 3]>,
    /// A face in several of them takes their sum.
    pub pressures: Vec<SurfacePressure>,
}

/// Pressure on a region of the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfacePressure {
    /// Rows of the mesh's `surface`.
    pub faces: Vec<u32>,
    /// From outside on the body, Pa; negative for suction.
    pub pascal: f64,
}

/// A face under pressure.
#[derive(Clone, Debug)]
pub(super) struct Face {
    pub slots: [u32; 3],
    pub rest: [[f32; 3]; 3],
    /// At the start and the end of the frame, Pa.
    pub pascal: [f64; 2],
}

/// The loads of a solver, from the first time that it has any.
#[derive(Clone, Debug, Default)]
pub(super) struct BodyLoad {
    /// Forces that do not follow the body, by slot, at the start of the frame and at its end.
    pub dead: [Vec<Node>; 2],
    pub faces: Vec<Face>,
    /// By row of the surface, Pa, at the end of the frame.
    pub pascal: Vec<f64>,
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
            let corner = |k: usize| {
                // SAFETY: the caller's.
                let moved = unsafe { (*displacement.add(face.slots[k] as usize)).0 };
                std::array::from_fn(|axis| f64::from(face.rest[k][axis]) + f64::from(moved[axis]))
            };
            let [a, b, c]: [[f64; 3]; 3] = [corner(0), corner(1), corner(2)];
            let twice = cross(subtract(b, a), subtract(c, a));
            let pascal = face.pascal[0] + part * (face.pascal[1] - face.pascal[0]);
            for slot in face.slots {
                let force = &mut self.now[slot as usize].0;
                for (force, twice) in force.iter_mut().zip(twice) {
                    *force -= (pascal * twice / 6.0) as f32;
                }
            }
        }
    }

    /// The end of the frame becomes the start of the next.
    pub fn arrive(&mut self) {
        let [from, to] = &mut self.dead;
        from.copy_from_slice(to);
        for face in &mut self.faces {
            face.pascal[0] = face.pascal[1];
        }
        if let Some(support) = &mut self.support {
            support.arrive();
        }
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
