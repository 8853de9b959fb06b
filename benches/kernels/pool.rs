//! What waking a worker costs, and from which size on a job that streams a table is worth it.

use upt::kernels::Pool;

use super::measure::{Row, medians};

pub fn costs() {
    let pool = Pool::new(2).expect("threads");
    let seconds = medians(&mut [Box::new(|| pool.run(2, &|_, _| {}).expect("empty"))]);
    Row::new("pool/empty job, 2 threads", 1e6 * seconds[0], "us").print();
    for kilobytes in [256, 1024, 4096, 8192, 16384, 32768] {
        let table = vec![1u64; kilobytes << 7];
        let sum = |chunk: usize| {
            let part = &table[chunk * table.len() / 16..(chunk + 1) * table.len() / 16];
            std::hint::black_box(part.iter().fold(0, |a: u64, &x| a ^ x));
        };
        let seconds = medians(&mut [
            Box::new(|| pool.run(16, &|chunk, _| sum(chunk)).expect("sums")),
            Box::new(|| (0..16).for_each(sum)),
        ]);
        let name = format!("pool/reading {kilobytes} kB, 2 threads");
        Row::new(name, 1e6 * seconds[0], "us")
            .against("the caller alone", seconds[1] / seconds[0])
            .print();
    }
}
