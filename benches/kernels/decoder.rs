//! The fused decoder against its scalar reference, against plain ndarray, and against ONNX Runtime with a bundle's own
//! weights, at K = 21,670.

use ndarray::{Array1, Array2, ArrayView2, Axis, s};
use upt::kernels::decoder::{
    DecoderPrecision, DecoderRows, DecoderScratch, DecoderTokens, DecoderWeights, Decoding,
    PackedDecoder, decode,
};
use upt::kernels::random::Random;
use upt::kernels::{Compute, Isa, Pool, gelu};
use upt::model::{DECODER_TILE, KindModel};
use upt::onnx::{ProviderPlan, Runtime};
use upt::{Model, ModelOptions};

use super::NODES;
use super::measure::{Row, bundles, medians, relative_error};

/// Nodes that the slow rivals decode; their times are scaled to all nodes.
const FEW: usize = NODES / 100;

struct Decoder {
    hidden: usize,
    heads: usize,
    tokens: usize,
    mlp: usize,
    matrices: [Vec<f32>; 4],
    bias: Vec<f32>,
    scale: Vec<f32>,
    keys: Vec<f32>,
    values: Vec<f32>,
    queries: Vec<f32>,
}

impl Decoder {
    fn new(hidden: usize, heads: usize, tokens: usize, mlp: usize) -> Self {
        let mut random = Random::new(1);
        let mut matrix = |n: usize| random.normal(n, 0.1);
        Self {
            hidden,
            heads,
            tokens,
            mlp,
            matrices: [hidden * hidden, mlp * hidden, hidden * mlp, 3 * hidden].map(&mut matrix),
            bias: vec![0.0; hidden.max(mlp)],
            scale: vec![1.0; hidden],
            keys: matrix(tokens * hidden),
            values: matrix(tokens * hidden),
            queries: matrix(NODES * 2 * hidden),
        }
    }

    fn packed(&self) -> PackedDecoder {
        let (h, m) = (self.hidden, self.mlp);
        PackedDecoder::new(
            "weights.safetensors",
            &DecoderWeights {
                hidden: h,
                heads: self.heads,
                mlp: m,
                attention_out: (&self.matrices[0], &self.bias[..h]),
                norm2: (&self.scale, &self.bias[..h]),
                mlp1: (&self.matrices[1], &self.bias[..m]),
                mlp2: (&self.matrices[2], &self.bias[..h]),
                norm3: (&self.scale, &self.bias[..h]),
                head: (&self.matrices[3], &self.bias[..3]),
            },
        )
        .expect("shapes")
    }

    /// The same decoder for `rows` nodes in ndarray, without fusion: what one would write first.
    fn ndarray(&self, rows: usize) -> Array2<f32> {
        let h = self.hidden;
        let view = |x: &'_ [f32], r: usize, c: usize| {
            ArrayView2::from_shape((r, c), x).unwrap().to_owned()
        };
        let queries = ArrayView2::from_shape((rows, 2 * h), &self.queries[..rows * 2 * h]).unwrap();
        let (keys, values) = (
            view(&self.keys, self.tokens, h),
            view(&self.values, self.tokens, h),
        );
        let width = h / self.heads;
        let mut attended = Array2::<f32>::zeros((rows, h));
        for head in 0..self.heads {
            let part = s![.., head * width..(head + 1) * width];
            let q = queries.slice(s![.., h + head * width..h + (head + 1) * width]);
            let mut scores = q.dot(&keys.slice(part).t()) / (width as f32).sqrt();
            for mut row in scores.rows_mut() {
                let largest = row.fold(f32::NEG_INFINITY, |a, &b| a.max(b));
                row.mapv_inplace(|x| (x - largest).exp());
                let sum = row.sum();
                row /= sum;
            }
            attended
                .slice_mut(part)
                .assign(&scores.dot(&values.slice(part)));
        }
        let norm = |x: &Array2<f32>| {
            let mean = x.mean_axis(Axis(1)).unwrap().insert_axis(Axis(1));
            let x = x - &mean;
            let scale: Array1<f32> = x.mapv(|x| x * x).mean_axis(Axis(1)).unwrap();
            x * scale.mapv(|v| 1.0 / (v + 1e-6).sqrt()).insert_axis(Axis(1))
        };
        let y = &queries.slice(s![.., ..h]) + &attended.dot(&view(&self.matrices[0], h, h).t());
        let hidden = norm(&y)
            .dot(&view(&self.matrices[1], self.mlp, h).t())
            .mapv(gelu);
        let y = &y + &hidden.dot(&view(&self.matrices[2], h, self.mlp).t());
        norm(&y).dot(&view(&self.matrices[3], 3, h).t())
    }
}

/// The native kernel on all nodes or, for the scalar reference, on a few.
struct Native<'a> {
    isa: Isa,
    precision: DecoderPrecision,
    pool: Pool,
    packed: &'a PackedDecoder,
    tokens: &'a DecoderTokens,
    queries: &'a [f32],
    scratch: DecoderScratch,
    rows: Vec<u32>,
    out: Vec<f32>,
}

impl<'a> Native<'a> {
    fn new(
        isa: Isa,
        threads: usize,
        precision: DecoderPrecision,
        packed: &'a PackedDecoder,
        tokens: &'a DecoderTokens,
        queries: &'a [f32],
        nodes: usize,
    ) -> Native<'a> {
        Native {
            isa,
            precision,
            pool: Pool::new(threads).expect("threads"),
            packed,
            tokens,
            queries,
            scratch: DecoderScratch::new(packed, tokens.len(), threads),
            rows: (0..nodes as u32).collect(),
            out: vec![0.0; 3 * nodes],
        }
    }

    fn run(&mut self) {
        let compute = Compute {
            isa: self.isa,
            pool: &self.pool,
        };
        let what = Decoding {
            decoder: self.packed,
            precision: self.precision,
            tokens: self.tokens,
            queries: self.queries,
            rows: DecoderRows::Compact(&self.rows),
        };
        decode(compute, what, &mut self.scratch, &mut self.out).expect("rows of the table");
    }

    fn label(&self) -> String {
        let kind = match self.precision {
            DecoderPrecision::F32 => self.isa.name(),
            DecoderPrecision::Bf16Vectors => "bf16 vectors",
            DecoderPrecision::Bf16Tiles => "bf16 tiles",
        };
        format!("{kind}, {} threads", self.pool.threads())
    }
}

/// Random weights of the `wide` and the `paper` configuration.
pub fn against_references() {
    for (name, decoder) in [
        ("wide", Decoder::new(64, 2, 64, 128)),
        ("paper", Decoder::new(128, 4, 256, 256)),
    ] {
        let packed = decoder.packed();
        let mut tokens = DecoderTokens::new(&packed, decoder.tokens);
        for precision in DecoderPrecision::available() {
            tokens.set(precision, &decoder.keys, &decoder.values);
        }
        let native = |isa, threads, precision, nodes| {
            let queries = &decoder.queries;
            Native::new(isa, threads, precision, &packed, &tokens, queries, nodes)
        };
        let mut scalar = native(Isa::Scalar, 1, DecoderPrecision::F32, FEW);
        let mut plain = Array2::zeros((FEW, 3));
        let mut fast: Vec<Native> = Vec::new();
        for isa in Isa::available() {
            for threads in [1, 2] {
                if isa != Isa::Scalar {
                    fast.push(native(isa, threads, DecoderPrecision::F32, NODES));
                }
                if isa == Isa::Avx512 {
                    let narrow = DecoderPrecision::available().split_off(1);
                    fast.extend(narrow.into_iter().map(|p| native(isa, threads, p, NODES)));
                }
            }
        }
        let mut rivals: Vec<Box<dyn FnMut() + '_>> = vec![
            Box::new(|| scalar.run()),
            Box::new(|| plain = decoder.ndarray(FEW)),
        ];
        for native in &mut fast {
            rivals.push(Box::new(|| native.run()));
        }
        let seconds = medians(&mut rivals);
        drop(rivals);
        let scale = NODES as f64 / FEW as f64;
        let rows = plain.as_slice().expect("row-major");
        let reference = relative_error(&scalar.out, rows);
        Row::new(
            format!("decoder/{name}/scalar, 1 threads"),
            1e3 * seconds[0] * scale,
            "ms",
        )
        .against("ndarray", seconds[1] / seconds[0])
        .error(reference)
        .print();
        for (native, &time) in fast.iter().zip(&seconds[2..]) {
            let row = || {
                Row::new(
                    format!("decoder/{name}/{}", native.label()),
                    1e3 * time,
                    "ms",
                )
            };
            let error = relative_error(&native.out[..3 * FEW], &scalar.out);
            row()
                .against("scalar", seconds[0] * scale / time)
                .error(error)
                .print();
            if native.isa == Isa::detect() {
                let error = relative_error(&native.out[..3 * FEW], rows);
                row()
                    .against("ndarray", seconds[1] * scale / time)
                    .error(error)
                    .print();
            }
        }
    }
}

/// The weights of each bundle of kind `upt`: the native kernel next to `decoder.onnx` in tiles, one thread each.
pub fn against_onnx_runtime() -> upt::Result<()> {
    for path in bundles() {
        let model = Model::open(&path, &ModelOptions::default())?;
        let KindModel::Upt(kind) = &model.kind else {
            continue;
        };
        let (dims, packed) = (&kind.entry.dims, &kind.decoder);
        let mut random = Random::new(4);
        let keys = random.normal(dims.latent_tokens * dims.decoder, 1.0);
        let values = random.normal(dims.latent_tokens * dims.decoder, 1.0);
        let mut tokens = DecoderTokens::new(packed, dims.latent_tokens);
        tokens.set(DecoderPrecision::F32, &keys, &values);
        let queries = &kind.tables.query_table;
        let nodes = queries.len() / dims.query;
        let mut stage = kind.decoder_stage(Runtime::get(None)?, &ProviderPlan::cpu())?;
        stage.input(1).copy_from_slice(&keys);
        stage.input(2).copy_from_slice(&values);
        let mut theirs = vec![0.0; 3 * nodes];
        let precision = DecoderPrecision::F32;
        let isa = Isa::detect();
        let mut native = Native::new(isa, 1, precision, packed, &tokens, queries, nodes);
        let seconds = medians(&mut [
            Box::new(|| native.run()),
            Box::new(|| {
                let tiles = queries.chunks(DECODER_TILE * dims.query);
                for (tile, out) in tiles.zip(theirs.chunks_mut(3 * DECODER_TILE)) {
                    stage.input(0)[..tile.len()].copy_from_slice(tile);
                    stage.run().expect("the bundle's decoder");
                    out.copy_from_slice(&stage.output(0)[..out.len()]);
                }
            }),
        ]);
        let name = &model.manifest.name;
        Row::new(
            format!("decoder of {name}, {nodes} nodes/{}, 1 threads", isa.name()),
            1e3 * seconds[0],
            "ms",
        )
        .against("ONNX Runtime, tiles", seconds[1] / seconds[0])
        .error(relative_error(&native.out, &theirs))
        .print();
    }
    Ok(())
}
