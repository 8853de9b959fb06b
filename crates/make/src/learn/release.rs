//! The learned map of a release (`release.safetensors`, `docs/reference/formats.md`): how what the natural modes leave out of a released
//! field goes on. `b = Phi (q - z modes)`, `b' = [b, b_before] W`: principal directions `Phi` of that rest, and `W` by ridge regression
//! on one-step pairs of simulated releases.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use nalgebra::DMatrix;
use tissue::tensors::{Dtype, Tensor, f32_values, write_file};
use upt::prior::propagator;

use crate::corrections::principal;

/// Learned modes, at most; and for each release.
const MOST_MODES: usize = 80;
const MODES_A_RELEASE: usize = 2;
/// Ridge: this part of the largest feature's mean square.
const RIDGE: f64 = 1e-4;
/// Spectral radius of a step, at most: what is learned dies away.
const LARGEST_FACTOR: f64 = 0.85;

/// The natural modes of a bundle in block coordinates.
pub struct Swing {
    modes: Vec<f32>,
    projection: Vec<f32>,
    propagator: Vec<[f32; 4]>,
    width: usize,
}

impl Swing {
    /// Reads `vibration.safetensors`.
    pub fn read(path: &Path, damping: f64, step_s: f64) -> Result<Self> {
        let read = || -> Result<Self> {
            let bytes = std::fs::read(path)?;
            let file = safetensors::SafeTensors::deserialize(&bytes)?;
            let values = |name: &str| -> Result<Vec<f32>> {
                Ok(f32_values(file.tensor(name)?.data()).collect())
            };
            let frequency = values("frequency")?;
            let modes = values("modes")?;
            Ok(Self {
                width: modes.len() / frequency.len().max(1),
                modes,
                projection: values("projection")?,
                propagator: frequency
                    .iter()
                    .map(|&omega| propagator(f64::from(omega), damping, step_s))
                    .collect(),
            })
        };
        read().with_context(|| format!("{}: cannot be read", path.display()))
    }

    fn amplitudes(&self, q: &[f32]) -> Vec<f32> {
        let rows = self.projection.chunks_exact(self.width);
        rows.map(|row| row.iter().zip(q).map(|(a, b)| a * b).sum())
            .collect()
    }

    fn rest(&self, q: &[f32], z: &[f32]) -> Vec<f32> {
        let mut rest = q.to_vec();
        for (z, mode) in z.iter().zip(self.modes.chunks_exact(self.width)) {
            rest.iter_mut()
                .zip(mode)
                .for_each(|(q, mode)| *q -= z * mode);
        }
        rest
    }

    /// What the swinging modes leave out of each frame of a release but the first two, which each have amplitudes of their own; with
    /// `earlier` the field before those two, or rest.
    fn left_out(&self, frames: &[Vec<f32>]) -> Vec<Vec<f32>> {
        let first = self.amplitudes(&frames[0]);
        let mut z = self.amplitudes(&frames[1]);
        // Backward differences, as far as the two frames tell.
        let mut w: Vec<f32> = z.iter().zip(&first).map(|(a, b)| a - b).collect();
        let mut rests = vec![self.rest(&frames[0], &first), self.rest(&frames[1], &z)];
        for frame in &frames[2..] {
            for ((z, w), &[a, b, c, d]) in z.iter_mut().zip(&mut w).zip(&self.propagator) {
                (*z, *w) = (a * *z + b * *w, c * *z + d * *w);
            }
            rests.push(self.rest(frame, &z));
        }
        rests
    }
}

/// Fits the map to releases and writes it; returns the number of modes.
pub fn write(path: &Path, swing: &Swing, releases: &[Vec<Vec<f32>>]) -> Result<usize> {
    let rests: Vec<Vec<Vec<f32>>> = releases
        .iter()
        .map(|frames| swing.left_out(frames))
        .collect();
    // Directions of what is there to carry on: from the released field until it has died away.
    let seen: Vec<Vec<f32>> = rests
        .iter()
        .flat_map(|frames| frames[1..7].to_vec())
        .collect();
    let mut modes = principal(&seen, MOST_MODES.min(MODES_A_RELEASE * releases.len()));
    for mode in &mut modes {
        let length = mode.iter().map(|x| x * x).sum::<f32>().sqrt();
        mode.iter_mut().for_each(|x| *x /= length);
    }
    let count = modes.len();
    let along = |rest: &[f32]| -> Vec<f64> {
        let dot = |mode: &Vec<f32>| mode.iter().zip(rest).map(|(a, b)| a * b).sum::<f32>();
        modes.iter().map(|mode| f64::from(dot(mode))).collect()
    };
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for frames in &rests {
        let b: Vec<Vec<f64>> = frames.iter().map(|rest| along(rest)).collect();
        for at in 1..b.len() - 1 {
            inputs.push([b[at].as_slice(), &b[at - 1]].concat());
            outputs.push(b[at + 1].clone());
        }
    }
    let matrix = |rows: &[Vec<f64>]| {
        DMatrix::from_row_iterator(rows.len(), rows[0].len(), rows.iter().flatten().copied())
    };
    let (x, y) = (matrix(&inputs), matrix(&outputs));
    let mut gram = x.tr_mul(&x);
    let ridge = RIDGE * gram.diagonal().max();
    (0..2 * count).for_each(|i| gram[(i, i)] += ridge);
    let mut step = gram
        .cholesky()
        .context("the releases are not finite")?
        .solve(&x.tr_mul(&y));
    let factor = radius(&step);
    if factor > LARGEST_FACTOR {
        let less = LARGEST_FACTOR / factor;
        let (mut now, mut before) = step.rows_range_pair_mut(..count, count..);
        now *= less;
        before *= less * less;
    }
    let bytes = |values: &mut dyn Iterator<Item = f32>| values.flat_map(f32::to_le_bytes).collect();
    let metadata = BTreeMap::from([
        ("format".to_owned(), "upt-release".to_owned()),
        ("version".to_owned(), "1".to_owned()),
    ]);
    let width = swing.width;
    write_file(
        path,
        &metadata,
        &[
            Tensor::new(
                "modes",
                Dtype::F32,
                vec![count, width],
                bytes(&mut modes.iter().flatten().copied()),
            ),
            // Column-major: the transposed rows.
            Tensor::new(
                "step",
                Dtype::F32,
                vec![2 * count, count],
                bytes(&mut step.transpose().iter().map(|&value| value as f32)),
            ),
        ],
    )
    .with_context(|| format!("{}: cannot be written", path.display()))?;
    Ok(count)
}

/// Spectral radius of `[b, b_before] -> [b', b]`.
fn radius(step: &DMatrix<f64>) -> f64 {
    let count = step.ncols();
    let mut whole = DMatrix::zeros(2 * count, 2 * count);
    whole.columns_mut(0, count).copy_from(step);
    (0..count).for_each(|i| whole[(i, count + i)] = 1.0);
    let values = whole.complex_eigenvalues();
    values.iter().map(|value| value.norm()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_motion_beside_the_modes_is_found_again() {
        // One natural mode along the first coordinate; the others turn and shrink.
        let swing = Swing {
            modes: vec![1.0, 0.0, 0.0],
            projection: vec![1.0, 0.0, 0.0],
            propagator: vec![[0.5, 0.0, 0.0, 0.5]],
            width: 3,
        };
        let release = |x: f32, y: f32| -> Vec<Vec<f32>> {
            let mut frames = vec![vec![0.0, x, y]];
            for _ in 1..10 {
                let last = &frames[frames.len() - 1];
                let (x, y) = (0.6 * last[1] - 0.3 * last[2], 0.3 * last[1] + 0.6 * last[2]);
                frames.push(vec![0.0, x, y]);
            }
            frames
        };
        let releases = [release(1.0, 0.0), release(0.0, 1.0), release(2.0, -1.0)];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("release.safetensors");
        assert_eq!(write(&path, &swing, &releases).unwrap(), 2);
        let bytes = std::fs::read(&path).unwrap();
        let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        let values =
            |name: &str| -> Vec<f32> { f32_values(file.tensor(name).unwrap().data()).collect() };
        let (modes, step) = (values("modes"), values("step"));
        let frames = release(-1.0, 0.7);
        let b = |at: usize| -> Vec<f32> {
            let dot = |mode: &[f32]| mode.iter().zip(&frames[at]).map(|(a, b)| a * b).sum();
            modes.chunks_exact(3).map(dot).collect()
        };
        let input = [b(1), b(0)].concat();
        for (k, truth) in b(2).into_iter().enumerate() {
            let found: f32 = input
                .iter()
                .zip(step.chunks_exact(2))
                .map(|(x, row)| x * row[k])
                .sum();
            assert!((found - truth).abs() < 5e-3, "{found} is not {truth}");
        }
    }
}
