//! The floor of a step: its floating-point operations over the measured rate of the decoder's matrix product, and its
//! bytes over the measured copy bandwidth, whichever is longer. A small model's tables stay in cache, so its step may
//! beat the bandwidth's floor.

use upt::Scene;
use upt::kernels::Isa;

use super::cost::Cost;
use super::measure::{Row, machine};

/// Measured rates.
pub struct Machine {
    /// GFLOP/s of one core.
    gemm: f64,
    /// GB/s by threads, 1 and 2.
    copy: [f64; 2],
}

impl Machine {
    pub fn measure() -> Machine {
        let machine = Machine {
            gemm: machine::gemm_rate(Isa::detect()),
            copy: [1, 2].map(machine::copy_rate),
        };
        println!(
            "machine: {:.0} GFLOP/s a core, copy {:.1} and {:.1} GB/s",
            machine.gemm, machine.copy[0], machine.copy[1]
        );
        machine
    }

    /// The row of a scene that shows `region` and whose step took `ms`.
    pub fn print_floor(
        &self,
        cost: &Cost,
        scene: &Scene,
        region: Option<&[u32]>,
        name: &str,
        ms: f64,
    ) {
        let Some([flops, bytes]) = cost.of_step(scene, region) else {
            println!(
                "{name}: left out: the floor; bundle.json has no field `provenance.architecture`"
            );
            return;
        };
        let threads = scene.stats().threads as usize;
        let compute = 1e-6 * flops / (self.gemm * threads as f64);
        let memory = 1e-6 * bytes / self.copy[threads - 1];
        println!(
            "{name}: {:.1} MFLOP {compute:.3} ms, {:.1} MB {memory:.3} ms, step {ms:.3} ms",
            1e-6 * flops,
            1e-6 * bytes
        );
        let (floor, what) = if compute > memory {
            (compute, "FLOP")
        } else {
            (memory, "bytes")
        };
        Row::new(format!("{name}/floor by {what}"), floor, "ms")
            .against("the step", ms / floor)
            .print();
    }
}
