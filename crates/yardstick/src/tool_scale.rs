//! How large the tools of the programmes are on a body (`--tool-scale`), and why.

use serde_json::{Value, json};
use tissue::mesh::Mesh;
use tissue::programmes::{BodySize, REFERENCE_THICKNESS_MM, REFERENCE_WIDTH_MM, ToolScale};

/// Deepest push of the programmes as they are written, mm.
pub const PUSH_MM: f64 = 15.0;

/// A scale, and what it follows from.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    pub scale: ToolScale,
    because: String,
}

impl Chosen {
    /// As asked, or from the body and, where a bundle is made for less deep pushes, from those.
    pub fn of(factor: Option<f64>, mesh: &Mesh, push_mm: Option<f64>) -> Self {
        if let Some(scale) = factor.and_then(|factor| ToolScale::of_factor(factor).ok()) {
            return Self {
                scale,
                because: "--tool-scale".into(),
            };
        }
        let size = BodySize::of(mesh);
        let body = ToolScale::of_body(size);
        let pushed = push_mm.map_or(body, |push| body.at_most(push / PUSH_MM));
        let because = if pushed == body {
            format!(
                "the body is {:.0} mm wide and {:.0} mm thick beneath its domain, the table's {REFERENCE_WIDTH_MM} and {REFERENCE_THICKNESS_MM}",
                size.width_mm, size.thickness_mm
            )
        } else {
            format!(
                "it is made for pushes of {:.1} mm, the table for {PUSH_MM}",
                push_mm.unwrap_or(PUSH_MM)
            )
        };
        Self {
            scale: pushed,
            because,
        }
    }

    /// A line for the user.
    pub fn words(&self) -> String {
        format!("tools have {} ({})", self.scale, self.because)
    }
}

/// In certificates.
impl Chosen {
    /// For a certificate.
    pub fn json(&self) -> Value {
        json!({
            "factor": self.scale.factor, "deepest_share_of_thickness": self.scale.deepest_share, "because": self.because,
        })
    }

    /// What a certificate states.
    pub fn stated(certificate: &Value) -> Option<Self> {
        let stated = &certificate["tool_sizes"];
        Some(Self {
            scale: ToolScale {
                factor: stated["factor"].as_f64()?,
                deepest_share: stated["deepest_share_of_thickness"].as_f64(),
            },
            because: stated["because"].as_str()?.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_push_makes_smaller_tools_and_a_certificate_keeps_them() {
        let mesh = tissue::mesh::box_phantom([90.0, 80.0, 50.0], [4, 4, 3]).unwrap();
        let auto = None;
        assert_eq!(Chosen::of(auto, &mesh, Some(16.0)).scale, ToolScale::TABLE);
        let half = Chosen::of(auto, &mesh, Some(7.5));
        assert_eq!(half.scale.factor, 0.5);
        assert!(
            half.words().contains("pushes of 7.5 mm"),
            "{}",
            half.words()
        );
        let asked = Some(2.0);
        assert_eq!(Chosen::of(asked, &mesh, Some(7.5)).scale.factor, 2.0);
        let stated = Chosen::stated(&json!({"tool_sizes": half.json()}));
        assert_eq!(stated, Some(half));
        assert_eq!(Chosen::stated(&json!({"tools": []})), None);
    }
}
