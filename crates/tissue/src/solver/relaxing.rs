//! Tissue that relaxes: what its elements remember of their stresses, and the forces of that.
//!
//! The kernels have the instantaneous law, `g0 = 1` ([`elements::StressHistory`]); what has been lost of it is added. It changes in the tissue's time, not
//! in that of pressure waves: it is taken anew every half millisecond, with the weights of the middle of that time.

use super::SolverError;
use super::fields::Node;
use elements::{Chunk, HistoryStep, Kernels, Partition, StressHistory};

/// Time between two updates, s.
const EVERY_S: f64 = 5e-4;

/// See the module.
#[derive(Clone)]
pub(super) struct Relaxing {
    history: StressHistory,
    /// By slot, µN.
    force: Vec<Node>,
    /// Seconds since the last update.
    since_s: f64,
}

/// What threads share of it in a march: each its own chunks.
#[derive(Clone, Copy)]
pub(super) struct View {
    history: [*mut f32; 3],
    force: *mut Node,
    every: u32,
    dt: f64,
    since_s: f64,
}

impl Relaxing {
    /// That of a body at rest; none where its material is elastic.
    pub fn new(partition: &Partition) -> Result<Option<Self>, SolverError> {
        if !partition.relaxes() {
            return Ok(None);
        }
        Ok(Some(Self {
            history: StressHistory::new(partition)?,
            force: vec![Node::default(); partition.node_of_slot.len()],
            since_s: 0.0,
        }))
    }

    /// Back to rest.
    pub fn clear(&mut self) {
        self.history.clear();
        self.force.fill(Node::default());
        self.since_s = 0.0;
    }

    /// For steps of `dt` seconds.
    pub fn view(&mut self, dt: f64) -> View {
        View {
            history: self.history.pointers(),
            force: self.force.as_mut_ptr(),
            every: every(dt),
            dt,
            since_s: self.since_s,
        }
    }

    /// So many steps of `dt` seconds have been made.
    pub fn passed(&mut self, steps: u32, dt: f64) {
        let updates = steps.saturating_sub(1) / every(dt);
        self.since_s = f64::from(steps - updates * every(dt)) * dt;
    }

    /// Takes over what the elements of another packing of the body remember; `sources` are the numbers there of what each stems from.
    pub fn follow(
        &mut self,
        partition: &Partition,
        (other, from): (&Partition, &Self),
        sources: &[u32],
    ) -> Result<(), SolverError> {
        (self.history).take(partition, (other, &from.history), sources)?;
        self.since_s = from.since_s;
        Ok(())
    }
}

/// Inner steps of `dt` seconds to an update.
fn every(dt: f64) -> u32 {
    ((EVERY_S / dt).round() as u32).max(1)
}

impl View {
    /// Whether an inner step, from 1, begins with an update.
    pub fn is_due(&self, step: u32) -> bool {
        (step - 1).is_multiple_of(self.every)
    }

    /// Takes the displacements of a chunk's slots into what its elements remember.
    ///
    /// # Safety
    /// The chunk is this thread's.
    pub unsafe fn update(
        &self,
        (partition, kernels): (&Partition, &Kernels),
        chunk: &Chunk,
        displacements: &[Node],
        step: u32,
    ) {
        let held = f64::from(self.every) * self.dt;
        let since = if step == 1 { self.since_s } else { held };
        let part = partition.stress_step(
            chunk.law,
            &HistoryStep {
                since_s: since,
                times_s: [0.5 * held, 0.0],
                g0: 1.0,
            },
        );
        // SAFETY: the caller's.
        unsafe {
            let force = self.force.add(chunk.first);
            std::ptr::write_bytes(force, 0, chunk.slot_count());
            if part.is_idle() {
                return;
            }
            (kernels.relax)(
                partition,
                chunk,
                &part,
                self.history,
                displacements.as_ptr().cast(),
                [force.cast(), std::ptr::null_mut()],
            );
        }
    }

    /// Adds what the chunk's copies elsewhere were pushed with to its own nodes.
    ///
    /// # Safety
    /// All chunks have been updated, and this one is this thread's.
    pub unsafe fn collect(&self, chunk: &Chunk) {
        for (own, ghost) in &chunk.contributions {
            // SAFETY: the caller's.
            unsafe {
                let source = *self.force.add(*ghost as usize);
                let target = &mut *self.force.add(*own as usize);
                for k in 0..3 {
                    target.0[k] += source.0[k];
                }
            }
        }
    }

    /// Adds the forces of a chunk's own nodes.
    ///
    /// # Safety
    /// They have been collected, and the chunk is this thread's.
    pub unsafe fn add(&self, chunk: &Chunk, forces: *mut Node) {
        for slot in chunk.first..chunk.first + chunk.owned {
            // SAFETY: the caller's.
            unsafe {
                let source = *self.force.add(slot);
                let target = &mut *forces.add(slot);
                for k in 0..3 {
                    target.0[k] += source.0[k];
                }
            }
        }
    }
}
