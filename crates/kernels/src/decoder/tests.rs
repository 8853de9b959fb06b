use super::*;
use crate::Pool;
use crate::random::{Random, max_error};

struct Case {
    decoder: PackedDecoder,
    tokens: DecoderTokens,
    queries: Vec<f32>,
    nodes: usize,
}

fn case(h: usize, heads: usize, tokens: usize, mlp: usize, nodes: usize) -> Case {
    let mut random = Random::new((h + tokens) as u64);
    let mut matrix = |o: usize, d: usize| {
        let weight = random.normal(o * d, 1.0 / (d as f32).sqrt());
        (weight, random.normal(o, 0.3))
    };
    let (o, m1, m2, head) = (matrix(h, h), matrix(mlp, h), matrix(h, mlp), matrix(3, h));
    let norm = |mut t: (Vec<f32>, Vec<f32>)| {
        t.0.iter_mut().for_each(|x| *x = 1.0 + 0.2 * *x);
        t
    };
    let (n2, n3) = (norm(matrix(h, 1)), norm(matrix(h, 1)));
    let decoder = PackedDecoder::new(
        "weights.safetensors",
        &DecoderWeights {
            hidden: h,
            heads,
            mlp,
            attention_out: (&o.0, &o.1),
            norm2: (&n2.0, &n2.1),
            mlp1: (&m1.0, &m1.1),
            mlp2: (&m2.0, &m2.1),
            norm3: (&n3.0, &n3.1),
            head: (&head.0, &head.1),
        },
    )
    .unwrap();
    let mut packed = DecoderTokens::new(&decoder, tokens);
    let (keys, values) = (
        random.normal(tokens * h, 1.5),
        random.normal(tokens * h, 1.0),
    );
    for precision in DecoderPrecision::available() {
        packed.set(precision, &keys, &values);
    }
    Case {
        decoder,
        tokens: packed,
        queries: random.normal(nodes * 2 * h, 1.0),
        nodes,
    }
}

fn run(
    case: &Case,
    isa: Isa,
    threads: usize,
    precision: DecoderPrecision,
    rows: DecoderRows<'_>,
) -> Vec<f32> {
    let count = match rows {
        DecoderRows::Compact(rows) => rows.len(),
        _ => case.nodes,
    };
    let mut out = vec![f32::NAN; 3 * count];
    let pool = Pool::new(threads).unwrap();
    let mut scratch = DecoderScratch::new(&case.decoder, case.tokens.len(), threads);
    let what = Decoding {
        decoder: &case.decoder,
        precision,
        tokens: &case.tokens,
        queries: &case.queries,
        rows,
    };
    decode(Compute { isa, pool: &pool }, what, &mut scratch, &mut out).unwrap();
    out
}

const SHAPES: [(usize, usize, usize, usize); 5] = [
    (64, 2, 64, 128),
    (128, 4, 256, 256),
    (32, 1, 32, 32),
    (24, 2, 13, 50),
    (20, 5, 7, 9),
];

#[test]
fn every_isa_matches_scalar() {
    for (h, heads, tokens, mlp) in SHAPES {
        let case = case(h, heads, tokens, mlp, 131);
        let want = run(
            &case,
            Isa::Scalar,
            1,
            DecoderPrecision::F32,
            DecoderRows::All,
        );
        for isa in Isa::available() {
            let got = run(&case, isa, 1, DecoderPrecision::F32, DecoderRows::All);
            let error = max_error(&want, &got);
            println!("h {h} L {tokens} {}: {error:.1e}", isa.name());
            assert!(error < 1e-5, "h {h} {}: {error:e}", isa.name());
        }
    }
}

/// The definition in f64 (module page), from the packed weights: `[n,3]`.
fn in_f64(case: &Case) -> Vec<f64> {
    let d = &case.decoder;
    let linear = |l: &weights::Linear, x: &[f64]| -> Vec<f64> {
        (0..l.plain.len() / l.depth)
            .map(|o| {
                let row = l.plain[o * l.depth..][..l.depth].iter();
                row.zip(x).map(|(w, x)| f64::from(*w) * x).sum::<f64>() + f64::from(l.bias[o])
            })
            .collect()
    };
    let norm = |x: &[f64]| -> Vec<f64> {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let var = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64;
        x.iter().map(|x| (x - mean) / (var + 1e-6).sqrt()).collect()
    };
    let (h, width) = (d.hidden, d.hidden / d.heads);
    let mut out = Vec::new();
    for row in case.queries.chunks_exact(2 * h) {
        let (x, q) = row.split_at(h);
        let mut attended = vec![0.0; h];
        for part in (0..d.heads).map(|head| head * width..(head + 1) * width) {
            let weights: Vec<f64> = case
                .tokens
                .keys
                .chunks_exact(h)
                .map(|key| {
                    let pairs = key[part.clone()].iter().zip(&q[part.clone()]);
                    pairs
                        .map(|(k, q)| f64::from(*k) * f64::from(*q))
                        .sum::<f64>()
                        .exp2()
                })
                .collect();
            let sum: f64 = weights.iter().sum();
            for (value, weight) in case.tokens.values.chunks_exact(h).zip(&weights) {
                for i in part.clone() {
                    attended[i] += weight / sum * f64::from(value[i]);
                }
            }
        }
        let add =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
        let x: Vec<f64> = x.iter().map(|&x| f64::from(x)).collect();
        let y = add(&x, &linear(&d.attention_out, &attended));
        let mut hidden = linear(&d.mlp1, &norm(&y));
        for x in &mut hidden {
            *x = 0.5 * *x * (1.0 + libm::erf(*x / 2f64.sqrt()));
        }
        let y = add(&y, &linear(&d.mlp2, &hidden));
        out.extend(linear(&d.head, &norm(&y)));
    }
    out
}

/// Relative L2.
fn error_from(exact: &[f64], got: &[f32]) -> f64 {
    let square = |x: f64| x * x;
    let (difference, size) = exact.iter().zip(got).fold((0.0, 0.0), |(d, s), (a, b)| {
        (d + square(a - f64::from(*b)), s + square(*a))
    });
    (difference / size).sqrt()
}

#[test]
fn every_isa_is_the_definition_to_rounding() {
    for (h, heads, tokens, mlp) in SHAPES {
        let case = case(h, heads, tokens, mlp, 48);
        let exact = in_f64(&case);
        for isa in Isa::available() {
            let got = run(&case, isa, 1, DecoderPrecision::F32, DecoderRows::All);
            let error = error_from(&exact, &got);
            println!("h {h} L {tokens} {}: {error:.1e} from f64", isa.name());
            // Rounding only: what shorter chains of sums gain shows on trained sizes (`cargo xtask bench`, error of `paper`).
            let limit = if isa == Isa::Scalar { 2e-6 } else { 3e-7 };
            assert!(error < limit, "h {h} L {tokens} {}: {error:e}", isa.name());
        }
    }
}

#[test]
fn threads_and_regions_do_not_change_a_bit() {
    for (h, heads, tokens, mlp) in [SHAPES[0], SHAPES[3]] {
        let case = case(h, heads, tokens, mlp, 400);
        let mut random = Random::new(77);
        let mut rows: Vec<u32> = (0..400).collect();
        for i in 0..123 {
            let j = i + random.below(400 - i);
            rows.swap(i, j);
        }
        rows.truncate(123);
        for precision in DecoderPrecision::available() {
            for isa in Isa::available() {
                let full = run(&case, isa, 1, precision, DecoderRows::All);
                assert_eq!(full, run(&case, isa, 2, precision, DecoderRows::All));
                assert_eq!(full, run(&case, isa, 4, precision, DecoderRows::All));
                let compact = run(&case, isa, 2, precision, DecoderRows::Compact(&rows));
                let scatter = run(&case, isa, 2, precision, DecoderRows::Scatter(&rows));
                for (i, &row) in rows.iter().enumerate() {
                    let want = &full[3 * row as usize..][..3];
                    assert_eq!(want, &compact[3 * i..][..3]);
                    assert_eq!(want, &scatter[3 * row as usize..][..3]);
                }
                assert_eq!(
                    scatter.iter().filter(|x| x.is_nan()).count(),
                    3 * (400 - 123)
                );
            }
        }
    }
}

#[test]
fn bf16_stays_near_f32() {
    let isa = Isa::detect();
    let narrow: Vec<_> = DecoderPrecision::available().split_off(1);
    println!("of bf16 this machine runs {narrow:?}");
    for (h, heads, tokens, mlp) in SHAPES {
        let case = case(h, heads, tokens, mlp, 100);
        let want = run(&case, isa, 1, DecoderPrecision::F32, DecoderRows::All);
        let size = want.iter().map(|x| x.abs()).fold(0.0, f32::max);
        for &precision in &narrow {
            let got = run(&case, isa, 1, precision, DecoderRows::All);
            let error = max_error(&want, &got) / size;
            println!("{precision:?} h {h} L {tokens}: {error:.1e} of the largest output");
            assert!(error > 0.0 && error < 2e-2, "h {h}: {error:e}");
        }
    }
}

/// A machine without the instructions, or a process that may not use them, gets float32.
#[test]
fn what_the_machine_lacks_is_float32() {
    let case = case(64, 2, 64, 128, 60);
    for isa in Isa::available() {
        let plain = run(&case, isa, 1, DecoderPrecision::F32, DecoderRows::All);
        for precision in [DecoderPrecision::Bf16Vectors, DecoderPrecision::Bf16Tiles] {
            if isa == Isa::Avx512 && precision.is_available() {
                continue;
            }
            let got = run(&case, isa, 1, precision, DecoderRows::All);
            assert_eq!(plain, got, "{} {precision:?}", isa.name());
        }
    }
}

#[test]
fn nonsense_in_a_query_stays_in_its_node() {
    let every = Isa::available().into_iter().flat_map(|isa| {
        let precisions = DecoderPrecision::available().into_iter();
        precisions.map(move |precision| (isa, precision))
    });
    for (isa, precision) in every {
        let mut case = case(64, 2, 64, 128, 60);
        let clean = run(&case, isa, 1, precision, DecoderRows::All);
        case.queries[7 * 128 + 100] = f32::NAN;
        let got = run(&case, isa, 1, precision, DecoderRows::All);
        assert!(got[21..24].iter().all(|x| x.is_nan()), "{}", isa.name());
        assert_eq!(clean[..21], got[..21]);
        assert_eq!(clean[24..], got[24..]);
    }
}

#[test]
fn a_wrong_shape_is_named() {
    let (square, wide, h) = (vec![0.0; 64], vec![0.0; 24], vec![0.0; 8]);
    let result = PackedDecoder::new(
        "weights.safetensors",
        &DecoderWeights {
            hidden: 8,
            heads: 2,
            mlp: 4,
            attention_out: (&square, &h),
            norm2: (&h, &h),
            mlp1: (&wide, &h[..4]),
            mlp2: (&square[..32], &h),
            norm3: (&h, &h),
            head: (&wide, &h[..3]),
        },
    );
    let message = result.err().unwrap().to_string();
    assert!(message.contains("decoder.mlp1 has 24 weights"), "{message}");
}
