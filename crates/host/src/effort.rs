//! How many corrections a step gets: `5`, or `10@0.02` for at most 10, fewer where the estimated error is below 0.02 mm; and `10@0.02/4` for
//! four substeps where a step that tools drive would miss that.

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
    /// Substeps where a step would miss the target; 1: none, 0: as the bundle recommends.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub substeps: u32,
}

fn is_zero<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Effort {
    /// No corrections.
    pub const NONE: Effort = Effort::fixed(0);

    /// Just so many.
    pub const fn fixed(most: u32) -> Self {
        Self {
            most,
            target_mm: 0.0,
            substeps: 0,
        }
    }
}

impl fmt::Display for Effort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.most)?;
        if self.target_mm > 0.0 {
            write!(f, "@{}", self.target_mm)?;
        }
        match self.substeps {
            0 => Ok(()),
            count => write!(f, "/{count}"),
        }
    }
}

impl FromStr for Effort {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is not a number of corrections: give 0 to 64, or COUNT@MM for at most COUNT and fewer once the estimated error is below MM; append /SUBSTEPS (1 to 8) for steps that miss MM"
            )
        };
        let (most, target, substeps) = match text.split_once('@') {
            Some((most, target)) => match target.split_once('/') {
                Some((target, substeps)) => (most, Some(target), Some(substeps)),
                None => (most, Some(target), None),
            },
            None => (text, None, None),
        };
        let most: u32 = most.parse().map_err(|_| wrong())?;
        let target_mm: f32 = match target {
            None => 0.0,
            Some(target) => target.parse().map_err(|_| wrong())?,
        };
        let sound = target.is_none() || (target_mm.is_finite() && target_mm > 0.0 && most > 0);
        let substeps: u32 = substeps.map_or(Ok(0), |count| count.parse().map_err(|_| wrong()))?;
        let counts = text.contains('/');
        if most > 64 || !sound || (counts && !(1..=8).contains(&substeps)) {
            return Err(wrong());
        }
        Ok(Self {
            most,
            target_mm,
            substeps,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_targets_are_read_and_written() {
        for text in ["0", "5", "10@0.02", "10@0.02/4"] {
            assert_eq!(text.parse::<Effort>().unwrap().to_string(), text);
        }
        let wrong = [
            "", "-1", "65", "3@", "3@0", "3@nan", "0@0.1", "@1", "x", "3/4", "3@1/0", "3@1/9",
            "3@1/",
        ];
        for text in wrong {
            assert!(text.parse::<Effort>().is_err(), "{text}");
        }
    }
}
