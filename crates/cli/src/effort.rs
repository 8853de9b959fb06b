//! How many corrections a step gets: `5`, or `10@0.02` for at most 10, fewer where the estimated error is below 0.02 mm.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Corrections a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Effort {
    /// At most so many; 0: none.
    #[serde(rename = "corrections", default)]
    pub most: u32,
    /// Fewer where the estimated error is below this, mm; 0: never.
    #[serde(
        rename = "corrections_target_mm",
        default,
        skip_serializing_if = "is_zero"
    )]
    pub target_mm: f32,
}

fn is_zero(target_mm: &f32) -> bool {
    *target_mm == 0.0
}

impl Effort {
    /// No corrections.
    pub const NONE: Effort = Effort::fixed(0);

    /// Just so many.
    pub const fn fixed(most: u32) -> Self {
        Self {
            most,
            target_mm: 0.0,
        }
    }
}

impl fmt::Display for Effort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.target_mm > 0.0 {
            write!(f, "{}@{}", self.most, self.target_mm)
        } else {
            write!(f, "{}", self.most)
        }
    }
}

impl FromStr for Effort {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is not a number of corrections: give 0 to 64, or COUNT@MM for at most COUNT, fewer where the estimated error is below MM"
            )
        };
        let (most, target) = match text.split_once('@') {
            Some((most, target)) => (most, Some(target)),
            None => (text, None),
        };
        let most: u32 = most.parse().map_err(|_| wrong())?;
        let target_mm: f32 = match target {
            None => 0.0,
            Some(target) => target.parse().map_err(|_| wrong())?,
        };
        let sound = target.is_none() || (target_mm.is_finite() && target_mm > 0.0 && most > 0);
        if most > 64 || !sound {
            return Err(wrong());
        }
        Ok(Self { most, target_mm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_targets_are_read_and_written() {
        for text in ["0", "5", "10@0.02"] {
            assert_eq!(text.parse::<Effort>().unwrap().to_string(), text);
        }
        for text in ["", "-1", "65", "3@", "3@0", "3@nan", "0@0.1", "@1", "x"] {
            assert!(text.parse::<Effort>().is_err(), "{text}");
        }
    }
}
