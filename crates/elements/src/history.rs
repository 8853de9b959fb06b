//! The stresses that a relaxing body remembers, and what they push with.
//!
//! With the modulus `g0` of the elements' law over its own (`g(h)` of the steps that a body is made for, or 1), the stress at the end of a step of
//! `t` seconds is
//!
//! ```text
//! S = S_vol + g0 S_iso + H        H = sum_i e_i(t) q_i + (g_inf - g0) S_iso,n
//! ```
//!
//! where `H` is known at its start: exact for `g0 = g(t)` and a constant rate, and whatever `g0` where the strain is held. Its forces are
//! taken at the deformation of the start, so that they are a load of the step.
//!
//! REQ-096: Held strain relaxes as the material's Prony series.

use crate::internal_forces::{ElementForces, Line, ParallelFor, Scratch, Shared};
use crate::partition::Partition;
use crate::relaxation::Relaxation;
use crate::room::filled;
use crate::stress_step::{HistoryStep, SIX, StressStep};
use lanes::WIDTH;
use std::collections::TryReserveError;

/// `S_iso` and `q_i` of every element.
#[derive(Clone, Default)]
pub struct StressHistory {
    /// By kind of cluster, batch, tetrahedron, `S_iso` before the `q_i`, component, lane; Pa, over the element's own stiffness.
    values: [Vec<f32>; 3],
    /// Slots of the second row of forces.
    /// Room alone: nothing in it outlives a call.
    second: Vec<Line>,
    /// By number of a law, for the step at hand.
    steps: Vec<StressStep>,
    /// Of the relaxation that has the most.
    branches: usize,
}

impl StressHistory {
    /// That of a body of some relaxing material at rest.
    ///
    /// # Errors
    /// No memory.
    pub fn new(partition: &Partition) -> Result<Self, TryReserveError> {
        let branches = partition.most_branches();
        let numbers = |batches: usize, tets: usize| batches * tets * (branches + 1) * SIX * WIDTH;
        Ok(Self {
            values: [
                filled(numbers(partition.octahedra.batches.len(), 4), 0.0)?,
                filled(numbers(partition.pairs.batches.len(), 2), 0.0)?,
                filled(numbers(partition.singles.batches.len(), 1), 0.0)?,
            ],
            second: Vec::new(),
            steps: Vec::new(),
            branches,
        })
    }

    /// Back to rest.
    pub fn clear(&mut self) {
        self.values.iter_mut().for_each(|values| values.fill(0.0));
    }

    /// Whether nothing is remembered.
    pub fn is_at_rest(&self) -> bool {
        let mut all = self.values.iter().flatten();
        all.all(|value| *value == 0.0)
    }

    /// All numbers, as lists whose order belongs to the body.
    pub fn values(&self) -> &[Vec<f32>; 3] {
        &self.values
    }

    /// The same, to be filled.
    pub fn values_mut(&mut self) -> &mut [Vec<f32>; 3] {
        &mut self.values
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let numbers: usize = self.values.iter().map(Vec::len).sum();
        4 * numbers + size_of_val(self.second.as_slice()) + size_of_val(self.steps.as_slice())
    }

    /// The start of each kind's numbers, for [`crate::Kernels::relax`].
    pub fn pointers(&mut self) -> [*mut f32; 3] {
        self.values.each_mut().map(|values| values.as_mut_ptr())
    }

    /// Takes what the elements of another packing of the body have: `sources` are the numbers there of what each of its own stems from.
    ///
    /// # Errors
    /// No memory.
    pub fn take(
        &mut self,
        own: &Partition,
        (other, from): (&Partition, &StressHistory),
        sources: &[u32],
    ) -> Result<(), TryReserveError> {
        let row = (self.branches + 1) * SIX;
        let most = sources.iter().max();
        let mut all = filled(most.map_or(0, |most| *most as usize + 1) * row, 0.0)?;
        from.each(other, |number, k, value| {
            if let Some(place) = all.get_mut(number as usize * row + k) {
                *place = value;
            }
        });
        let branches = self.branches;
        for (kind, values) in self.values.iter_mut().enumerate() {
            visit(own, kind, branches, |number, k, at| {
                values[at] = all[sources[number as usize] as usize * row + k];
            });
        }
        Ok(())
    }

    /// Calls with the number of the element in the mesh, the place in its row and the value.
    fn each(&self, partition: &Partition, mut call: impl FnMut(u32, usize, f32)) {
        for (kind, values) in self.values.iter().enumerate() {
            visit(partition, kind, self.branches, |number, k, at| {
                call(number, k, values[at]);
            });
        }
    }
}

/// Calls with the mesh number, the number in its row and the place of every number of a kind.
fn visit(
    partition: &Partition,
    kind: usize,
    branches: usize,
    mut call: impl FnMut(u32, usize, usize),
) {
    let row = (branches + 1) * SIX;
    let mut lanes = |first: usize, numbers: &[u32; WIDTH]| {
        for (lane, number) in numbers.iter().enumerate() {
            if *number != crate::batches::PADDING {
                (0..row).for_each(|k| call(*number, k, (first * row + k) * WIDTH + lane));
            }
        }
    };
    let (octahedra, pairs) = (&partition.octahedra.elements, &partition.pairs.elements);
    match kind {
        0 => (octahedra.iter().flatten().enumerate()).for_each(|(at, row)| lanes(at, row)),
        1 => (pairs.iter().flatten().enumerate()).for_each(|(at, row)| lanes(at, row)),
        _ => (partition.singles.elements.iter().flatten().enumerate())
            .for_each(|(at, row)| lanes(at, row)),
    }
}

impl Partition {
    /// The relaxation of a number of a law.
    pub fn relaxation_of(&self, number: u8) -> &Relaxation {
        match usize::from(number).checked_sub(1) {
            None => &self.relaxation,
            Some(at) => &self.relaxations[at],
        }
    }

    /// Branches of the relaxation that has the most.
    pub fn most_branches(&self) -> usize {
        let all = self.relaxations.iter().map(Relaxation::len);
        all.fold(self.relaxation.len(), usize::max)
    }

    /// Whether any element relaxes.
    pub fn relaxes(&self) -> bool {
        self.most_branches() > 0
    }

    /// How the elements of a chunk go on.
    pub fn stress_step(&self, number: u8, step: &HistoryStep) -> StressStep {
        StressStep::new(self.relaxation_of(number), self.most_branches(), step)
    }
}

impl ElementForces {
    /// What the body remembers of its stresses at rest; none where neither its material relaxes nor a region.
    ///
    /// # Errors
    /// No memory.
    pub fn stress_history(&self) -> Result<Option<StressHistory>, TryReserveError> {
        if !self.partition.relaxes() {
            return Ok(None);
        }
        let mut history = StressHistory::new(&self.partition)?;
        let lines = self.partition.node_of_slot.len().div_ceil(4);
        history.second = filled(lines, Line::default())?;
        let laws = 1 + self.partition.relaxations.len();
        history.steps = filled(laws, StressStep::default())?;
        Ok(Some(history))
    }

    /// [`StressHistory::take`] from that of the body before a cut.
    ///
    /// # Errors
    /// No memory.
    pub fn follow_history(
        &self,
        own: &mut StressHistory,
        (other, from): (&ElementForces, &StressHistory),
        sources: &[u32],
    ) -> Result<(), TryReserveError> {
        own.take(&self.partition, (&other.partition, from), sources)
    }

    /// The material's relaxation.
    pub fn relaxation(&self) -> &Relaxation {
        &self.partition.relaxation
    }

    /// Takes the state `u` into the history and puts the rows of forces that it pushes the nodes with (µN) to `first` and, where it is asked for, `second`,
    /// `[K,3]` each. Regions go on by their own relaxation. Allocates nothing. The bits do not depend on the number of threads.
    ///
    /// # Panics
    /// If a length is not `3 K`, or for the history of another body.
    pub fn relax(
        &self,
        displacement: &[f32],
        history: &mut StressHistory,
        step: &HistoryStep,
        scratch: &mut Scratch,
        (first, second): (&mut [f32], Option<&mut [f32]>),
        parallel: ParallelFor<'_>,
    ) {
        assert_eq!(displacement.len(), 3 * self.node_count(), "displacement");
        let mut out = [Some(first), second];
        assert!(
            (out.iter().flatten()).all(|row| row.len() == 3 * self.node_count()),
            "out"
        );
        let count = out.iter().flatten().count();
        let partition = &self.partition;
        assert_eq!(history.branches, partition.most_branches(), "branches");
        for (number, own) in (0..).zip(&mut history.steps) {
            *own = partition.stress_step(number, step);
        }
        let values = history.pointers().map(Shared);
        let steps = &history.steps;
        let other = history.second.as_mut_ptr();
        let rows = [scratch.forces.as_mut_ptr(), other].map(|row| Shared(row.cast::<[f32; 4]>()));
        let places = Shared(scratch.positions.as_mut_ptr());
        let chunks = &partition.chunks;
        parallel(chunks.len(), &|index, worker| {
            let chunk = &chunks[index];
            // SAFETY: places belong to this worker, slots and batches to this chunk.
            unsafe {
                let places = (*places.at(worker)).as_mut_ptr().cast::<[f32; 4]>();
                let slots = chunk.first..chunk.first + chunk.slot_count();
                for (at, &node) in partition.node_of_slot[slots].iter().enumerate() {
                    let u = &displacement[3 * node as usize..][..3];
                    *places.add(at) = [u[0], u[1], u[2], 0.0];
                }
                let mut forces = [std::ptr::null_mut(); 2];
                for (row, all) in forces.iter_mut().zip(&rows[..count]) {
                    *row = all.at(chunk.first);
                    std::ptr::write_bytes(*row, 0, chunk.slot_count());
                }
                let values = [0, 1, 2].map(|kind: usize| values[kind].at(0));
                let step = &steps[usize::from(chunk.law)];
                if !step.is_idle() {
                    (self.kernels.relax)(partition, chunk, step, values, places, forces);
                }
            }
        });
        let out = (out.each_mut()).map(|row| {
            let start = row
                .as_mut()
                .map_or(std::ptr::null_mut(), |row| row.as_mut_ptr());
            Shared(start.cast::<[f32; 3]>())
        });
        parallel(chunks.len(), &|index, _| {
            let chunk = &chunks[index];
            // SAFETY: own slots and own nodes are this chunk's; ghost slots are only read in this phase.
            unsafe {
                for side in 0..count {
                    let row = &rows[side];
                    for (own, ghost) in &chunk.contributions {
                        let source = *row.at(*ghost as usize);
                        let target = &mut *row.at(*own as usize);
                        for k in 0..3 {
                            target[k] += source[k];
                        }
                    }
                    for slot in chunk.first..chunk.first + chunk.owned {
                        let [x, y, z, _] = *row.at(slot);
                        *out[side].at(partition.node_of_slot[slot] as usize) = [x, y, z];
                    }
                }
            }
        });
    }
}
