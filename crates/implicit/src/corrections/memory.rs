//! The L-BFGS memory: pairs of a step `s` and the change of the residual `y`, kept from step to step and over changes of the
//! contact (Nocedal and Wright, Numerical Optimization, algorithm 7.4; with a preconditioner as the initial matrix).
//!
//! Prescribed nodes are masked: their rows of `s` and `y` are left out of every product, so the pairs need not be dropped when the
//! contact changes.

use super::history::{PAIRS, Pair};
use super::precondition::Env;
use crate::error::Result;
use crate::kernels::vectors::{PartialSums, add_scaled, dots};
use crate::memory::{self, HeldBytes};

/// Room for the pairs of the last published state and for those of the step being made: a step that is refused leaves no trace.
pub(super) const SLOTS: usize = 2 * PAIRS;

const WHAT: &str = "L-BFGS pairs";

/// The pairs, oldest first by `order`.
#[derive(HeldBytes)]
pub struct Memory {
    /// `s` `[K,3]`, mm, and `y`, µN, by slot; none until a pair is stored: steps that tools drive store none here.
    steps: Vec<Vec<f32>>,
    changes: Vec<Vec<f32>>,
    /// Slots from the oldest to the newest.
    order: Vec<usize>,
    /// Those of the last published state.
    published: Vec<usize>,
    /// `s_i . y_j` over all nodes, by slot, where `i` is not newer than `j`: the recursions ask for no others.
    products: Vec<[f64; SLOTS]>,
    /// The same without the masked nodes.
    masked: Vec<[f64; SLOTS]>,
    /// Sums of the pieces of a product of vectors.
    partial: PartialSums,
}

impl Memory {
    /// Room for vectors of `len`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(len: usize) -> Result<Memory> {
        Ok(Memory {
            steps: memory::room(SLOTS, WHAT)?,
            changes: memory::room(SLOTS, WHAT)?,
            order: memory::room(SLOTS, WHAT)?,
            published: memory::room(SLOTS, WHAT)?,
            products: memory::filled(SLOTS, [0.0; SLOTS], WHAT)?,
            masked: memory::filled(SLOTS, [0.0; SLOTS], WHAT)?,
            partial: PartialSums::with_room(len, PAIRS)?,
        })
    }

    /// Forgets all pairs, in the step being made.
    pub fn clear(&mut self) {
        self.order.clear();
    }

    /// Back to the pairs of the last published state.
    /// Lists of slots are exchanged, no vectors: a slot of the published state is never written to
    /// while it is published.
    pub fn begin(&mut self) {
        self.order.clone_from(&self.published);
    }

    /// The state being made is published.
    pub fn commit(&mut self) {
        self.published.clone_from(&self.order);
    }

    /// A copy of the published pairs, oldest first.
    pub fn pairs(&self) -> Result<Vec<Pair>> {
        let copied = |values: &[f32]| memory::copied(values, "a copy of L-BFGS pairs");
        let mut pairs = memory::room(self.published.len(), "a copy of L-BFGS pairs")?;
        for &slot in &self.published {
            pairs.push(Pair {
                step: copied(&self.steps[slot])?,
                change: copied(&self.changes[slot])?,
            });
        }
        Ok(pairs)
    }

    /// Leaves the nodes out of every product until the next call.
    pub fn mask(&mut self, nodes: &[u32]) {
        // The products are over all nodes, so that another contact only has to take its own rows off.
        self.masked.copy_from_slice(&self.products);
        for (at, &i) in self.order.iter().enumerate() {
            for &j in &self.order[at..] {
                for &node in nodes {
                    let at = 3 * node as usize;
                    let pairs = self.steps[i][at..at + 3]
                        .iter()
                        .zip(&self.changes[j][at..at + 3]);
                    let lost: f64 = pairs.map(|(s, y)| f64::from(*s) * f64::from(*y)).sum();
                    self.masked[i][j] -= lost;
                }
            }
        }
    }

    /// Stores `s = t d` and `y` (both zero at masked nodes) in place of the oldest pair, if it has curvature; tells whether it has.
    pub fn store(&mut self, env: Env<'_>, d: &[f32], t: f32, y: &[f32]) -> Result<bool> {
        self.fit(d.len())?;
        if self.order.len() == PAIRS {
            self.order.remove(0);
        }
        // Fewer than PAIRS are in use, and at most PAIRS are published.
        let free = |slot: &usize| !self.order.contains(slot) && !self.published.contains(slot);
        let slot = (0..SLOTS).find(free).unwrap_or(0);
        for (s, d) in self.steps[slot].iter_mut().zip(d) {
            *s = t * d;
        }
        self.changes[slot].copy_from_slice(y);
        self.order.push(slot);
        self.fill_products(env, slot)?;
        Ok(self.order.last() == Some(&slot))
    }

    /// Room for all pairs of vectors of `len`.
    fn fit(&mut self, len: usize) -> Result<()> {
        for vectors in [&mut self.steps, &mut self.changes] {
            while vectors.len() < SLOTS {
                vectors.push(memory::zeros(len, WHAT)?);
            }
        }
        Ok(())
    }

    fn fill_products(&mut self, env: Env<'_>, slot: usize) -> Result<()> {
        let mut out = [0.0; PAIRS];
        let count = self.order.len();
        let views = views(&self.steps, &self.order);
        let y = &self.changes[slot];
        let (isa, pool) = (env.isa, env.pool);
        dots(
            isa,
            pool,
            &views[..count],
            y,
            &mut self.partial,
            &mut out[..count],
        )?;
        for (&i, value) in self.order.iter().zip(out) {
            self.products[i][slot] = value;
            self.masked[i][slot] = value;
        }
        // Without curvature the pair would make `H` indefinite, and the direction lead up.
        if self.products[slot][slot] <= 0.0 {
            self.order.retain(|&other| other != slot);
        }
        Ok(())
    }

    /// The pairs with curvature on the free nodes, oldest first, and how many.
    fn used(&self) -> ([usize; PAIRS], usize) {
        let mut used = [0usize; PAIRS];
        let mut count = 0;
        for &slot in &self.order {
            // A pair whose step was at the masked nodes alone says nothing of the others; what rounding leaves of it would be divided by.
            if self.masked[slot][slot] > 1e-12 * self.products[slot][slot] {
                used[count] = slot;
                count += 1;
            }
        }
        (used, count)
    }

    /// `d = -H g` with `H` from the pairs around `precondition`; `q` is scratch. All `[K,3]`, `g` zero at masked nodes.
    pub fn direction(
        &mut self,
        env: Env<'_>,
        g: &[f32],
        q: &mut [f32],
        d: &mut [f32],
        mut precondition: impl FnMut(&mut [f32], &mut [f32]) -> Result<()>,
    ) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        let (used, count) = self.used();
        let used = &used[..count];
        let views = views(&self.steps, used);
        // All products with `g` come first, in one pass over memory; the recursion over the pairs then is on numbers alone.
        let mut first = [0.0f64; PAIRS];
        let first = &mut first[..count];
        dots(isa, pool, &views[..count], g, &mut self.partial, first)?;
        let alpha = alpha(&self.masked, used, first);
        q.copy_from_slice(g);
        let views = self::views(&self.changes, used);
        let factors = alpha.map(|a| -a as f32);
        add_scaled(isa, pool, &views[..count], &factors[..count], q)?;
        // `q` is what the pairs leave of the residual: it goes through the preconditioner as through an initial matrix.
        precondition(q, d)?;
        dots(isa, pool, &views[..count], d, &mut self.partial, first)?;
        let weight = weight(&self.masked, used, &alpha, first);
        let views = self::views(&self.steps, used);
        let factors = weight.map(|w| w as f32);
        add_scaled(isa, pool, &views[..count], &factors[..count], d)?;
        // Down: the recursion gives `H g`.
        d.iter_mut().for_each(|d| *d = -*d);
        Ok(())
    }
}

/// `alpha_i = s_i . (g - sum_{j > i} alpha_j y_j) / (s_i . y_i)`, newest first, from `first = s . g`; `products[i][j] = s_i . y_j`.
pub(super) fn alpha(products: &[[f64; SLOTS]], used: &[usize], first: &[f64]) -> [f64; PAIRS] {
    let mut alpha = [0.0f64; PAIRS];
    for i in (0..used.len()).rev() {
        let later: f64 = (i + 1..used.len())
            .map(|j| alpha[j] * products[used[i]][used[j]])
            .sum();
        alpha[i] = (first[i] - later) / products[used[i]][used[i]];
    }
    alpha
}

/// `alpha_i - beta_i` with `beta_i = y_i . (z + sum_{j < i} (alpha_j - beta_j) s_j) / (s_i . y_i)`, oldest first, from
/// `first = y . z`.
pub(super) fn weight(
    products: &[[f64; SLOTS]],
    used: &[usize],
    alpha: &[f64; PAIRS],
    first: &[f64],
) -> [f64; PAIRS] {
    let mut weight = [0.0f64; PAIRS];
    for i in 0..used.len() {
        let earlier: f64 = (0..i).map(|j| weight[j] * products[used[j]][used[i]]).sum();
        weight[i] = alpha[i] - (first[i] + earlier) / products[used[i]][used[i]];
    }
    weight
}

/// The vectors of some slots; entries beyond are empty.
fn views<'a>(vectors: &'a [Vec<f32>], slots: &[usize]) -> [&'a [f32]; PAIRS] {
    let mut views: [&[f32]; PAIRS] = [&[]; PAIRS];
    for (view, &slot) in views.iter_mut().zip(slots) {
        *view = &vectors[slot];
    }
    views
}
