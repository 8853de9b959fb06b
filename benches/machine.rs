//! What this machine can do: the matrix product's rate by instruction set and the copy bandwidth.

mod measure;

use measure::{Row, machine};
use upt::kernels::Isa;

fn main() {
    for isa in Isa::available() {
        let name = format!("matrix product, one core, {}", isa.name());
        Row::new(name, machine::gemm_rate(isa), "GFLOP/s").print();
    }
    for threads in [1, 2] {
        let name = format!("copy, {threads} threads");
        Row::new(name, machine::copy_rate(threads), "GB/s").print();
    }
}
