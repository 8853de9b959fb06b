//! What relaxing tissue remembers of its stresses, and the load that it makes of them.
//!
//! The elements have the modulus `g0 = g(h)` of the bundle's steps; the rest of the stress at the end of a step is known at its start
//! ([`elements::StressHistory`]). Its forces, at the deformation of the start, act as loads beside contact do ([`super::load`]): all stages see them. They change
//! on a line over the scene's step, so that the substeps of one share them.
//!
//! What is remembered goes on when the next step begins, from the published state: a step that is refused or made again leaves no trace.

use elements::StressHistory;

use super::input::SolverContext;
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::stored;

const WHAT: &str = "the stresses that a scene remembers";

/// A scene's own.
#[derive(HeldBytes)]
pub(super) struct Relaxing {
    pub(super) history: StressHistory,
    /// Seconds between the state that is remembered and the last published one; of that being made, and whether nothing before counts for it.
    pub(super) since_s: f64,
    pub(super) next_since_s: f64,
    pub(super) next_is_new: bool,
    /// Whether `pushes` are those of the step from the last published state: the one at its end, and the one at its start.
    pub(super) is_ready: bool,
    pub(super) has_start: bool,
    /// What it pushes with at the start and the end of the scene's step `[K,3]`, µN.
    pub(super) pushes: [Vec<f32>; 2],
}

impl Relaxing {
    /// None where the body is elastic.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(super) fn new(context: SolverContext<'_>) -> Result<Option<Box<Relaxing>>> {
        let body = &context.corrections.body;
        let Some(history) = memory::tried(body.forces.stress_history(), WHAT)? else {
            return Ok(None);
        };
        let push = || memory::zeros(3 * body.mass.len(), WHAT);
        let own = Relaxing {
            history,
            since_s: 0.0,
            next_since_s: 0.0,
            next_is_new: false,
            is_ready: false,
            has_start: false,
            pushes: [push()?, push()?],
        };
        Ok(Some(memory::boxed(own, WHAT)?))
    }

    /// Back to rest.
    pub(super) fn clear(&mut self) {
        self.history.clear();
        self.since_s = 0.0;
        self.is_ready = false;
        self.pushes.iter_mut().for_each(|push| push.fill(0.0));
    }

    /// The state being made becomes the last.
    pub(super) fn commit(&mut self) {
        if self.next_is_new {
            self.history.clear();
        }
        self.since_s = self.next_since_s;
        self.is_ready = false;
    }

    /// Whether it pushes nothing in this step.
    pub(super) fn rests(&self) -> bool {
        self.pushes.iter().flatten().all(|push| *push == 0.0)
    }

    /// Adds what it pushes with at a part of the scene's step.
    pub(super) fn add(&self, way: f32, out: &mut [f32]) {
        let [from, to] = &self.pushes;
        if way == 1.0 {
            out.iter_mut().zip(to).for_each(|(out, to)| *out += to);
            return;
        }
        debug_assert!(self.has_start, "asked for at a part of a step");
        for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
            *out += from + way * (to - from);
        }
    }

    /// A copy of what is remembered.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(super) fn remembered(&self) -> Result<Remembered> {
        let [a, b, c] = self.history.values();
        Ok(Remembered {
            octahedra: memory::copied(a, WHAT)?,
            pairs: memory::copied(b, WHAT)?,
            singles: memory::copied(c, WHAT)?,
            since_s: self.since_s,
        })
    }

    /// Takes what was remembered, which has been checked against it.
    pub(super) fn restore(&mut self, remembered: &Remembered) {
        for (own, other) in self
            .history
            .values_mut()
            .iter_mut()
            .zip(remembered.values())
        {
            own.copy_from_slice(other);
        }
        self.since_s = remembered.since_s;
        self.is_ready = false;
    }
}

/// What relaxing tissue remembers, in a snapshot.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct Remembered {
    /// By kind of cluster, in the order of the body's elements, Pa.
    #[serde(with = "stored")]
    octahedra: Vec<f32>,
    #[serde(with = "stored")]
    pairs: Vec<f32>,
    #[serde(with = "stored")]
    singles: Vec<f32>,
    since_s: f64,
}

impl Remembered {
    fn values(&self) -> [&Vec<f32>; 3] {
        [&self.octahedra, &self.pairs, &self.singles]
    }

    /// Checks what was read against the elements of a scene.
    pub(super) fn check(&self, own: &Relaxing) -> Result<()> {
        if !(self.since_s.is_finite() && self.since_s >= 0.0) {
            return Err(Error::Snapshot(
                "its remembered stresses are of a time that is not one".into(),
            ));
        }
        let pairs = own.history.values().iter().zip(self.values());
        pairs
            .into_iter()
            .try_for_each(|(own, values)| stored::check(values, own.len()))
    }
}
