//! Steps of local iterations and what changes over them; see [`super::pairs`].

use super::near::{NearSet, WHAT};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// `t + Phi c`.
#[derive(Debug, Default, HeldBytes)]
pub(in crate::corrections) struct Step {
    /// `[3 S]`.
    pub t: Vec<f32>,
    /// `Phi c` at the near nodes `[.., 3]`, by place.
    pub v: Vec<f32>,
    pub c: Vec<f32>,
}

/// A change of the residual, as a functional of steps.
#[derive(Debug, Default, HeldBytes)]
pub(in crate::corrections) struct Change {
    pub r: Vec<f32>,
    pub eta: Vec<f32>,
    pub modal: Vec<f32>,
}

impl Step {
    pub fn with_modes(count: usize) -> Result<Step> {
        Ok(Step {
            c: memory::zeros(count, WHAT)?,
            ..Step::default()
        })
    }

    /// No step, in the places of a near set.
    pub fn clear(&mut self, near: &NearSet) -> Result<()> {
        resize(&mut self.t, 3 * near.inside)?;
        resize(&mut self.v, 3 * near.nodes.len())?;
        self.c.fill(0.0);
        Ok(())
    }

    /// `self += factor other`.
    pub fn add(&mut self, factor: f32, other: &Step) {
        add(factor, &other.t, &mut self.t);
        add(factor, &other.v, &mut self.v);
        add(factor, &other.c, &mut self.c);
    }

    /// `self *= factor`.
    pub fn scale(&mut self, factor: f32) {
        for list in [&mut self.t, &mut self.v, &mut self.c] {
            list.iter_mut().for_each(|value| *value *= factor);
        }
    }
}

impl Change {
    pub fn with_modes(count: usize) -> Result<Change> {
        Ok(Change {
            modal: memory::zeros(count, WHAT)?,
            ..Change::default()
        })
    }

    /// No change, in the places of a near set.
    pub fn clear(&mut self, near: &NearSet) -> Result<()> {
        resize(&mut self.r, 3 * near.inside)?;
        resize(&mut self.eta, 3 * near.free)?;
        self.modal.fill(0.0);
        Ok(())
    }

    /// Takes what another holds.
    pub fn take(&mut self, other: &Change) -> Result<()> {
        memory::replace(&mut self.r, &other.r, WHAT)?;
        memory::replace(&mut self.eta, &other.eta, WHAT)?;
        self.modal.copy_from_slice(&other.modal);
        Ok(())
    }

    /// `self += factor other`.
    pub fn add(&mut self, factor: f32, other: &Change) {
        add(factor, &other.r, &mut self.r);
        add(factor, &other.eta, &mut self.eta);
        add(factor, &other.modal, &mut self.modal);
    }

    /// The work over a step, nJ.
    pub fn over(&self, step: &Step) -> f64 {
        dot(&self.r, &step.t) + dot(&self.eta, &step.v) + dot(&self.modal, &step.c)
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
