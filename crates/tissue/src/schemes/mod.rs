//! The five simulation schemes, the `hard` regimes, and those that only serve training: `probe`, and the `static`
//! ones, which are lists of equilibria rather than motions (see [`crate::statics`]).
//!
//! A scheme fixes the magnitude, the number of collision faces and three functions
//! of time on [0, 8 s]: the push factor `p(t)` in [0, 1], the tilt `phi(t)` from the
//! inward normal and the turn `theta(t)` about it. Contact nodes are prescribed to
//! `magnitude * p(t) * direction(phi, theta)`; there is no contact where `p(t)` is
//! zero. As in the paper, only the site varies between the cases of a scheme.
//! Scheme 3 is the paper's; the others follow its description (10 to 15 mm, 25 to
//! 100 faces, continuous functions). See `docs/guide/datasets.md` for a plot of each.

mod load;
mod programme;
mod random;
mod slide;

pub use load::{Draw, Pose};
pub use programme::Programme;
pub use random::SplitMix;

/// Length of every simulation, s.
pub const DURATION_S: f64 = 8.0;
/// Time between frames, s.
pub const FRAME_S: f64 = 0.05;
/// Frames of a trajectory, rest included.
pub const FRAMES: usize = 161;

/// A loading programme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scheme {
    /// Straight push, hold, slow release: 12 mm, 50 faces.
    One,
    /// Three presses of growing depth, tilt swinging to and fro: 10 mm, 25 faces.
    Two,
    /// The paper's: tilt pi/8, one full turn while pushing in, lifted at 6.5 s: 13 mm, 60 faces.
    Three,
    /// Quick push, then the direction slides while held, two-stage retreat: 15 mm, 100 faces.
    Four,
    /// Withheld from training: pulsating push, tilt growing, turning back and forth, lifted at 5.5 s: 12.5 mm, 75 faces.
    Five,
    /// 20 to 40 mm.
    HardDeep,
    /// Full depth in one or two frames, abrupt lift.
    HardFast,
    /// Two instruments at once.
    HardTwo,
    /// The contact slides along the surface.
    HardSlide,
    /// Scheme 3's load with a tenth of the damping.
    HardRing,
    /// For training: five sites in a row, each pushed, tilted and let go within 1.6 s. Sites are what a learned
    /// correction lacks, and 160 frames at one site say little more about it than 32.
    Probe,
    /// For training: static equilibria, eight sites with four depths each, up to 8 to 16 mm.
    Static,
    /// The same with two instruments at once.
    StaticTwo,
    /// The same with one instrument, up to 20 to 40 mm.
    StaticDeep,
}

impl Scheme {
    /// The paper's five.
    pub const NUMBERED: [Scheme; 5] = [
        Scheme::One,
        Scheme::Two,
        Scheme::Three,
        Scheme::Four,
        Scheme::Five,
    ];
    /// Regimes beyond them.
    pub const HARD: [Scheme; 5] = [
        Scheme::HardDeep,
        Scheme::HardFast,
        Scheme::HardTwo,
        Scheme::HardSlide,
        Scheme::HardRing,
    ];

    /// Lists of static equilibria.
    pub const STATIC: [Scheme; 3] = [Scheme::Static, Scheme::StaticTwo, Scheme::StaticDeep];

    /// Whether its frames are equilibria of their own, found without time ([`crate::statics`]).
    pub fn is_static(self) -> bool {
        Self::STATIC.contains(&self)
    }

    /// Frames of a case, rest included.
    pub fn frames(self) -> usize {
        if self.is_static() {
            1 + load::STATIC_SITES * load::STATIC_DEPTHS
        } else {
            FRAMES
        }
    }

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Scheme::One => "1",
            Scheme::Two => "2",
            Scheme::Three => "3",
            Scheme::Four => "4",
            Scheme::Five => "5",
            Scheme::HardDeep => "hard-deep",
            Scheme::HardFast => "hard-fast",
            Scheme::HardTwo => "hard-two",
            Scheme::HardSlide => "hard-slide",
            Scheme::HardRing => "hard-ring",
            Scheme::Probe => "probe",
            Scheme::Static => "static",
            Scheme::StaticTwo => "static-two",
            Scheme::StaticDeep => "static-deep",
        }
    }

    /// Parses a list: `3`, `1-4`, `1,3`, `hard`, `hard-deep`.
    pub fn parse_list(text: &str) -> Result<Vec<Scheme>, String> {
        let mut schemes = Vec::new();
        for part in text.split(',').map(str::trim) {
            if part == "hard" {
                schemes.extend(Self::HARD);
                continue;
            }
            let range = part
                .split_once('-')
                .and_then(|(a, b)| Some((a.parse::<usize>().ok()?, b.parse::<usize>().ok()?)));
            match range {
                Some((a, b)) if (1..=5).contains(&a) && (a..=5).contains(&b) => {
                    schemes.extend(&Self::NUMBERED[a - 1..b]);
                }
                _ => schemes.push(part.parse()?),
            }
        }
        Ok(schemes)
    }

    /// Damping of the regime relative to the material's.
    pub fn damping_factor(self) -> f64 {
        match self {
            Scheme::HardRing => 0.1,
            _ => 1.0,
        }
    }
}

impl std::str::FromStr for Scheme {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::NUMBERED
            .into_iter()
            .chain(Self::HARD)
            .chain([Scheme::Probe])
            .chain(Self::STATIC)
            .find(|scheme| scheme.name() == text)
            .ok_or_else(|| {
                format!(
                    "scheme `{text}` is unknown; use 1 to 5, a range such as 1-4, `hard`, `probe`, or one of {}, {}",
                    Self::HARD.map(Scheme::name).join(", "),
                    Self::STATIC.map(Scheme::name).join(", ")
                )
            })
    }
}
