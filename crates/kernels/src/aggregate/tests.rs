use super::*;
use crate::random::Random;

struct Case {
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
    nodes: usize,
    rows: usize,
}

fn case(random: &mut Random, nodes: usize, rows: usize) -> Case {
    let (mut offsets, mut neighbours) = (vec![0], Vec::new());
    for i in 0..rows {
        for _ in 0..(i % 9) {
            neighbours.push(random.below(nodes) as u32);
        }
        offsets.push(neighbours.len() as u32);
    }
    Case {
        offsets,
        neighbours,
        nodes,
        rows,
    }
}

impl Case {
    fn csr(&self) -> Csr<'_> {
        Csr {
            offsets: &self.offsets,
            neighbours: &self.neighbours,
        }
    }
}

#[test]
fn every_isa_matches_scalar_and_threads_do_not_matter() {
    let mut random = Random::new(3);
    for width in [1, 7, 16, 40, 96, 128] {
        let case = case(&mut random, 200, 61);
        let source = random.normal(case.nodes * width, 2.0);
        let target = random.normal(case.rows * width, 2.0);
        let run = |isa, threads| {
            let mut out = vec![f32::NAN; case.rows * width];
            let pool = Pool::new(threads).unwrap();
            aggregate(isa, &pool, case.csr(), width, &source, &target, &mut out).unwrap();
            out
        };
        let want = run(Isa::Scalar, 1);
        assert!(want[..width].iter().all(|&x| x == 0.0), "row 0 is empty");
        for isa in Isa::available() {
            let got = run(isa, 1);
            let worst = crate::random::max_error(&want, &got);
            assert!(worst < 2e-6, "{} width {width}: {worst:e}", isa.name());
            assert_eq!(got, run(isa, 2));
            assert_eq!(got, run(isa, 4));
        }
    }
}

#[test]
fn fused_equals_encode_then_aggregate() {
    let mut random = Random::new(4);
    for (width, rank) in [(5, 3), (96, 6), (128, 16), (24, 10)] {
        let case = case(&mut random, 150, 33);
        let features = random.normal(case.nodes * rank, 1.0);
        let source_table = random.normal(case.nodes * width, 1.0);
        let target_table = random.normal(case.rows * width, 1.0);
        let weights = [0, 1].map(|_| random.normal(width * rank, 0.5));
        let supernodes: Vec<u32> = (0..case.rows)
            .map(|_| random.below(case.nodes) as u32)
            .collect();
        let packed: Vec<_> = weights
            .iter()
            .map(|w| crate::encode::transpose_weight(w, width, rank).unwrap())
            .collect();
        let source_update = LowRank::new(&source_table, &packed[0], width, rank);
        let target_update = LowRank::new(&target_table, &packed[1], width, rank);
        let at_supernodes: Vec<f32> = supernodes
            .iter()
            .flat_map(|&s| features[s as usize * rank..][..rank].iter().copied())
            .collect();
        let rows: Vec<u32> = (0..case.rows as u32).collect();
        for isa in Isa::available() {
            let pool = Pool::new(2).unwrap();
            let mut source = vec![0.0; case.nodes * width];
            let all: Vec<u32> = (0..case.nodes as u32).collect();
            crate::encode::encode(isa, &pool, source_update, &features, &all, &mut source).unwrap();
            let mut target = vec![0.0; case.rows * width];
            crate::encode::encode(
                isa,
                &pool,
                target_update,
                &at_supernodes,
                &rows,
                &mut target,
            )
            .unwrap();
            let mut want = vec![0.0; case.rows * width];
            aggregate(isa, &pool, case.csr(), width, &source, &target, &mut want).unwrap();
            let mut got = vec![f32::NAN; case.rows * width];
            let mut scratch = vec![0.0; pool.threads() * width];
            let messages = Messages {
                senders: case.csr(),
                supernodes: &supernodes,
                source: source_update,
                target: target_update,
            };
            encode_aggregate(
                Compute { isa, pool: &pool },
                messages,
                &features,
                &mut scratch,
                &mut got,
            )
            .unwrap();
            assert_eq!(want, got, "{} width {width}", isa.name());
        }
    }
}

#[test]
fn a_neighbour_outside_is_an_error() {
    let pool = Pool::new(2).unwrap();
    let csr = Csr {
        offsets: &[0, 1],
        neighbours: &[5],
    };
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    for isa in Isa::available() {
        let mut out = [0.0; 16];
        let result = aggregate(isa, &pool, csr, 16, &[0.0; 80], &[0.0; 16], &mut out);
        assert!(result.is_err(), "{}", isa.name());
    }
    std::panic::set_hook(hook);
}
