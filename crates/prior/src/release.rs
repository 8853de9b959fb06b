//! The learned map of a release (`release.safetensors` of `docs/reference/formats.md`): `b' = [b, b_before] W` for what the natural
//! modes leave out of a released field. Linear, and it dies away.
//!
//! A body that is let go has been pressed into a shape that its natural modes alone cannot show.
//! What remains is taken as coordinates `b` of a few further modes, and the map carries them from
//! step to step beside the oscillators ([`super::vibration`]). That the spectral radius is below
//! one is checked when the file is read: no release can grow, whatever the file was trained on.

use bundle::TensorFile;
use field::error::Result;
use field::memory::{self, HeldBytes};

/// Most modes that a file may hold.
const LIMIT: usize = 128;
/// After `2^SQUARINGS` steps every state is smaller than it was: 64 steps, which is six products of
/// small matrices to check.
const SQUARINGS: usize = 6;

/// Modes and their step.
#[derive(Clone, Debug, Default, HeldBytes)]
pub struct Release {
    /// Modes `Phi` in block coordinates `[r,Q]`, orthonormal.
    pub modes: Vec<f32>,
    /// `W [2r,r]`: from `b` and the `b` before it to the next.
    step: Vec<f32>,
    /// `r`.
    pub count: usize,
}

impl Release {
    /// Reads and checks the file for fields of `width` block coordinates, `Q`.
    pub fn parse(file: &TensorFile, width: usize) -> Result<Release> {
        let modes = file.float("modes", &[None, Some(width)])?;
        let count = modes.len() / width.max(1);
        if count == 0 || count > LIMIT {
            return Err(file.bad("modes", format!("must hold 1 to {LIMIT} modes")));
        }
        let step = file.f32("step", &[Some(2 * count), Some(count)])?;
        if !dies_away(&step, count)? {
            let steps = 1 << SQUARINGS;
            return Err(file.bad("step", format!("must have died away after {steps} steps")));
        }
        Ok(Release { modes, step, count })
    }

    /// `[b, b_before]` a step later.
    /// Both are `[2r]`, mm: the state is the remainder `b` and the one before it, so that the map is a recurrence of two
    /// steps.
    pub fn advance(&self, state: &[f32], next: &mut [f32]) {
        let (b_next, before_next) = next.split_at_mut(self.count);
        before_next.copy_from_slice(&state[..self.count]);
        b_next.fill(0.0);
        for (value, row) in state.iter().zip(self.step.chunks_exact(self.count.max(1))) {
            for (sum, weight) in b_next.iter_mut().zip(row) {
                *sum += value * weight;
            }
        }
    }
}

/// Whether the power `2^SQUARINGS` of `[b, b_before] -> [b', b]` is smaller than 1 in the Frobenius norm.
/// That norm bounds the spectral one, so the map's spectral radius is below 1 then. A NaN fails the
/// comparison and is refused with the rest.
fn dies_away(step: &[f32], count: usize) -> Result<bool> {
    const WHAT: &str = "the map of a release";
    let size = 2 * count;
    let mut power = memory::filled(size * size, 0.0f64, WHAT)?;
    let mut squared = memory::filled(size * size, 0.0f64, WHAT)?;
    for (i, (row, weights)) in power
        .chunks_exact_mut(size)
        .zip(step.chunks_exact(count))
        .enumerate()
    {
        for (to, &weight) in row.iter_mut().zip(weights) {
            *to = f64::from(weight);
        }
        if i < count {
            row[count + i] = 1.0;
        }
    }
    for _ in 0..SQUARINGS {
        squared.fill(0.0);
        for (to, row) in squared.chunks_exact_mut(size).zip(power.chunks_exact(size)) {
            for (value, from) in row.iter().zip(power.chunks_exact(size)) {
                to.iter_mut()
                    .zip(from)
                    .for_each(|(to, from)| *to += value * from);
            }
        }
        std::mem::swap(&mut power, &mut squared);
    }
    Ok(power.iter().map(|x| x * x).sum::<f64>() < 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_goes_on_from_the_two_before() {
        let release = Release {
            modes: Vec::new(),
            step: vec![0.5, 0.1, 0.0, 0.25, -0.2, 0.0, 0.0, 0.3],
            count: 2,
        };
        let mut next = [f32::NAN; 4];
        release.advance(&[1.0, 2.0, 10.0, 20.0], &mut next);
        let expected = [0.5 - 2.0, 0.1 + 0.5 + 6.0, 1.0, 2.0];
        for (found, expected) in next.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{next:?}");
        }
    }

    #[test]
    fn only_a_map_that_dies_away_is_taken() {
        assert!(dies_away(&[0.9, 0.0], 1).unwrap());
        assert!(!dies_away(&[1.0, 0.0], 1).unwrap());
        // b' = 1.2 b - 0.5 b_before turns and shrinks; with -1.1 it grows.
        assert!(dies_away(&[1.2, -0.5], 1).unwrap());
        assert!(!dies_away(&[1.2, -1.1], 1).unwrap());
        assert!(!dies_away(&[f32::MAX, f32::MAX], 1).unwrap());
        assert!(!dies_away(&[f32::NAN, 0.0], 1).unwrap());
    }
}
