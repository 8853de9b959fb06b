//! Block-wise bases of displacement fields: the nodes in spatial blocks, each with the leading directions of sampled fields.
//!
//! Blocks come from recursive coordinate bisection at the median of the longest axis, surface nodes first in each. The basis
//! of a block is the fewest (a multiple of 8) leading right singular vectors of the samples at its nodes whose discarded
//! energy, summed over the samples, stays below `tolerance² · nodes`, mm².

use faer::{Mat, Side};

/// Nodes by block: block `k` holds `nodes[offsets[k]..offsets[k+1]]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blocks {
    pub nodes: Vec<u32>,
    pub offsets: Vec<usize>,
}

impl Blocks {
    /// Blocks of at most `size` nodes; in a block the nodes of `surface` come first, each group ascending.
    pub fn new(positions: &[[f32; 3]], surface: &[[u32; 3]], size: usize) -> Self {
        let mut rim = vec![false; positions.len()];
        for &node in surface.iter().flatten() {
            rim[node as usize] = true;
        }
        let mut blocks = Self {
            nodes: Vec::with_capacity(positions.len()),
            offsets: vec![0],
        };
        blocks.cut(
            positions,
            &rim,
            (0..positions.len() as u32).collect(),
            size.max(1),
        );
        blocks
    }

    fn cut(&mut self, positions: &[[f32; 3]], rim: &[bool], mut nodes: Vec<u32>, size: usize) {
        if nodes.len() <= size {
            nodes.sort_unstable_by_key(|&node| (!rim[node as usize], node));
            self.nodes.extend(nodes);
            self.offsets.push(self.nodes.len());
            return;
        }
        let spread = |axis: usize| {
            let values = nodes.iter().map(|&node| positions[node as usize][axis]);
            let bounds = |(low, high): (f32, f32), x: f32| (low.min(x), high.max(x));
            let (low, high) = values.fold((f32::INFINITY, f32::NEG_INFINITY), bounds);
            high - low
        };
        let widths = [0, 1, 2].map(spread);
        let axis = (0..3).fold(0, |best, k| if widths[k] > widths[best] { k } else { best });
        let place = |node: u32| positions[node as usize][axis];
        nodes.sort_unstable_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        let upper = nodes.split_off(nodes.len() / 2);
        self.cut(positions, rim, nodes, size);
        self.cut(positions, rim, upper, size);
    }

    /// Number of blocks.
    pub fn count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The nodes of a block.
    pub fn nodes_of(&self, block: usize) -> &[u32] {
        &self.nodes[self.offsets[block]..self.offsets[block + 1]]
    }
}

/// Orthonormal columns of one block.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    /// `[dofs, rank]`, row-major; spare columns are zero.
    pub values: Vec<f32>,
    /// A multiple of 8.
    pub rank: usize,
    /// Energy of the samples that it leaves out, mm² summed over the block's nodes.
    pub lost_mm2: f64,
}

/// The leading directions of `samples [n, dofs]` (row-major, mm).
///
/// # Errors
/// In words, where the eigenvalue iteration does not converge: samples that are not finite.
pub fn leading_directions(
    samples: &[f32],
    dofs: usize,
    tolerance_mm: f64,
    most: usize,
) -> Result<Basis, String> {
    let count = samples.len() / dofs;
    // Held rows, which no sample moves, stay at zero; the iteration may not converge where nearly all are held.
    let moves = |row: &usize| (0..count).any(|sample| samples[sample * dofs + row] != 0.0);
    let live: Vec<usize> = (0..dofs).filter(moves).collect();
    let matrix = Mat::from_fn(count, live.len(), |row, column| {
        f64::from(samples[row * dofs + live[column]])
    });
    let gram = matrix.transpose() * &matrix;
    let eigen = gram
        .self_adjoint_eigen(Side::Lower)
        .map_err(|error| format!("a block's directions: {error:?}"))?;
    let mut energy: Vec<f64> = (0..live.len())
        .rev()
        .map(|at| eigen.S().column_vector()[at].max(0.0))
        .collect();
    energy.resize(dofs, 0.0);
    let allowed = tolerance_mm * tolerance_mm * (dofs / 3) as f64;
    // What is left out beyond each rank.
    let mut tail = vec![0.0; dofs + 1];
    for at in (0..dofs).rev() {
        tail[at] = tail[at + 1] + energy[at];
    }
    let needed = tail
        .iter()
        .position(|&rest| rest <= allowed)
        .unwrap_or(dofs);
    let rank = needed
        .next_multiple_of(8)
        .clamp(8, most.next_multiple_of(8))
        .min(dofs.next_multiple_of(8));
    let kept = rank.min(dofs);
    let mut values = vec![0.0f32; dofs * rank];
    for column in 0..kept {
        if energy[column] <= 0.0 {
            break;
        }
        for (at, row) in live.iter().enumerate() {
            values[row * rank + column] = eigen.U()[(at, live.len() - 1 - column)] as f32;
        }
    }
    Ok(Basis {
        values,
        rank,
        lost_mm2: tail[kept],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_each_node_once_with_the_surface_first() {
        let positions: Vec<[f32; 3]> = (0..100)
            .map(|i| [i as f32, (i % 7) as f32, (i % 3) as f32])
            .collect();
        let blocks = Blocks::new(&positions, &[[3, 50, 99]], 16);
        let mut seen = blocks.nodes.clone();
        seen.sort_unstable();
        assert_eq!(seen, (0..100).collect::<Vec<u32>>());
        let sizes = (0..blocks.count()).map(|k| blocks.nodes_of(k).len());
        assert!(sizes.clone().all(|size| size <= 16 && size > 0));
        let first = (0..blocks.count()).find(|&k| blocks.nodes_of(k).contains(&50));
        assert_eq!(blocks.nodes_of(first.unwrap())[0], 50);
    }

    #[test]
    fn a_block_that_is_held_but_for_a_few_rows_has_directions_and_one_that_is_held_has_none() {
        let (dofs, count) = (441, 300);
        let mut samples = vec![0.0f32; dofs * count];
        for (at, value) in samples.iter_mut().enumerate() {
            let (sample, row) = (at / dofs, at % dofs);
            if row % 49 == 7 {
                *value = 0.03 * (((sample * sample + 3 * row) % 97) as f32 / 97.0 - 0.5);
            }
        }
        let basis = leading_directions(&samples, dofs, 1e-6, 256).unwrap();
        for row in 0..dofs {
            let length: f32 = (basis.values[row * basis.rank..][..basis.rank].iter())
                .map(|value| value * value)
                .sum();
            let expected = if row % 49 == 7 { 1.0 } else { 0.0 };
            assert!((length - expected).abs() < 1e-4, "{row} {length}");
        }
        let held = leading_directions(&vec![0.0; dofs * count], dofs, 1e-6, 256).unwrap();
        assert_eq!((held.rank, held.lost_mm2), (8, 0.0));
        assert!(held.values.iter().all(|value| *value == 0.0));
    }

    #[test]
    fn leading_directions_span_the_samples_and_leave_held_rows_at_zero() {
        // Three directions in 12 dofs, the last three of them held.
        let mut samples = Vec::new();
        for s in 0..20 {
            let weights = [(s as f32).sin(), (0.7 * s as f32).cos(), 0.1 * s as f32];
            for dof in 0..12 {
                let mix: f32 = (0..3)
                    .map(|k| weights[k] * ((dof * (k + 2)) as f32).sin())
                    .sum();
                samples.push(if dof < 9 { mix } else { 0.0 });
            }
        }
        let basis = leading_directions(&samples, 12, 1e-4, 64).unwrap();
        assert_eq!(basis.rank, 8);
        assert!(basis.values[9 * 8..].iter().all(|&value| value == 0.0));
        for sample in samples.chunks_exact(12) {
            let q: Vec<f32> = (0..8)
                .map(|k| (0..12).map(|i| basis.values[i * 8 + k] * sample[i]).sum())
                .collect();
            for i in 0..12 {
                let back: f32 = (0..8).map(|k| basis.values[i * 8 + k] * q[k]).sum();
                assert!((back - sample[i]).abs() < 1e-4, "{back} {}", sample[i]);
            }
        }
    }
}
