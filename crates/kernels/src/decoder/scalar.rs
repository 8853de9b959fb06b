//! The decoder of one node, step by step: the reference that the vector tiles are tested against.

use super::weights::{DecoderTokens, Linear, PackedDecoder};
use crate::gelu;

/// LayerNorm's eps, that of the networks that are trained (training/upt_training/layers.py).
pub(super) const EPS: f32 = 1e-6;

/// `queries [n,2h]`, `rows` the tile's nodes, `out [3][rows]`.
pub(super) fn tile(
    decoder: &PackedDecoder,
    tokens: &DecoderTokens,
    queries: &[f32],
    rows: &[usize],
    _scratch: &mut [f32],
    out: &mut [f32],
) {
    let h = decoder.hidden;
    for (lane, &row) in rows.iter().enumerate() {
        let (x, q) = queries[row * 2 * h..][..2 * h].split_at(h);
        let u = node(decoder, tokens, x, q);
        for axis in 0..3 {
            out[axis * rows.len() + lane] = u[axis];
        }
    }
}

/// One node, from its row `[x | q]` of the query table to its displacement, mm, before the bundle's `base`: attention with
/// its residual, the MLP with its residual, the head. LayerNorm has no scale and no shift here: [`PackedDecoder`] has
/// folded those of LN_2 and LN_3 into `mlp1` and `head`.
fn node(decoder: &PackedDecoder, tokens: &DecoderTokens, x: &[f32], q: &[f32]) -> [f32; 3] {
    let y = add(
        x,
        &linear(&decoder.attention_out, &attention(decoder, tokens, q)),
    );
    let mut hidden = linear(&decoder.mlp1, &normalise(&y));
    hidden.iter_mut().for_each(|x| *x = gelu(*x));
    let y = add(&y, &linear(&decoder.mlp2, &hidden));
    let u = linear(&decoder.head, &normalise(&y));
    [u[0], u[1], u[2]]
}

/// `softmax(q K^T) V` for each head; the scale and `log2 e` are in the keys.
/// Heads are parts of the feature axis, `h / heads` wide, and do not meet before the layer behind.
fn attention(decoder: &PackedDecoder, tokens: &DecoderTokens, q: &[f32]) -> Vec<f32> {
    let (h, width) = (decoder.hidden, decoder.hidden / decoder.heads);
    let mut out = vec![0.0; h];
    for start in (0..h).step_by(width) {
        let part = start..start + width;
        let scores: Vec<f32> = tokens
            .keys
            .chunks_exact(h)
            .map(|key| dot(&key[part.clone()], &q[part.clone()]))
            .collect();
        // The largest score is taken off, as `2^s` of a large one would overflow; it cancels.
        let largest = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let weights: Vec<f32> = scores.iter().map(|s| (s - largest).exp2()).collect();
        let sum: f32 = weights.iter().sum();
        for (value, weight) in tokens.values.chunks_exact(h).zip(&weights) {
            for i in part.clone() {
                out[i] += weight / sum * value[i];
            }
        }
    }
    out
}

/// `W x + b` from the plain matrix. The bias is padded to a multiple of eight; the rows of `plain` are not, and `zip` ends
/// with the shorter.
fn linear(layer: &Linear, x: &[f32]) -> Vec<f32> {
    layer
        .plain
        .chunks_exact(layer.depth)
        .zip(&layer.bias)
        .map(|(row, b)| dot(row, x) + b)
        .collect()
}

/// Mean 0 and variance 1 over the features, with [`EPS`] beside the variance: two passes, as [`super::tile`] makes them.
fn normalise(x: &[f32]) -> Vec<f32> {
    let n = x.len() as f32;
    let mean = x.iter().sum::<f32>() / n;
    let variance = x.iter().map(|x| (x - mean) * (x - mean)).sum::<f32>() / n;
    let scale = 1.0 / (variance + EPS).sqrt();
    x.iter().map(|x| (x - mean) * scale).collect()
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
