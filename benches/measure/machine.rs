//! What this machine can do: the rate of the decoder's matrix product in cache, and the bandwidth of a copy from
//! memory. A step's floor is its FLOP over the first and its bytes over the second.

use super::medians;
use upt::kernels::decoder::probe::GemmProbe;
use upt::kernels::{Isa, Pool};

/// GFLOP/s of one core.
pub fn gemm_rate(isa: Isa) -> f64 {
    let mut probe = GemmProbe::default();
    let flops = probe.run(isa);
    let seconds = medians(&mut [Box::new(|| {
        probe.run(isa);
    })]);
    1e-9 * flops as f64 / seconds[0]
}

/// GB/s of a copy, read and written bytes counted.
pub fn copy_rate(threads: usize) -> f64 {
    const BYTES: usize = 128 << 20;
    let from = vec![1u8; BYTES];
    let mut to = vec![0u8; BYTES];
    let pool = Pool::new(threads).expect("threads");
    let part = BYTES / threads;
    let address = to.as_mut_ptr() as usize;
    let seconds = medians(&mut [Box::new(|| {
        pool.run(threads, &|chunk, _| {
            // SAFETY: each chunk copies its own part; both buffers outlive the run.
            unsafe {
                let at = chunk * part;
                let to = (address as *mut u8).add(at);
                std::ptr::copy_nonoverlapping(from.as_ptr().add(at), to, part);
            }
        })
        .expect("copy");
    })]);
    2e-9 * BYTES as f64 / seconds[0]
}
