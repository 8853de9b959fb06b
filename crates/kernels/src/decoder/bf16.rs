//! The decoder's tile with bf16 products: operands rounded to bf16, sums in f32; attention weights, norms, GELU and the head
//! stay f32. AVX-512 machines with BF16 only. The products run on vectors (`vdpbf16ps`) or on matrix tiles ([`super::amx`]).
//!
//! Inputs are stored as pairs of successive features, `[in/2][nodes][2]`: a 32-bit lane holds what one `vdpbf16ps` consumes, and
//! sixteen rows of sixteen lanes are a matrix tile. Behind the last feature are zeros up to a whole tile.

#[cfg(target_arch = "x86_64")]
use super::amx::NODES;
#[cfg(target_arch = "x86_64")]
use super::tile::MAX_NODES;
use super::weights::{DecoderTokens, PackedDecoder};

/// Decodes the `NODES` nodes `rows` to `out [3][NODES]`; the caller has checked `Isa::has_bf16`, and for matrix tiles
/// `amx::is_available`.
#[cfg(target_arch = "x86_64")]
pub(super) fn tile(
    matrix_tiles: bool,
    decoder: &PackedDecoder,
    tokens: &DecoderTokens,
    queries: &[f32],
    rows: &[usize],
    scratch: &mut [f32],
    out: &mut [f32],
) {
    assert!(crate::Isa::has_bf16());
    assert!(!matrix_tiles || super::amx::is_available());
    // SAFETY: the machine has the instructions.
    unsafe { x86::layers(matrix_tiles, decoder, tokens, queries, rows, scratch, out) }
}

#[cfg(not(target_arch = "x86_64"))]
pub(super) fn tile(
    _: bool,
    _: &PackedDecoder,
    _: &DecoderTokens,
    _: &[f32],
    _: &[usize],
    _: &mut [f32],
    _: &mut [f32],
) {
    unreachable!("bf16 tiles are chosen on x86-64 only");
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::amx::{DEPTH, OUTPUTS, Sums, Tiles};
    use super::super::gemm::{Finish, store};
    use super::super::pack::GROUP;
    use super::super::tile::{Layout, exponentials, gather, head, normalise};
    use super::super::weights::Narrow;
    use super::{DecoderTokens, MAX_NODES, NODES, PackedDecoder};
    use core::arch::x86_64::*;
    use half::bf16;
    use lanes::Avx512;

    /// The vector half of the file is AVX-512 alone.
    type V = Avx512;
    /// Registers of nodes.
    const C: usize = NODES / 16;

    /// The layers of [`super::super::tile`] with the products in bf16. Before each product its input is narrowed into the
    /// scratch space's pairs, which the next one writes over; the residual stream stays f32 from the gather to the head.
    ///
    /// # Safety
    /// The machine has the instructions of the attribute, and with `matrix_tiles` those of [`Tiles`]; every row lies in the
    /// query table.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512bf16,avx2,fma,f16c")]
    pub(super) unsafe fn layers(
        matrix_tiles: bool,
        decoder: &PackedDecoder,
        tokens: &DecoderTokens,
        queries: &[f32],
        rows: &[usize],
        scratch: &mut [f32],
        out: &mut [f32],
    ) {
        let (h, m, count) = (decoder.hidden, decoder.mlp, tokens.len());
        let at = Layout::new(decoder, count, NODES);
        assert!(rows.len() == NODES && out.len() == 3 * NODES && scratch.len() >= at.total);
        // SAFETY: every array lies inside `scratch` by its layout; rows were checked by `decode`.
        unsafe {
            let scratch = scratch.as_mut_ptr();
            let (stream, input) = (scratch.add(at.stream), scratch.add(at.input));
            let (attended, hidden) = (scratch.add(at.attention), scratch.add(at.hidden));
            let pairs = scratch.add(at.pairs).cast::<u32>();
            gather::<V>(queries, rows, 2 * h, 0, h, stream);
            gather::<V>(queries, rows, 2 * h, h, h, input);
            let width = h / decoder.heads;
            // Configured once a tile of nodes and released when `tiles` is dropped at the end.
            let tiles = matrix_tiles.then(|| Tiles::configure());
            // Both ways take the same pairs and end with the same `finish`; they add up in another order.
            let multiply = |weights: Narrow<'_>, depth, y, finish| match &tiles {
                Some(tiles) => multiply_tiles(tiles, weights, depth, pairs, y, finish),
                None => multiply_pairs(weights.pairs, depth, pairs, y, finish),
            };
            for head in 0..decoder.heads {
                let first = head * width * NODES;
                pair(input.add(first), width, pairs);
                multiply(tokens.keys_of(head), width, hidden, Finish::Plain);
                let mut scale = [0.0f32; MAX_NODES];
                exponentials::<V, C>(hidden, count, scale.as_mut_ptr());
                pair(hidden, count, pairs);
                let finish = Finish::Scale(scale.as_ptr());
                multiply(tokens.values_of(head), count, attended.add(first), finish);
            }
            pair(attended, h, pairs);
            let layer = &decoder.attention_out;
            let finish = Finish::Residual(layer.bias.as_ptr());
            multiply(layer.narrow(), h, stream, finish);
            normalise::<V, C>(stream, h, input);
            pair(input, h, pairs);
            let layer = &decoder.mlp1;
            let finish = Finish::Gelu(layer.bias.as_ptr());
            multiply(layer.narrow(), h, hidden, finish);
            pair(hidden, m, pairs);
            let layer = &decoder.mlp2;
            let finish = Finish::Residual(layer.bias.as_ptr());
            multiply(layer.narrow(), m, stream, finish);
            normalise::<V, C>(stream, h, input);
            head::<V, C>(decoder, input, out.as_mut_ptr());
        }
    }

    /// `x [depth][NODES]` f32 to `[depth/2][NODES][2]` bf16, and zeros up to a whole tile.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512bf16,avx2,fma,f16c")]
    /// Rounds to the nearest even. An odd depth is filled up with a feature of zeros, which meets
    /// weights of zeros.
    unsafe fn pair(x: *const f32, depth: usize, to: *mut u32) {
        for k in (0..depth.next_multiple_of(DEPTH)).step_by(2) {
            for c in 0..C {
                // SAFETY: the caller's.
                unsafe {
                    if k >= depth {
                        let to = to.add(k / 2 * NODES + c * 16);
                        _mm512_storeu_si512(to.cast(), _mm512_setzero_si512());
                        continue;
                    }
                    let even = _mm512_loadu_ps(x.add(k * NODES + c * 16));
                    let odd = if k + 1 < depth {
                        _mm512_loadu_ps(x.add((k + 1) * NODES + c * 16))
                    } else {
                        _mm512_setzero_ps()
                    };
                    let low: __m256i = std::mem::transmute(_mm512_cvtneps_pbh(even));
                    let high: __m256i = std::mem::transmute(_mm512_cvtneps_pbh(odd));
                    let both = _mm512_or_si512(
                        _mm512_cvtepu16_epi32(low),
                        _mm512_slli_epi32::<16>(_mm512_cvtepu16_epi32(high)),
                    );
                    _mm512_storeu_si512(to.add(k / 2 * NODES + c * 16).cast(), both);
                }
            }
        }
    }

    /// `y = finish(W x)`: [`super::super::gemm::multiply`] on pairs.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512bf16,avx2,fma,f16c")]
    /// A 32-bit lane of a node holds two features; the weight is the pair of the same two,
    /// broadcast.
    unsafe fn multiply_pairs(
        panels: &[bf16],
        depth: usize,
        x: *const u32,
        y: *mut f32,
        finish: Finish,
    ) {
        let steps = depth.div_ceil(2);
        for (group, panel) in panels.chunks_exact(2 * GROUP * steps).enumerate() {
            // SAFETY: the caller's.
            unsafe {
                let mut sum = [[_mm512_setzero_ps(); C]; GROUP];
                let mut weight = panel.as_ptr().cast::<i32>();
                let mut from = x;
                for _ in 0..steps {
                    let mut column = [_mm512_setzero_si512(); C];
                    for c in 0..C {
                        column[c] = _mm512_loadu_si512(from.add(c * 16).cast());
                    }
                    for r in 0..GROUP {
                        let w = _mm512_set1_epi32(weight.add(r).read_unaligned());
                        for c in 0..C {
                            sum[r][c] = _mm512_dpbf16_ps(
                                sum[r][c],
                                std::mem::transmute::<__m512i, __m512bh>(column[c]),
                                std::mem::transmute::<__m512i, __m512bh>(w),
                            );
                        }
                    }
                    weight = weight.add(GROUP);
                    from = from.add(NODES);
                }
                let row = group * GROUP;
                store::<V, GROUP, C>(sum.map(|s| s.map(Avx512)), y.add(row * NODES), row, finish);
            }
        }
    }

    /// As [`multiply_pairs`], on matrix tiles.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512bf16,avx2,fma,f16c")]
    unsafe fn multiply_tiles(
        tiles: &Tiles,
        weights: Narrow<'_>,
        depth: usize,
        x: *const u32,
        y: *mut f32,
        finish: Finish,
    ) {
        let steps = depth.div_ceil(DEPTH);
        let mut sums = Sums([[0.0; NODES]; OUTPUTS]);
        let blocks = weights.blocks.chunks_exact(OUTPUTS * DEPTH * steps);
        for (block, panel) in blocks.enumerate() {
            // SAFETY: the caller's; the pairs hold zeros up to a whole tile.
            unsafe {
                tiles.multiply(panel.as_ptr(), x, steps, &mut sums);
                for half in 0..OUTPUTS / GROUP {
                    let row = block * OUTPUTS + half * GROUP;
                    // Blocks have sixteen outputs, layers a multiple of eight: half a block may be
                    // beyond.
                    if row >= weights.outputs {
                        break;
                    }
                    let mut sum = [[Avx512(_mm512_setzero_ps()); C]; GROUP];
                    for (sum, from) in sum.iter_mut().zip(&sums.0[half * GROUP..]) {
                        for (c, sum) in sum.iter_mut().enumerate() {
                            *sum = Avx512(_mm512_load_ps(from.as_ptr().add(c * 16)));
                        }
                    }
                    store::<V, GROUP, C>(sum, y.add(row * NODES), row, finish);
                }
            }
        }
    }
}
