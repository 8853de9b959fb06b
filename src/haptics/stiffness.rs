//! How the wrench on a tool changes with its pose: `K = J^T S^-1 J`, with `S` the compliance of the directions in which samples push and `J` their
//! lever arms. Symmetric and positive semidefinite by construction.

use ::contact::Vector;

use crate::error::Result;
use crate::memory;

/// Directions at most; the strongest are kept.
pub const MOST: usize = 48;

/// A direction in which a sample pushes.
#[derive(Clone, Copy, Debug)]
pub struct Direction {
    /// Place of the sample.
    pub sample: usize,
    /// Unit length.
    pub along: Vector,
    /// From the tool's position to the sample, mm.
    pub arm: Vector,
}

/// Buffers.
pub struct Stiffness {
    factor: Vec<f64>,
    pub directions: Vec<Direction>,
}

impl Stiffness {
    /// Room for [`MOST`] directions.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new() -> Result<Stiffness> {
        const WHAT: &str = "the stiffness of haptics";
        Ok(Stiffness {
            factor: memory::filled(MOST * MOST, 0.0, WHAT)?,
            directions: memory::room(MOST, WHAT)?,
        })
    }

    /// Adds a direction while there is room.
    pub fn add(&mut self, direction: Direction) {
        if self.directions.len() < MOST {
            self.directions.push(direction);
        }
    }

    /// `K [6,6]` in N/m, N/rad, N m/m and N m/rad; `w(i, j)` is element of the compliance `[3n,3n]`, mm/mN.
    pub fn of(&mut self, w: impl Fn(usize, usize) -> f32) -> [f32; 36] {
        let count = self.directions.len();
        for (i, a) in self.directions.iter().enumerate() {
            for (j, b) in self.directions[..=i].iter().enumerate() {
                let mut sum = 0.0;
                for (r, x) in a.along.to_array().into_iter().enumerate() {
                    for (c, y) in b.along.to_array().into_iter().enumerate() {
                        sum += f64::from(x * y * w(3 * a.sample + r, 3 * b.sample + c));
                    }
                }
                self.factor[i * MOST + j] = sum;
            }
        }
        // Neighbours move almost alike: without a little of their own the factor is rounding.
        let largest = (0..count)
            .map(|i| self.factor[i * MOST + i])
            .fold(0.0, f64::max);
        for i in 0..count {
            for j in 0..=i {
                let mut sum = self.factor[i * MOST + j];
                for k in 0..j {
                    sum -= self.factor[i * MOST + k] * self.factor[j * MOST + k];
                }
                self.factor[i * MOST + j] = match i == j {
                    true => (sum + 1e-3 * largest).max(1e-6 * largest).sqrt(),
                    false => sum / self.factor[j * MOST + j],
                };
            }
        }
        // `K` is the square of `L^-1 J`, row by row.
        let mut solved = [[0.0f64; 6]; MOST];
        for i in 0..count {
            let Direction { along, arm, .. } = self.directions[i];
            let turn = arm.cross(along);
            let mut row = [0, 1, 2, 3, 4, 5].map(|k| match k {
                0..3 => f64::from(along[k]),
                _ => 1e-3 * f64::from(turn[k - 3]),
            });
            for (k, done) in solved.iter().enumerate().take(i) {
                let factor = self.factor[i * MOST + k];
                for (value, done) in row.iter_mut().zip(done) {
                    *value -= factor * done;
                }
            }
            solved[i] = row.map(|value| value / self.factor[i * MOST + i]);
        }
        let mut out = [0.0f32; 36];
        for (at, out) in out.iter_mut().enumerate() {
            let rows = solved[..count].iter();
            let sum: f64 = rows.map(|row| row[at / 6] * row[at % 6]).sum();
            *out = if sum.is_finite() { sum as f32 } else { 0.0 };
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_springs_side_by_side_have_their_sum_and_turn_about_their_middle() {
        let mut stiffness = Stiffness::new().unwrap();
        for (sample, x) in [(0, -2.0), (1, 2.0)] {
            stiffness.add(Direction {
                sample,
                along: Vector::Z,
                arm: Vector::new(x, 0.0, -1.0),
            });
        }
        // 0.01 mm/mN each, uncoupled: 100 mN/mm = 100 N/m.
        let k = stiffness.of(|i, j| if i == j { 0.01 } else { 0.0 });
        assert!((k[2 * 6 + 2] - 200.0).abs() < 0.5, "{}", k[2 * 6 + 2]);
        // Arms of 2 mm: 2 * 100 N/m * (2 mm)².
        assert!((k[4 * 6 + 4] - 8e-4).abs() < 1e-5, "{}", k[4 * 6 + 4]);
        assert_eq!(k[0], 0.0);
        for i in 0..6 {
            for j in 0..6 {
                assert_eq!(k[6 * i + j], k[6 * j + i]);
            }
        }
    }
}
