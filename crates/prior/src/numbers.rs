//! A table's numbers at the width in which its file holds them.

use half::f16;
use half::slice::HalfFloatSliceExt;

use bundle::TensorFile;
use field::error::Result;
use field::memory::{self, HeldBytes};
use kernels::rows::Stored;

/// Numbers kept at the width in which they are stored.
#[derive(Clone, Debug, HeldBytes)]
pub enum Numbers {
    /// float32.
    F32(Vec<f32>),
    /// float16.
    F16(Vec<f16>),
}

impl Numbers {
    /// A tensor of either type, checked against `shape`; `None` in it stands for any length.
    pub(super) fn read(
        file: &TensorFile,
        tensor: &str,
        shape: &[Option<usize>],
    ) -> Result<Numbers> {
        Ok(if file.is_f16(tensor) {
            Numbers::of_f16(file.f16(tensor, shape)?)?
        } else {
            Numbers::F32(file.f32(tensor, shape)?)
        })
    }

    /// Half-precision numbers as they are, or widened once where no instruction widens them in each step.
    /// WebAssembly has none: widening in each step took 16 % of it (docs/decisions/025-web.md).
    pub(super) fn of_f16(half: Vec<f16>) -> Result<Numbers> {
        if cfg!(target_family = "wasm") {
            let wide = half.iter().map(|x| x.to_f32());
            return Ok(Numbers::F32(memory::collected(
                half.len(),
                wide,
                "a table's numbers",
            )?));
        }
        Ok(Numbers::F16(half))
    }

    /// As the kernels take it.
    pub fn stored(&self) -> Stored<'_> {
        match self {
            Numbers::F32(values) => Stored::F32(values),
            Numbers::F16(values) => Stored::F16(values),
        }
    }

    /// Widens `[start, start + out.len())`.
    pub(super) fn widen(&self, start: usize, out: &mut [f32]) {
        let range = start..start + out.len();
        match self {
            Numbers::F32(values) => out.copy_from_slice(&values[range]),
            Numbers::F16(values) => values[range].convert_to_f32_slice(out),
        }
    }

    /// Element `index`, widened.
    pub fn at(&self, index: usize) -> f32 {
        match self {
            Numbers::F32(values) => values[index],
            Numbers::F16(values) => values[index].to_f32(),
        }
    }
}

/// What a file leaves out is memory all the same: a small file asks for no more than so many times
/// its size. It bounds what a damaged or hostile file can make a host allocate.
const MOST_ZEROS: usize = 64;

/// The numbers of a whole table, where a file that holds `stored` of its bytes or numbers may ask for so many; `leaves` says which of them are left out.
pub(super) fn fits(
    file: &TensorFile,
    leaves: &str,
    size: Option<usize>,
    stored: usize,
) -> Result<usize> {
    let most = MOST_ZEROS.saturating_mul(stored);
    size.filter(|size| *size <= most).ok_or_else(|| {
        let problem = format!("leave less than one in {MOST_ZEROS} of the table");
        file.bad(leaves, problem)
    })
}
