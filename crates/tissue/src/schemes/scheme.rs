//! The schemes by name.

/// A row of [`super::TABLE`], by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scheme {
    One,
    Two,
    Three,
    Four,
    /// Withheld from training.
    Five,
    HardDeep,
    HardFast,
    HardTwo,
    HardSlide,
    HardRing,
    /// Many sites in a row. Sites are what a learned correction lacks, and 160 frames at one site say little more
    /// about it than 32.
    Probe,
    Static,
    StaticTwo,
    StaticDeep,
}

impl Scheme {
    /// Number of schemes.
    pub const COUNT: usize = Scheme::StaticDeep as usize + 1;
    /// The paper's five.
    pub const NUMBERED: [Scheme; 5] = [
        Scheme::One,
        Scheme::Two,
        Scheme::Three,
        Scheme::Four,
        Scheme::Five,
    ];
}
