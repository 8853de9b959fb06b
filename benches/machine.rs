//! What this machine can do: the rate of the decoder's matrix product in cache, and the bandwidth
//! of a copy from memory. A step's floor is its FLOP over the first and its bytes over the second.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use upt::kernels::decoder::probe::GemmProbe;
use upt::kernels::{Isa, Pool};

fn gemm(c: &mut Criterion) {
    let mut group = c.benchmark_group("machine/gemm");
    for isa in Isa::available() {
        let mut probe = GemmProbe::default();
        let flops = probe.run(isa);
        // Elements are FLOP: "Gelem/s" reads as GFLOP/s of one core.
        group.throughput(Throughput::Elements(flops as u64));
        group.bench_function(isa.name(), |b| b.iter(|| probe.run(isa)));
    }
}

fn copy(c: &mut Criterion) {
    const BYTES: usize = 256 << 20;
    let mut group = c.benchmark_group("machine/copy");
    group.sample_size(20);
    // Read and written bytes.
    group.throughput(Throughput::Bytes(2 * BYTES as u64));
    let from = vec![1u8; BYTES];
    let mut to = vec![0u8; BYTES];
    for threads in [1, 2] {
        let pool = Pool::new(threads).expect("threads");
        let part = BYTES / threads;
        let address = to.as_mut_ptr() as usize;
        group.bench_function(format!("{threads} threads"), |b| {
            b.iter(|| {
                pool.run(threads, &|chunk, _| {
                    // SAFETY: each chunk copies its own part; both buffers outlive the run.
                    unsafe {
                        let at = chunk * part;
                        let to = (address as *mut u8).add(at);
                        std::ptr::copy_nonoverlapping(from.as_ptr().add(at), to, part);
                    }
                })
            });
        });
    }
}

criterion_group!(benches, gemm, copy);
criterion_main!(benches);
