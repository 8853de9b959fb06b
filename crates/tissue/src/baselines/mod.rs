//! Plain methods that a surrogate has to beat, with the same step: contact nodes and vectors in, field out.
//!
//! [`predict_zero`] and [`copy_last`] cost nothing; [`LinearQuasiStatic`] is linear elasticity of the same
//! mesh with a decay after release; [`CoarseTled`] is the reference solver on a coarser mesh, interpolated.
//! Fields are `[K,3]`, mm. Each step reports its own run time where it is more than a copy.

mod coarse_tled;
mod decay;
mod embedding;
#[cfg(feature = "linear")]
mod quasi_static;

pub use coarse_tled::{CoarseTled, CoarseTledError};
pub use decay::DecayFit;
pub use embedding::Embedding;
#[cfg(feature = "linear")]
pub use quasi_static::LinearQuasiStatic;

/// Predicts rest, but for the contact nodes.
pub fn predict_zero(nodes: &[u32], vectors: &[[f32; 3]], out: &mut [[f32; 3]]) {
    out.fill([0.0; 3]);
    prescribe(nodes, vectors, out);
}

/// Predicts the last true frame, but for the contact nodes (one step, not a rollout).
pub fn copy_last(
    last_truth: &[[f32; 3]],
    nodes: &[u32],
    vectors: &[[f32; 3]],
    out: &mut [[f32; 3]],
) {
    out.copy_from_slice(last_truth);
    prescribe(nodes, vectors, out);
}

/// Sets contact nodes to their prescribed displacement.
fn prescribe(nodes: &[u32], vectors: &[[f32; 3]], out: &mut [[f32; 3]]) {
    for (&node, vector) in nodes.iter().zip(vectors) {
        out[node as usize] = *vector;
    }
}

#[cfg(all(test, feature = "linear"))]
mod tests;
