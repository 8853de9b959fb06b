//! Steps of local iterations and what changes over them; see [`super::pairs`].

use super::linear::WHAT;
use super::near::NearSet;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// `t + Phi c`.
#[derive(Debug, Default, HeldBytes)]
pub(in crate::corrections) struct Step {
    /// `[3 S]`, mm.
    pub t: Vec<f32>,
    /// Amplitudes of the modes `[r]`, mm.
    pub c: Vec<f32>,
}

/// A residual, or what of it changes, as a functional of steps: `r . t + p . c`.
#[derive(Debug, Default, HeldBytes)]
pub(in crate::corrections) struct Change {
    /// At the inside nodes `[3 S]`, µN.
    pub r: Vec<f32>,
    /// `Phi^T` of it, at all nodes.
    pub p: Vec<f32>,
}

impl Step {
    /// No step, of `count` modes; its places come with a near set.
    pub fn with_modes(count: usize) -> Result<Step> {
        Ok(Step {
            t: Vec::new(),
            c: memory::zeros(count, WHAT)?,
        })
    }

    /// No step, in the places of a near set.
    pub fn clear(&mut self, near: &NearSet) -> Result<()> {
        self.c.fill(0.0);
        resize(&mut self.t, 3 * near.places.inside)
    }

    /// `self += factor other`.
    pub fn add(&mut self, factor: f32, other: &Step) {
        add(factor, &other.t, &mut self.t);
        add(factor, &other.c, &mut self.c);
    }

    /// `self *= factor`.
    pub fn scale(&mut self, factor: f32) {
        for list in [&mut self.t, &mut self.c] {
            list.iter_mut().for_each(|value| *value *= factor);
        }
    }
}

impl Change {
    /// No change, likewise.
    pub fn with_modes(count: usize) -> Result<Change> {
        Ok(Change {
            r: Vec::new(),
            p: memory::zeros(count, WHAT)?,
        })
    }

    /// No change, in the places of a near set.
    pub fn clear(&mut self, near: &NearSet) -> Result<()> {
        self.p.fill(0.0);
        resize(&mut self.r, 3 * near.places.inside)
    }

    /// Takes what another holds.
    pub fn take(&mut self, other: &Change) -> Result<()> {
        self.p.copy_from_slice(&other.p);
        memory::replace(&mut self.r, &other.r, WHAT)
    }

    /// `self += factor other`.
    pub fn add(&mut self, factor: f32, other: &Change) {
        add(factor, &other.r, &mut self.r);
        add(factor, &other.p, &mut self.p);
    }

    /// The work over a step, nJ.
    pub fn over(&self, step: &Step) -> f64 {
        dot(&self.r, &step.t) + dot(&self.p, &step.c)
    }
}

/// Zeros, `count` of them.
pub(super) fn resize(list: &mut Vec<f32>, count: usize) -> Result<()> {
    list.clear();
    memory::fit(list, count, WHAT)?;
    list.resize(count, 0.0);
    Ok(())
}

/// `to += factor from`, as far as both go.
pub(super) fn add(factor: f32, from: &[f32], to: &mut [f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += factor * from;
    }
}

/// `a . b` as far as both go, in lanes.
pub(super) fn dot(a: &[f32], b: &[f32]) -> f64 {
    const LANES: usize = 16;
    let len = a.len().min(b.len());
    let (a, b) = (&a[..len], &b[..len]);
    let mut lanes = [0.0f32; LANES];
    let (wide_a, rest_a) = a.as_chunks::<LANES>();
    let (wide_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in wide_a.iter().zip(wide_b) {
        for k in 0..LANES {
            lanes[k] += a[k] * b[k];
        }
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    lanes.iter().map(|&lane| f64::from(lane)).sum::<f64>() + f64::from(rest)
}
