//! Conjugate gradients on the stiffness, preconditioned by a factor of less precision, for many right-hand sides.
//!
//! Stiffness and factor are scaled to a diagonal of ones: the factor then differs from the stiffness by the rounding of float32 times a
//! condition that small elements do not raise, and each step reduces the residual by orders of magnitude. Right-hand sides share the
//! solves with the factor, whose reading is most of the time.

use rayon::prelude::*;

use super::Stiffness;

/// Right-hand sides that go through the factor together: as many vectors of `[n]` are kept four times.
const BATCH: usize = 96;
/// Steps at most, where rounding keeps the residual above the tolerance.
const MOST: usize = 12;

/// The stiffness, and what scales its diagonal to ones.
pub struct Scaled {
    stiffness: Stiffness,
    /// `K_ii^-1/2`.
    scale: Vec<f64>,
}

impl Scaled {
    /// Of a stiffness with a positive diagonal.
    pub fn new(stiffness: &Stiffness) -> Self {
        // The diagonal is the first entry of a column of the lower triangle.
        let firsts = &stiffness.column_offsets[..stiffness.dofs()];
        Self {
            scale: firsts
                .iter()
                .map(|&at| 1.0 / stiffness.values[at].sqrt())
                .collect(),
            stiffness: stiffness.clone(),
        }
    }

    /// The scaled lower triangle, in the stiffness' order.
    pub fn values(&self) -> Vec<f32> {
        let k = &self.stiffness;
        let mut scaled = Vec::with_capacity(k.values.len());
        for (column, by) in self.scale.iter().enumerate() {
            for at in k.column_offsets[column]..k.column_offsets[column + 1] {
                scaled.push((k.values[at] * by * self.scale[k.rows[at]]) as f32);
            }
        }
        scaled
    }

    /// Solves `K X = B` in place, `columns` `[count,n]`, to a residual of `tolerance` times the right-hand side, in norm. `precondition`
    /// solves with the factor of the scaled stiffness, in place, any number of right-hand sides.
    pub fn solve(&self, columns: &mut [f64], tolerance: f64, precondition: &dyn Fn(&mut [f32])) {
        for batch in columns.chunks_mut(BATCH * self.scale.len()) {
            self.batch(batch, tolerance, precondition);
        }
    }

    fn batch(&self, right: &mut [f64], tolerance: f64, precondition: &dyn Fn(&mut [f32])) {
        let n = self.scale.len();
        let mut image = vec![0.0f32; right.len()];
        let mut columns: Vec<Column<'_>> = right
            .chunks_exact_mut(n)
            .map(|residual| Column {
                wanted: tolerance * tolerance * dot(residual, residual),
                residual,
                solution: vec![0.0; n],
                direction: vec![0.0; n],
                product: 0.0,
                size: 0.0,
                done: false,
            })
            .collect();
        for _ in 0..MOST {
            let pairs = columns.par_iter_mut().zip(image.par_chunks_exact_mut(n));
            pairs.for_each(|(column, image)| column.ask(&self.scale, image));
            precondition(&mut image);
            let pairs = columns.par_iter_mut().zip(image.par_chunks_exact(n));
            pairs.for_each(|(column, image)| column.advance(self, image));
            if columns.iter().all(|column| column.done) {
                break;
            }
        }
        for column in columns {
            column.residual.copy_from_slice(&column.solution);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A right-hand side on its way; the residual takes its place.
struct Column<'a> {
    residual: &'a mut [f64],
    solution: Vec<f64>,
    direction: Vec<f64>,
    /// Residual times preconditioned residual of the step before; 0 in the first.
    product: f64,
    /// What the preconditioner's right-hand side was divided by: float32 must not underflow.
    size: f64,
    /// Square that the residual must reach.
    wanted: f64,
    done: bool,
}

impl Column<'_> {
    /// Writes the right-hand side for the preconditioner.
    fn ask(&mut self, scale: &[f64], image: &mut [f32]) {
        let scaled = || self.residual.iter().zip(scale).map(|(r, s)| r * s);
        self.size = scaled().fold(0.0f64, |most, r| most.max(r.abs()));
        self.done |= self.size == 0.0;
        if self.done {
            image.fill(0.0);
            return;
        }
        let size = self.size;
        image
            .iter_mut()
            .zip(scaled())
            .for_each(|(z, r)| *z = (r / size) as f32);
    }

    /// A step of conjugate gradients with what the preconditioner answered.
    fn advance(&mut self, scaled: &Scaled, image: &[f32]) {
        if self.done {
            return;
        }
        let size = self.size;
        let preconditioned = || {
            image
                .iter()
                .zip(&scaled.scale)
                .map(move |(z, s)| f64::from(*z) * s * size)
        };
        let product: f64 = self
            .residual
            .iter()
            .zip(preconditioned())
            .map(|(r, z)| r * z)
            .sum();
        let beta = if self.product == 0.0 {
            0.0
        } else {
            product / self.product
        };
        self.product = product;
        for (p, z) in self.direction.iter_mut().zip(preconditioned()) {
            *p = z + beta * *p;
        }
        let q = scaled.stiffness.multiply(&self.direction);
        let length = product / dot(&self.direction, &q);
        if !length.is_finite() {
            self.done = true;
            return;
        }
        for (x, p) in self.solution.iter_mut().zip(&self.direction) {
            *x += length * p;
        }
        for (r, q) in self.residual.iter_mut().zip(&q) {
            *r -= length * q;
        }
        self.done = dot(self.residual, self.residual) <= self.wanted;
    }
}
