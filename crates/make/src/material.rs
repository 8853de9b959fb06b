//! The numbers of the body, or the law of a region.

use std::fmt;

use elements::{Law, Region as LawRegion};

/// What stands for the relaxation of a region that has none, in a body that relaxes.
pub const ELASTIC: &str = "none";

/// A value of `--material`.
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// Young's modulus, density and damping of the body by name.
    Numbers(String),
    /// The law of a region, and how it was written.
    Law(Box<LawRegion>, String),
}

impl fmt::Display for Choice {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Numbers(name) => to.write_str(name),
            Self::Law(region, law) => {
                write!(to, "{}={law}", region.name)?;
                if let Some(density) = region.density_kg_m3 {
                    write!(to, "@{density}")?;
                }
                match region.relaxation {
                    None => Ok(()),
                    Some(own) if own.is_empty() => write!(to, "~{ELASTIC}"),
                    Some(own) => write!(to, "~{own}"),
                }
            }
        }
    }
}

/// The law of the whole body, for the provenance.
pub fn words(law: &Law, source: &str) -> serde_json::Value {
    serde_json::json!({"law": law.to_string(), "source": source})
}
