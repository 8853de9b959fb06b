//! The decoder's weights as the micro-kernels read them: packed once a model
//! ([`PackedDecoder`]), keys and values once a step ([`DecoderTokens`]).
//!
//! A packed matrix `[out,in]` is groups of eight outputs, `[out/8][in][8]`, zeros behind the last
//! output. The affine parts of LN_2 and LN_3 are folded into `W_1` and `W_3`; the attention's
//! `1/sqrt(h/heads)` and the `log2 e` of its exponential are folded into the keys.

use super::pack::{GROUP, block_count, pack, pack_blocks, pack_pairs, pair_count, panel_floats};
use super::precision::DecoderPrecision;
use field::error::Error;
use field::memory::{self, HeldBytes};
use half::bf16;

/// The decoder's tensors as stored in `weights.safetensors`; matrices `[out,in]` row-major.
#[derive(Debug, Clone, Copy)]
pub struct DecoderWeights<'a> {
    /// `h`.
    pub hidden: usize,
    /// Attention heads; divides `h`.
    pub heads: usize,
    /// `m`.
    pub mlp: usize,
    /// `decoder.attention_out.weight [h,h]`, `.bias [h]`.
    pub attention_out: (&'a [f32], &'a [f32]),
    /// `decoder.norm2.weight [h]`, `.bias [h]`.
    pub norm2: (&'a [f32], &'a [f32]),
    /// `decoder.mlp1.weight [m,h]`, `.bias [m]`.
    pub mlp1: (&'a [f32], &'a [f32]),
    /// `decoder.mlp2.weight [h,m]`, `.bias [h]`.
    pub mlp2: (&'a [f32], &'a [f32]),
    /// `decoder.norm3.weight [h]`, `.bias [h]`.
    pub norm3: (&'a [f32], &'a [f32]),
    /// `decoder.head.weight [3,h]`, `.bias [3]`.
    pub head: (&'a [f32], &'a [f32]),
}

/// `W x + b` ready for the micro-kernel.
#[derive(Debug, Default, HeldBytes)]
pub(super) struct Linear {
    /// Inputs, `in`.
    pub depth: usize,
    /// `[out,in]`, for the scalar reference.
    pub plain: Vec<f32>,
    /// `[out/8][in][8]`.
    pub panels: Vec<f32>,
    /// `[out/8][in/2][8][2]`, for bf16 on vectors.
    pub pairs: Vec<bf16>,
    /// `[out/16][in/32][16][32]`, for bf16 on matrix tiles; empty where the machine has none.
    pub blocks: Vec<bf16>,
    /// `[out]`, zeros up to a multiple of 8.
    pub bias: Vec<f32>,
}

/// A matrix in bf16, in both layouts.
#[derive(Clone, Copy)]
pub(super) struct Narrow<'a> {
    /// Rows that exist, padded to a multiple of eight.
    pub outputs: usize,
    /// As of [`Linear::pairs`].
    pub pairs: &'a [bf16],
    /// As of [`Linear::blocks`].
    pub blocks: &'a [bf16],
}

impl Linear {
    /// The weights in bf16.
    pub(super) fn narrow(&self) -> Narrow<'_> {
        Narrow {
            outputs: self.bias.len(),
            pairs: &self.pairs,
            blocks: &self.blocks,
        }
    }

    /// Packs `weight [out,in]` in each layout that this machine can run. All of them stay, since a
    /// scene chooses its precision later and a model is shared by scenes.
    fn new(
        outputs: usize,
        depth: usize,
        weight: Vec<f32>,
        mut bias: Vec<f32>,
    ) -> field::error::Result<Self> {
        let rows = outputs.next_multiple_of(GROUP);
        memory::fit(&mut bias, rows, WHAT)?;
        bias.resize(rows, 0.0);
        let mut linear = Self {
            depth,
            bias,
            panels: memory::zeros(panel_floats(outputs, depth), WHAT)?,
            pairs: memory::filled(pair_count(outputs, depth), bf16::ZERO, WHAT)?,
            blocks: memory::filled(block_count(outputs, depth), bf16::ZERO, WHAT)?,
            ..Self::default()
        };
        pack(&mut linear.panels, outputs, depth, |o, k| {
            weight[o * depth + k]
        });
        pack_pairs(&mut linear.pairs, outputs, depth, |o, k| {
            weight[o * depth + k]
        });
        pack_blocks(&mut linear.blocks, outputs, depth, |o, k| {
            weight[o * depth + k]
        });
        linear.plain = weight;
        Ok(linear)
    }

    /// `W LN(y) + b` where `LN` has a scale and a shift, as a layer on the plain normalised `y`.
    /// `W (g * y + s) + b = (W diag g) y + (W s + b)`. The new bias is summed in f64: it is made
    /// once.
    fn after_norm(
        outputs: usize,
        depth: usize,
        layer: Tensors<'_>,
        norm: Tensors<'_>,
    ) -> field::error::Result<Self> {
        let mut weight = memory::copied(layer.0, WHAT)?;
        let mut bias = memory::copied(layer.1, WHAT)?;
        for o in 0..outputs {
            let row = &mut weight[o * depth..][..depth];
            let shift: f64 = row
                .iter()
                .zip(norm.1)
                .map(|(w, b)| f64::from(*w) * f64::from(*b))
                .sum();
            bias[o] += shift as f32;
            row.iter_mut().zip(norm.0).for_each(|(w, g)| *w *= g);
        }
        Self::new(outputs, depth, weight, bias)
    }
}

const WHAT: &str = "the decoder's weights";

/// A weight and a bias, or a norm's scale and shift.
type Tensors<'a> = (&'a [f32], &'a [f32]);

/// The decoder of a model, packed. Immutable; shared by scenes and threads.
#[derive(Debug, HeldBytes)]
pub struct PackedDecoder {
    /// `h`, the width of the residual stream.
    pub(super) hidden: usize,
    /// Attention heads of `h / heads` features.
    pub(super) heads: usize,
    /// `m`, the width of the hidden layer.
    pub(super) mlp: usize,
    /// `W_o`, `b_o`: `[h,h]`.
    pub(super) attention_out: Linear,
    /// `W_1`, `b_1` with LN_2 folded in: `[m,h]`.
    pub(super) mlp1: Linear,
    /// `W_2`, `b_2`: `[h,m]`.
    pub(super) mlp2: Linear,
    /// `W_3`, `b_3` with LN_3 folded in: `[3,h]`.
    pub(super) head: Linear,
}

impl PackedDecoder {
    /// Packs a model's decoder.
    ///
    /// # Errors
    /// [`Error::Bundle`] of `file`, naming the tensor whose length does not fit; [`Error::OutOfMemory`].
    pub fn new(file: &str, w: &DecoderWeights<'_>) -> field::error::Result<Self> {
        let (h, m) = (w.hidden, w.mlp);
        if h == 0 || w.heads == 0 || !h.is_multiple_of(w.heads) {
            let problem = format!("decoder width {h} is not a multiple of {} heads", w.heads);
            return Err(Error::bundle(file, problem));
        }
        for (name, tensors, outputs, depth) in [
            ("attention_out", w.attention_out, h, h),
            ("norm2", w.norm2, h, 1),
            ("mlp1", w.mlp1, m, h),
            ("mlp2", w.mlp2, h, m),
            ("norm3", w.norm3, h, 1),
            ("head", w.head, 3, h),
        ] {
            if tensors.0.len() != outputs * depth || tensors.1.len() != outputs {
                let problem = format!(
                    "decoder.{name} has {} weights and {} biases, not {} and {outputs}",
                    tensors.0.len(),
                    tensors.1.len(),
                    outputs * depth
                );
                return Err(Error::bundle(file, problem));
            }
        }
        let plain = |t: Tensors<'_>, o, d| {
            let (weight, bias) = (memory::copied(t.0, WHAT)?, memory::copied(t.1, WHAT)?);
            Linear::new(o, d, weight, bias)
        };
        Ok(Self {
            hidden: h,
            heads: w.heads,
            mlp: m,
            attention_out: plain(w.attention_out, h, h)?,
            mlp1: Linear::after_norm(m, h, w.mlp1, w.norm2)?,
            mlp2: plain(w.mlp2, h, m)?,
            head: Linear::after_norm(3, h, w.head, w.norm3)?,
        })
    }

    /// `h`.
    pub fn hidden(&self) -> usize {
        self.hidden
    }

    /// Multiplications and additions of one node, two a multiply-add.
    pub fn flops(&self, tokens: usize) -> usize {
        let h = self.hidden;
        2 * (2 * h * tokens + h * h + 2 * h * self.mlp + 3 * h)
    }
}

/// What there is no memory for, where there is none.
const TOKENS: &str = "the decoder's tokens";

/// One step's keys and values, packed. Made once ([`DecoderTokens::new`]), filled each step
/// without allocation ([`DecoderTokens::set`]).
#[derive(Debug, HeldBytes)]
pub struct DecoderTokens {
    /// `L`.
    tokens: usize,
    /// `h` of the model that they were made for.
    hidden: usize,
    /// Attention heads.
    heads: usize,
    /// Scaled keys `[L,h]`, for the scalar reference.
    pub(super) keys: Vec<f32>,
    /// `[L,h]`.
    pub(super) values: Vec<f32>,
    /// Of each head the keys `[L, h/heads]`, and the values turned, `[h/heads, L]`.
    key_heads: Heads,
    value_heads: Heads,
}

/// A matrix `[outputs, depth]` of each head, packed as those of a layer are ([`Linear`]); a head after another.
#[derive(Debug, HeldBytes)]
struct Heads {
    /// Rows of a head's matrix.
    outputs: usize,
    /// Columns of it.
    depth: usize,
    /// Always filled: the f32 kernels and the fallback read them.
    panels: Vec<f32>,
    /// Filled by a step whose scene multiplies bf16 on vectors; zeros or an earlier step's
    /// otherwise.
    pairs: Vec<bf16>,
    /// The same for matrix tiles.
    blocks: Vec<bf16>,
}

impl Heads {
    /// Zeros.
    fn zeros(heads: usize, outputs: usize, depth: usize) -> field::error::Result<Heads> {
        let (pairs, blocks) = (pair_count(outputs, depth), block_count(outputs, depth));
        Ok(Heads {
            outputs,
            depth,
            panels: memory::zeros(heads * panel_floats(outputs, depth), TOKENS)?,
            pairs: memory::filled(heads * pairs, bf16::ZERO, TOKENS)?,
            blocks: memory::filled(heads * blocks, bf16::ZERO, TOKENS)?,
        })
    }

    /// Takes a head's matrix, in the layouts that a precision reads.
    fn set(
        &mut self,
        head: usize,
        precision: DecoderPrecision,
        value: impl Fn(usize, usize) -> f32,
    ) {
        let (outputs, depth) = (self.outputs, self.depth);
        let size = panel_floats(outputs, depth);
        let panels = &mut self.panels[head * size..][..size];
        pack(panels, outputs, depth, &value);
        match precision {
            DecoderPrecision::F32 => {}
            DecoderPrecision::Bf16Vectors => {
                let size = pair_count(outputs, depth);
                let pairs = &mut self.pairs[head * size..][..size];
                pack_pairs(pairs, outputs, depth, value);
            }
            DecoderPrecision::Bf16Tiles => {
                let size = block_count(outputs, depth);
                let blocks = &mut self.blocks[head * size..][..size];
                pack_blocks(blocks, outputs, depth, value);
            }
        }
    }

    fn panels(&self, head: usize) -> &[f32] {
        let size = panel_floats(self.outputs, self.depth);
        &self.panels[head * size..][..size]
    }

    /// A head's matrix in bf16.
    fn narrow(&self, head: usize) -> Narrow<'_> {
        let pairs = pair_count(self.outputs, self.depth);
        let blocks = block_count(self.outputs, self.depth);
        Narrow {
            outputs: self.outputs,
            pairs: &self.pairs[head * pairs..][..pairs],
            blocks: &self.blocks[head * blocks..][..blocks],
        }
    }
}

impl DecoderTokens {
    /// Room for `tokens = L` latent tokens; zeros until [`DecoderTokens::set`].
    pub fn new(decoder: &PackedDecoder, tokens: usize) -> Self {
        Self::try_new(decoder, tokens).expect("memory for the decoder's tokens")
    }

    /// As [`DecoderTokens::new`].
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn try_new(decoder: &PackedDecoder, tokens: usize) -> field::error::Result<Self> {
        let (h, heads) = (decoder.hidden, decoder.heads);
        let width = h / heads;
        Ok(Self {
            tokens,
            hidden: h,
            heads,
            keys: memory::zeros(tokens * h, TOKENS)?,
            values: memory::zeros(tokens * h, TOKENS)?,
            key_heads: Heads::zeros(heads, tokens, width)?,
            value_heads: Heads::zeros(heads, width, tokens)?,
        })
    }

    /// Takes a step's `keys [L,h]` and `values [L,h]`, the outputs of `latent.onnx`.
    ///
    /// # Panics
    /// If they have another length.
    /// `log2 e` goes into the keys because `e^s = 2^(s log2 e)` and the kernels have `2^x`.
    pub fn set(&mut self, precision: DecoderPrecision, keys: &[f32], values: &[f32]) {
        let (h, tokens, width) = (self.hidden, self.tokens, self.hidden / self.heads);
        assert_eq!(keys.len(), tokens * h, "keys must be [L, h]");
        assert_eq!(values.len(), tokens * h, "values must be [L, h]");
        let scale = std::f32::consts::LOG2_E / (width as f32).sqrt();
        for (to, from) in self.keys.iter_mut().zip(keys) {
            *to = from * scale;
        }
        self.values.copy_from_slice(values);
        for head in 0..self.heads {
            let column = head * width;
            let key = |l: usize, k: usize| self.keys[l * h + column + k];
            let value = |o: usize, l: usize| values[l * h + column + o];
            self.key_heads.set(head, precision, key);
            self.value_heads.set(head, precision, value);
        }
    }

    /// A head's keys as panels, `[L, h/heads]`.
    pub(super) fn key_panels(&self, head: usize) -> &[f32] {
        self.key_heads.panels(head)
    }

    /// A head's values as panels, `[h/heads, L]`.
    pub(super) fn value_panels(&self, head: usize) -> &[f32] {
        self.value_heads.panels(head)
    }

    /// A head's keys in bf16, `[L, h/heads]`.
    pub(super) fn keys_of(&self, head: usize) -> Narrow<'_> {
        self.key_heads.narrow(head)
    }

    /// A head's values in bf16, `[h/heads, L]`.
    pub(super) fn values_of(&self, head: usize) -> Narrow<'_> {
        self.value_heads.narrow(head)
    }

    /// `L`.
    pub fn len(&self) -> usize {
        self.tokens
    }

    /// Whether there are no tokens.
    pub fn is_empty(&self) -> bool {
        self.tokens == 0
    }

    pub(super) fn hidden(&self) -> usize {
        self.hidden
    }
}
