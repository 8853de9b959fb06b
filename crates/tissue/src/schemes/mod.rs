//! The five simulation schemes, the `hard` regimes, and those that only serve training: `probe`, and the `static`
//! ones, which are lists of equilibria rather than motions (see [`crate::statics`]).
//!
//! A scheme fixes the magnitude, the number of collision faces and three functions
//! of time on [0, 8 s]: the push factor `p(t)` in [0, 1], the tilt `phi(t)` from the
//! inward normal and the turn `theta(t)` about it. Contact nodes are prescribed to
//! `magnitude * p(t) * direction(phi, theta)`; there is no contact where `p(t)` is
//! zero. As in the paper, only the site varies between the cases of a scheme.
//! Names, ranges and sources are in [`TABLE`]; `docs/guide/datasets.md` shows it, with a plot of each.

mod load;
mod programme;
mod random;
mod scheme;
mod slide;
mod table;

pub use load::{Draw, PROBE_S, Pose};
pub use programme::Programme;
pub use random::{Range, SplitMix};
pub use scheme::Scheme;
pub use table::{Group, PAPER_SECTION, Specification, TABLE};

/// Length of every simulation, s.
pub const DURATION_S: f64 = 8.0;
/// Time between frames, s.
pub const FRAME_S: f64 = 0.05;
/// Frames of a trajectory, rest included.
pub const FRAMES: usize = 161;

impl Scheme {
    /// Its row.
    pub fn specification(self) -> &'static Specification {
        &TABLE[self as usize]
    }

    /// The schemes of a group, in the table's order.
    pub fn of(group: Group) -> impl Iterator<Item = Scheme> {
        let rows = TABLE.iter().filter(move |row| row.group == group);
        rows.map(|row| row.scheme)
    }

    /// Whether its frames are equilibria of their own, found without time ([`crate::statics`]).
    pub fn is_static(self) -> bool {
        self.specification().group == Group::Static
    }

    /// Frames of a case, rest included.
    pub fn frames(self) -> usize {
        match self.specification() {
            row if self.is_static() => 1 + row.sites * row.depths,
            _ => FRAMES,
        }
    }

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        self.specification().name
    }

    /// Parses a list: `3`, `1-4`, `1,3`, `hard`, `hard-deep`.
    pub fn parse_list(text: &str) -> Result<Vec<Scheme>, String> {
        let mut schemes = Vec::new();
        for part in text.split(',').map(str::trim) {
            if part == "hard" {
                schemes.extend(Self::of(Group::Hard));
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
        self.specification().damping
    }
}

impl std::str::FromStr for Scheme {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let row = TABLE.iter().find(|row| row.name == text);
        row.map(|row| row.scheme).ok_or_else(|| {
            format!(
                "scheme `{text}` is unknown; use a range such as 1-4, `hard` for all hard ones, or one of {}",
                TABLE.map(|row| row.name).join(", ")
            )
        })
    }
}
