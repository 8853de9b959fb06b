//! Low-rank encoder and message mean against the scalar reference: 512 supernodes of degree 32, width 96.

use upt::kernels::Compute;
use upt::kernels::aggregate::{Csr, Messages, aggregate, encode_aggregate};
use upt::kernels::encode::LowRank;
use upt::kernels::random::Random;
use upt::kernels::{Isa, Pool};

use super::NODES;
use super::measure::{Row, medians, relative_error};

pub fn against_scalar() {
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
    let table = random.normal(NODES * width, 1.0);
    let target = random.normal(supernodes * width, 1.0);
    let weight = random.normal(width * rank, 0.2);
    let features = random.normal(NODES * rank, 1.0);
    let source = LowRank::new(&table, &weight, width, rank);
    let receiver = LowRank::new(&target, &weight, width, rank);
    let pool = Pool::new(1).expect("threads");
    // The scalar reference comes first.
    let sets = Isa::available();
    for (name, encode) in [("mean of messages", false), ("encode and mean", true)] {
        let mut outs = vec![vec![0.0; supernodes * width]; sets.len()];
        let mut rivals: Vec<Box<dyn FnMut() + '_>> = Vec::new();
        for (&isa, out) in sets.iter().zip(&mut outs) {
            let (pool, table, target) = (&pool, &table, &target);
            let (nodes, features) = (&nodes, &features);
            let mut scratch = vec![0.0; width];
            rivals.push(Box::new(move || {
                if encode {
                    let scratch = &mut scratch;
                    let messages = Messages {
                        senders: csr,
                        supernodes: nodes,
                        source,
                        target: receiver,
                    };
                    encode_aggregate(Compute { isa, pool }, messages, features, scratch, out)
                } else {
                    aggregate(isa, pool, csr, width, table, target, out)
                }
                .expect("one thread");
            }));
        }
        let seconds = medians(&mut rivals);
        drop(rivals);
        for (i, isa) in sets.iter().enumerate().skip(1) {
            let name = format!("encoder/{name}/{}", isa.name());
            Row::new(name, 1e3 * seconds[i], "ms")
                .against("scalar", seconds[0] / seconds[i])
                .error(relative_error(&outs[i], &outs[0]))
                .print();
        }
    }
}
