//! The numbers of the body, or the law of a region.

use std::fmt;

use elements::{Law, Region as LawRegion};

/// A value of `--material`.
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// Young's modulus, density and damping of the body by name.
    Numbers(String),
    /// The law of a region, and how it was written.
    Law(LawRegion, String),
}

impl fmt::Display for Choice {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Numbers(name) => to.write_str(name),
            Self::Law(region, law) => {
                write!(to, "{}={law}", region.name)?;
                match region.density_kg_m3 {
                    None => Ok(()),
                    Some(density) => write!(to, "@{density}"),
                }
            }
        }
    }
}

/// The law of the whole body, for the provenance.
pub fn words(law: &Law, source: &str) -> serde_json::Value {
    serde_json::json!({"law": law.to_string(), "source": source})
}
