//! Random numbers that a case is drawn from.

/// Lowest and highest value of a draw.
pub type Range = [f64; 2];

/// SplitMix64 (Steele et al. 2014): the same numbers on every platform and in every version.
pub struct SplitMix(pub u64);

impl SplitMix {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, [low, high]: Range) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A speed in [low, high), even in the logarithm: speeds span decades.
    pub fn speed(&mut self, [low, high]: Range) -> f64 {
        low * (high / low).powf(self.unit())
    }

    /// One of `count` things.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count.saturating_sub(1))
    }
}
