//! How large the tools and pushes are that a bundle is made for, from the body and the options.

use anyhow::{Result, bail};
use tissue::mesh::{Boundary, Mesh, face_area};
use tissue::programmes::{BodySize, ToolScale};

use super::options::Options;
use host::Effort;
use yardstick::tool_scale::PUSH_MM;

/// Areas that the checks' programmes have at scale 1, mm² (`tissue::schemes`).
const AREA_MM2: [f64; 2] = [60.0, 280.0];
/// Corrections that are recommended for pushes of [`PUSH_MM`], as the bundles that ship.
const CORRECTIONS: Effort = Effort {
    most: 10,
    target_mm: 0.02,
    substeps: 2,
};

/// How large tools and pushes are for this body.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Deepest push, mm.
    pub push_mm: f64,
    /// Area of a contact, mm².
    pub area_mm2: [f64; 2],
    boundary: Boundary,
    chosen: bool,
}

impl Sizes {
    /// From the option, or from the body's width and its thickness beneath the domain; a contact has room in the domain.
    pub fn of(options: &Options, mesh: &Mesh) -> Result<Self> {
        let scale = match options.push {
            Some(push) => push / PUSH_MM,
            None => ToolScale::of_body(BodySize::of(mesh)).factor,
        };
        let domain: f64 = mesh
            .domain
            .iter()
            .map(|&row| face_area(&mesh.positions, mesh.surface[row as usize]))
            .sum();
        let area_mm2 = AREA_MM2.map(|area| area * scale * scale);
        if domain < 1.3 * area_mm2[1] {
            bail!(
                "the domain has {domain:.0} mm², and a contact may take up to {:.0} mm²: widen --domain, or make the bundle for smaller tools with --push {:.1}",
                area_mm2[1],
                0.9 * PUSH_MM * scale * (domain / (1.3 * area_mm2[1])).sqrt()
            );
        }
        Ok(Self {
            push_mm: PUSH_MM * scale,
            area_mm2,
            boundary: options.boundary,
            chosen: options.push.is_some(),
        })
    }

    /// Corrections a step that the bundle recommends: as asked, or with a target that is the same part of the deepest push for every body.
    pub fn corrections(&self, options: &Options) -> Effort {
        options.corrections.unwrap_or_else(|| {
            let target = f64::from(CORRECTIONS.target_mm) * self.push_mm / PUSH_MM;
            // Two digits say enough.
            let short = format!("{target:.1e}")
                .parse()
                .unwrap_or(CORRECTIONS.target_mm);
            Effort {
                target_mm: short,
                ..CORRECTIONS
            }
        })
    }

    /// A line for the user.
    pub fn words(&self) -> String {
        format!(
            "made for pushes of up to {:.1} mm and contacts of {:.0} to {:.0} mm² ({})",
            self.push_mm,
            self.area_mm2[0],
            self.area_mm2[1],
            if self.chosen {
                "--push"
            } else {
                "from the body's width and its thickness there; --push changes it"
            }
        )
    }

    /// What the preview says besides the mesh.
    pub fn scene(&self, mesh: &Mesh) -> Vec<(String, String)> {
        vec![
            ("name".into(), mesh.name.clone()),
            ("nodes".into(), mesh.node_count().to_string()),
            ("tetrahedra".into(), mesh.tets.len().to_string()),
            (
                "held nodes".into(),
                mesh.held_nodes(self.boundary).len().to_string(),
            ),
            ("domain faces".into(), mesh.domain.len().to_string()),
            ("deepest push, mm".into(), format!("{:.1}", self.push_mm)),
        ]
    }
}
