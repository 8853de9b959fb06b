//! The rate that the decoder's micro-kernel reaches on this machine when nothing else is in the
//! way: a cache-resident product `[128,128] x [128,nodes]`. Benches print a step's FLOP over it.

use super::CacheLine;
use super::gemm::{Finish, multiply};
use super::pack::panel_floats;
use lanes::DenseLanes;
use lanes::{Isa, by_isa};

/// Outputs and depth of the product: a layer's usual width, 64 kB of weights that stay in the
/// second-level cache.
const WIDTH: usize = 128;

/// Buffers of the product.
pub struct GemmProbe {
    /// Panels of a matrix `[WIDTH,WIDTH]`; every number is the same, for rates do not depend on
    /// them.
    weights: Vec<f32>,
    /// `[WIDTH][nodes]`, with room for the largest tile.
    input: Vec<CacheLine>,
    /// As `input`.
    output: Vec<CacheLine>,
}

impl Default for GemmProbe {
    fn default() -> Self {
        let lines = WIDTH * super::tile::MAX_NODES / 16;
        Self {
            weights: vec![0.01; panel_floats(WIDTH, WIDTH)],
            input: vec![CacheLine([0.5; 16]); lines],
            output: vec![CacheLine([0.0; 16]); lines],
        }
    }
}

impl GemmProbe {
    /// Runs the product once and gives its floating-point operations.
    pub fn run(&mut self, isa: Isa) -> usize {
        let nodes = super::tile::nodes(isa);
        product(isa, &self.weights, &self.input, &mut self.output);
        2 * WIDTH * WIDTH * nodes
    }
}

by_isa! { fn product(weights: &[f32], input: &[CacheLine], output: &mut [CacheLine]) = body, scalar; }

fn scalar(weights: &[f32], input: &[CacheLine], output: &mut [CacheLine]) {
    let nodes = super::tile::nodes(Isa::Scalar);
    for (o, row) in weights.chunks_exact(WIDTH).enumerate() {
        for i in 0..nodes {
            let product = |(k, w): (usize, &f32)| {
                let at = k * nodes + i;
                w * input[at / 16].0[at % 16]
            };
            let at = o * nodes + i;
            output[at / 16].0[at % 16] = row.iter().enumerate().map(product).sum();
        }
    }
}

#[inline(always)]
unsafe fn body<V: DenseLanes>(weights: &[f32], input: &[CacheLine], output: &mut [CacheLine]) {
    let (x, y) = (input.as_ptr().cast(), output.as_mut_ptr().cast());
    // SAFETY: the buffers hold `WIDTH` rows of the largest tile.
    unsafe {
        match V::COUNT {
            16 => multiply::<V, 8, 3>(weights, WIDTH, x, y, Finish::Plain),
            8 => multiply::<V, 4, 2>(weights, WIDTH, x, y, Finish::Plain),
            _ => multiply::<V, 8, 2>(weights, WIDTH, x, y, Finish::Plain),
        }
    }
}
