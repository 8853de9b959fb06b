//! Values of `--material`: the numbers of the body, or the law of a region.

use std::fmt;
use std::str::FromStr;

use elements::{Law, Region as LawRegion};

use crate::materials;

/// A value of `--material`.
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// Young's modulus, density and damping of the body by name.
    Numbers(String),
    /// The law of a region, and how it was written.
    Law(LawRegion, String),
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((name, law)) = text.split_once('=') else {
            return Ok(Self::Numbers(text.trim().to_owned()));
        };
        let name = name.trim().to_owned();
        if name.is_empty() {
            return Err(format!("`{text}` has no region before its equals sign"));
        }
        let own =
            materials::law(law.trim()).map_err(|error| format!("region `{name}`: {error}"))?;
        let region = LawRegion {
            source: materials::source_of(&own),
            law: own,
            name,
        };
        Ok(Self::Law(region, law.trim().to_owned()))
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Numbers(name) => to.write_str(name),
            Self::Law(region, law) => write!(to, "{}={law}", region.name),
        }
    }
}

/// The law of the whole body, for the provenance.
pub fn words(law: &Law) -> serde_json::Value {
    serde_json::json!({"law": law.to_string(), "source": materials::source_of(law)})
}
