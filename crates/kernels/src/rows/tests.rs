use super::super::random::{Random, max_error};
use super::*;

struct Case {
    nodes: Vec<u32>,
    blocks: Vec<u32>,
    ranks: Vec<u32>,
    wide: Vec<f32>,
    half: Vec<f16>,
    q: Vec<f32>,
}

fn case() -> Case {
    let mut random = Random::new(9);
    let mut case = Case {
        nodes: (0..700).collect(),
        blocks: vec![0],
        ranks: vec![0],
        wide: Vec::new(),
        half: Vec::new(),
        q: Vec::new(),
    };
    for i in (1..700).rev() {
        let j = random.below(i + 1);
        case.nodes.swap(i, j);
    }
    for (n, rank) in [(1u32, 8u32), (300, 24), (5, 40), (0, 16), (394, 64)] {
        case.blocks.push(case.blocks.last().unwrap() + n);
        case.ranks.push(case.ranks.last().unwrap() + rank);
        case.wide
            .extend(random.normal((3 * n * rank) as usize, 0.3));
    }
    case.half = case.wide.iter().map(|&x| f16::from_f32(x)).collect();
    case.q = random.normal(*case.ranks.last().unwrap() as usize, 2.0);
    case
}

impl Case {
    fn basis(&self, f16: bool) -> BlockBasis<'_> {
        BlockBasis {
            block_nodes: &self.nodes,
            block_offsets: &self.blocks,
            rank_offsets: &self.ranks,
            basis: if f16 {
                Stored::F16(&self.half)
            } else {
                Stored::F32(&self.wide)
            },
            copies: None,
        }
    }
}

fn run(isa: Isa, threads: usize, case: &Case, f16: bool, plan: &RowPlan) -> Vec<f32> {
    let mut out = vec![f32::NAN; 3 * plan.output_rows()];
    let pool = Pool::new(threads).unwrap();
    decode_rows(isa, &pool, &case.basis(f16), plan, &case.q, &mut out).unwrap();
    out
}

#[test]
fn every_isa_matches_scalar_f32_and_f16() {
    let case = case();
    let plan = RowPlan::full(&case.basis(false));
    let exact = run(Isa::Scalar, 1, &case, false, &plan);
    for isa in Isa::available() {
        for f16 in [false, true] {
            let want = run(Isa::Scalar, 1, &case, f16, &plan);
            let got = run(isa, 1, &case, f16, &plan);
            assert!(max_error(&want, &got) < 1e-5, "{} f16 {f16}", isa.name());
            assert_eq!(got, run(isa, 2, &case, f16, &plan));
            assert_eq!(got, run(isa, 4, &case, f16, &plan));
        }
        let got = run(isa, 1, &case, true, &plan);
        let error = max_error(&exact, &got);
        assert!(error > 0.0 && error < 2e-2, "storage error {error:e}");
    }
}

#[test]
fn a_table_that_is_split_over_threads_gives_the_same_bits() {
    let mut random = Random::new(21);
    let (count, rank) = (12_000u32, 128u32);
    let wide = random.normal((3 * count * rank) as usize, 0.3);
    let case = Case {
        nodes: (0..count).rev().collect(),
        blocks: vec![0, count / 3, count],
        ranks: vec![0, rank, 2 * rank],
        half: wide.iter().map(|&x| f16::from_f32(x)).collect(),
        wide,
        q: random.normal(2 * rank as usize, 2.0),
    };
    for f16 in [false, true] {
        let plan = RowPlan::full(&case.basis(f16));
        let alone = run(Isa::detect(), 1, &case, f16, &plan);
        for threads in [2, 4] {
            assert_eq!(alone, run(Isa::detect(), threads, &case, f16, &plan));
        }
    }
}

#[test]
fn a_region_has_the_bits_of_the_whole() {
    let case = case();
    let mut random = Random::new(12);
    for isa in Isa::available() {
        for f16 in [false, true] {
            let full = run(isa, 1, &case, f16, &RowPlan::full(&case.basis(f16)));
            for count in [0, 1, 2, 3, 77, 400] {
                let mut nodes: Vec<u32> = (0..700).collect();
                for i in 0..count {
                    let j = i + random.below(700 - i);
                    nodes.swap(i, j);
                }
                nodes.truncate(count);
                let compact = run(
                    isa,
                    2,
                    &case,
                    f16,
                    &RowPlan::region(&case.basis(f16), &nodes, true),
                );
                let spread = run(
                    isa,
                    2,
                    &case,
                    f16,
                    &RowPlan::region(&case.basis(f16), &nodes, false),
                );
                for (i, &node) in nodes.iter().enumerate() {
                    let want = &full[3 * node as usize..][..3];
                    assert_eq!(want, &compact[3 * i..][..3]);
                    assert_eq!(want, &spread[3 * node as usize..][..3]);
                }
                assert_eq!(
                    spread.iter().filter(|x| x.is_nan()).count(),
                    3 * (700 - count)
                );
            }
        }
    }
}

#[test]
fn products_of_rows_are_projected_like_the_fields_that_they_are() {
    let case = case();
    let wanted = [3u32, 17, 18, 250, 699];
    let row_of = |node: u32| wanted.iter().position(|w| *w == node).map(|row| row as u32);
    let vectors = [
        (0, [0.5, -1.0, 2.0]),
        (3, [1.5, 0.0, -0.25]),
        (4, [-3.0, 0.75, 1.0]),
    ];
    for f16 in [false, true] {
        let basis = case.basis(f16);
        let mut plan = RowPlan::region(&basis, &[], true);
        plan.refill(&basis, wanted.len(), row_of).unwrap();
        for isa in Isa::available() {
            let mut products = vec![0.0; 9 * case.q.len()];
            project_products(isa, &basis, &plan, &vectors, &mut products);
            for (number, found) in products.chunks_exact(case.q.len()).enumerate() {
                let mut field = vec![0.0; 3 * wanted.len()];
                for (row, w) in vectors {
                    field[3 * row as usize + number / 3] = w[number % 3];
                }
                let mut q = vec![0.0; case.q.len()];
                project_rows(isa, &basis, &plan, &field, &mut q);
                assert!(max_error(&q, found) < 1e-5, "{} field {number}", isa.name());
            }
        }
    }
}
