//! The kernels against their scalar references, and the decoder against plain ndarray, at the sizes
//! of K = 21,670. "Gelem/s" is GFLOP/s (decoder: matrix products only; aggregate: GELU of an edge
//! and feature counted as one), "GiB/s" is the table read.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ndarray::{Array1, Array2, ArrayView2, Axis, s};
use upt::kernels::aggregate::{Csr, aggregate, encode_aggregate};
use upt::kernels::contact::ContactFactor;
use upt::kernels::decoder::{
    DecoderPrecision, DecoderRows, DecoderScratch, DecoderTokens, DecoderWeights, PackedDecoder,
    decode,
};
use upt::kernels::encode::LowRank;
use upt::kernels::random::Random;
use upt::kernels::respond::accumulate_rows;
use upt::kernels::rows::{BlockBasis, RowPlan, Stored, decode_rows};
use upt::kernels::{Isa, Pool, gelu};

const NODES: usize = 21_670;

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
        PackedDecoder::new(&DecoderWeights {
            hidden: h,
            heads: self.heads,
            mlp: m,
            attention_out: (&self.matrices[0], &self.bias[..h]),
            norm2: (&self.scale, &self.bias[..h]),
            mlp1: (&self.matrices[1], &self.bias[..m]),
            mlp2: (&self.matrices[2], &self.bias[..h]),
            norm3: (&self.scale, &self.bias[..h]),
            head: (&self.matrices[3], &self.bias[..3]),
        })
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

fn decoder(c: &mut Criterion) {
    for (name, decoder) in [
        ("fast", Decoder::new(64, 2, 64, 128)),
        ("paper", Decoder::new(128, 4, 256, 256)),
    ] {
        let packed = decoder.packed();
        let mut tokens = DecoderTokens::new(&packed, decoder.tokens);
        tokens.set(DecoderPrecision::Bf16, &decoder.keys, &decoder.values);
        let mut group = c.benchmark_group(format!("decoder/{name}"));
        group.sample_size(20);
        let flops = packed.flops(decoder.tokens);
        let few = NODES / 20;
        group.throughput(Throughput::Elements((flops * few) as u64));
        group.bench_function("ndarray, a twentieth of the nodes", |b| {
            b.iter(|| decoder.ndarray(few))
        });
        let rows: Vec<u32> = (0..few as u32).collect();
        for isa in Isa::available() {
            for (threads, precision) in [
                (1, DecoderPrecision::F32),
                (2, DecoderPrecision::F32),
                (1, DecoderPrecision::Bf16),
                (2, DecoderPrecision::Bf16),
            ] {
                let bf16 = precision == DecoderPrecision::Bf16;
                if bf16 && !(isa == Isa::Avx512 && Isa::has_bf16())
                    || threads == 2 && isa == Isa::Scalar
                {
                    continue;
                }
                let pool = Pool::new(threads).expect("threads");
                let mut scratch = DecoderScratch::new(&packed, decoder.tokens, threads);
                let rows = if isa == Isa::Scalar {
                    DecoderRows::Compact(&rows)
                } else {
                    DecoderRows::All
                };
                let count = if isa == Isa::Scalar { few } else { NODES };
                let mut out = vec![0.0; 3 * count];
                let name = if bf16 { "bf16" } else { isa.name() };
                group.throughput(Throughput::Elements((flops * count) as u64));
                group.bench_function(
                    BenchmarkId::new(name, format!("{threads} threads, {count} nodes")),
                    |b| {
                        b.iter(|| {
                            let (packed, tokens, queries) = (&packed, &tokens, &decoder.queries);
                            decode(
                                isa,
                                &pool,
                                precision,
                                packed,
                                tokens,
                                queries,
                                rows,
                                &mut scratch,
                                &mut out,
                            )
                        });
                    },
                );
            }
        }
    }
}

fn encoder(c: &mut Criterion) {
    let (supernodes, degree, width, rank) = (512, 32, 96, 6);
    let mut random = Random::new(2);
    let neighbours: Vec<u32> = (0..supernodes * degree)
        .map(|_| random.below(NODES) as u32)
        .collect();
    let offsets: Vec<u32> = (0..=supernodes).map(|i| (i * degree) as u32).collect();
    let csr = Csr {
        offsets: &offsets,
        neighbours: &neighbours,
    };
    let nodes: Vec<u32> = (0..supernodes)
        .map(|_| random.below(NODES) as u32)
        .collect();
    let (table, target) = (
        random.normal(NODES * width, 1.0),
        random.normal(supernodes * width, 1.0),
    );
    let (weight, features) = (
        random.normal(width * rank, 0.2),
        random.normal(NODES * rank, 1.0),
    );
    let low_rank = LowRank::new(&table, &weight, width, rank);
    let mut out = vec![0.0; supernodes * width];
    let mut group = c.benchmark_group("encoder");
    group.throughput(Throughput::Elements((neighbours.len() * width) as u64));
    for isa in Isa::available() {
        let pool = Pool::new(1).expect("threads");
        let mut scratch = vec![0.0; width];
        group.bench_function(BenchmarkId::new("aggregate", isa.name()), |b| {
            b.iter(|| aggregate(isa, &pool, csr, width, &table, &target, &mut out));
        });
        group.bench_function(BenchmarkId::new("encode and aggregate", isa.name()), |b| {
            b.iter(|| {
                let (scratch, out) = (&mut scratch, &mut out);
                encode_aggregate(
                    isa, &pool, csr, &nodes, low_rank, low_rank, &features, scratch, out,
                )
            });
        });
    }
}

fn tables(c: &mut Criterion) {
    let (block_count, block_nodes, rank) = (64usize, 338usize, 48usize);
    let mut random = Random::new(3);
    let nodes: Vec<u32> = (0..(block_count * block_nodes) as u32).collect();
    let blocks: Vec<u32> = (0..=block_count)
        .map(|k| (k * block_nodes) as u32)
        .collect();
    let ranks: Vec<u32> = (0..=block_count).map(|k| (k * rank) as u32).collect();
    let wide = random.normal(3 * nodes.len() * rank, 1.0);
    let half: Vec<half::f16> = wide.iter().map(|&x| half::f16::from_f32(x)).collect();
    let q = random.normal(block_count * rank, 1.0);
    let mut out = vec![0.0; 3 * nodes.len()];
    let rows: Vec<u32> = (0..180).collect();
    let factors = random.normal(180, 1.0);
    let mut sum = vec![0.0; q.len()];
    for isa in Isa::available() {
        for (name, basis, size) in [
            ("f32", Stored::F32(&wide), 4),
            ("f16", Stored::F16(&half), 2),
        ] {
            let basis = BlockBasis {
                block_nodes: &nodes,
                block_offsets: &blocks,
                rank_offsets: &ranks,
                basis,
            };
            let plan = RowPlan::full(&basis);
            for threads in [1, 2] {
                let pool = Pool::new(threads).expect("threads");
                let id = format!("{name} {} {threads} threads", isa.name());
                let mut group = c.benchmark_group("table");
                group.throughput(Throughput::Bytes((size * wide.len()) as u64));
                group.bench_function(BenchmarkId::new("basis rows", &id), |b| {
                    b.iter(|| decode_rows(isa, &pool, &basis, &plan, &q, &mut out));
                });
                group.throughput(Throughput::Bytes((size * rows.len() * q.len()) as u64));
                group.bench_function(BenchmarkId::new("response of 60 nodes", &id), |b| {
                    b.iter(|| {
                        accumulate_rows(isa, &pool, basis.basis, &rows, &factors, false, &mut sum)
                    });
                });
            }
        }
    }
}

fn contact(c: &mut Criterion) {
    let mut group = c.benchmark_group("contact");
    for nodes in [20usize, 60, 120, 400] {
        let n = 3 * nodes;
        let a: Vec<f32> = (0..n * n)
            .map(|i| 0.01 / (1.0 + (i / n).abs_diff(i % n) as f32))
            .collect();
        let dofs: Vec<u32> = (0..n as u32).collect();
        let (displacement, mut forces) = (vec![1.0; n], vec![0.0; n]);
        for isa in Isa::available() {
            if isa == Isa::Scalar && nodes > 120 {
                continue;
            }
            let mut factor = ContactFactor::with_capacity(n);
            group.throughput(Throughput::Elements((n * n * n / 3) as u64));
            group.bench_function(
                BenchmarkId::new(format!("factor, {nodes} nodes"), isa.name()),
                |b| {
                    b.iter(|| factor.factor(isa, &a, n, &dofs));
                },
            );
            group.throughput(Throughput::Elements((2 * n * n) as u64));
            group.bench_function(
                BenchmarkId::new(format!("solve, {nodes} nodes"), isa.name()),
                |b| {
                    b.iter(|| factor.solve(isa, &displacement, &mut forces));
                },
            );
        }
    }
}

fn pool(c: &mut Criterion) {
    let pool = Pool::new(2).expect("threads");
    c.bench_function("pool/empty job, 2 threads", |b| {
        b.iter(|| pool.run(2, &|_, _| {}))
    });
}

criterion_group!(benches, decoder, encoder, tables, contact, pool);
criterion_main!(benches);
