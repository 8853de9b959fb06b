//! The laws whose part by `I1` grows with it, as one: their kernels are the same code.

use super::growth::Growing;
use super::veronda_westmann::VerondaWestmann;
use super::yeoh::Yeoh;
use lanes::FunctionLanes;

/// A law whose part by `I1` grows with it.
#[derive(Clone, Copy)]
pub(crate) enum Grows {
    Yeoh(Yeoh),
    VerondaWestmann(VerondaWestmann),
}

impl Growing for Grows {
    const GROWTH_FLOPS: usize = match Yeoh::GROWTH_FLOPS > VerondaWestmann::GROWTH_FLOPS {
        true => Yeoh::GROWTH_FLOPS,
        false => VerondaWestmann::GROWTH_FLOPS,
    };

    fn parts(self) -> [f64; 2] {
        match self {
            Self::Yeoh(law) => law.parts(),
            Self::VerondaWestmann(law) => law.parts(),
        }
    }

    fn stored(self, x: f64) -> f64 {
        match self {
            Self::Yeoh(law) => law.stored(x),
            Self::VerondaWestmann(law) => law.stored(x),
        }
    }

    fn growth(self, x: f64) -> [f64; 2] {
        match self {
            Self::Yeoh(law) => law.growth(x),
            Self::VerondaWestmann(law) => law.growth(x),
        }
    }

    #[inline(always)]
    unsafe fn lane_growth<L: FunctionLanes>(self, x: L) -> L {
        // SAFETY: the caller's.
        unsafe {
            match self {
                Self::Yeoh(law) => law.lane_growth(x),
                Self::VerondaWestmann(law) => law.lane_growth(x),
            }
        }
    }
}
