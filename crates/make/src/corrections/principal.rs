//! The file of the corrections, and the leading directions of what it is made of.

pub const FILE: &str = "corrections.safetensors";

/// The leading principal directions of some vectors, by their Gram matrix.
pub fn principal(vectors: &[Vec<f32>], count: usize) -> Vec<Vec<f32>> {
    let n = vectors.len();
    let dot = |a: &[f32], b: &[f32]| -> f64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
    };
    let gram = nalgebra::DMatrix::from_fn(n, n, |i, j| dot(&vectors[i], &vectors[j]));
    let eigen = gram.symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    order
        .into_iter()
        .take(count)
        .filter(|&at| eigen.eigenvalues[at] > 1e-9 * eigen.eigenvalues.max())
        .map(|at| {
            let mut mode = vec![0.0f32; vectors[0].len()];
            for (vector, &weight) in vectors.iter().zip(eigen.eigenvectors.column(at).iter()) {
                for (mode, value) in mode.iter_mut().zip(vector) {
                    *mode += weight as f32 * value;
                }
            }
            mode
        })
        .collect()
}
