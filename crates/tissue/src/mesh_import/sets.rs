//! Named sets by balls: what is held, what may be touched, where the skull is open.

use super::ImportError;
use crate::mesh::{Mesh, face_centroid};
use std::str::FromStr;

/// A ball `x,y,z,r`, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    pub centre: [f64; 3],
    pub radius: f64,
}

impl Ball {
    pub(super) fn holds(&self, point: [f64; 3]) -> bool {
        let squared: f64 = (0..3).map(|k| (point[k] - self.centre[k]).powi(2)).sum();
        squared <= self.radius * self.radius
    }
}

impl FromStr for Ball {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f64> = text
            .split(',')
            .map(|part| part.trim().parse::<f64>().ok().filter(|x| x.is_finite()))
            .collect::<Option<_>>()
            .unwrap_or_default();
        match numbers[..] {
            [x, y, z, radius] if radius > 0.0 => Ok(Self {
                centre: [x, y, z],
                radius,
            }),
            _ => Err(format!(
                "`{text}` is not a ball; write x,y,z,r in mm with r above 0"
            )),
        }
    }
}

/// Fills the mesh's named sets from the balls.
pub fn select(
    mesh: &mut Mesh,
    fixed: &[Ball],
    domain: &[Ball],
    window: &[Ball],
) -> Result<(), ImportError> {
    let inside = |balls: &[Ball], point: [f64; 3]| balls.iter().any(|ball| ball.holds(point));
    let at = |node: u32| mesh.positions[node as usize].map(f64::from);
    let held: Vec<u32> = (0..mesh.node_count() as u32)
        .filter(|&node| inside(fixed, at(node)))
        .collect();
    let touched: Vec<u32> = (0..mesh.surface.len() as u32)
        .filter(|&row| {
            let face = mesh.surface[row as usize];
            inside(domain, face_centroid(&mesh.positions, face))
        })
        .collect();
    let mut supported = Vec::new();
    if !window.is_empty() {
        supported.extend(mesh.surface.iter().flatten().copied());
        supported.sort_unstable();
        supported.dedup();
        supported.retain(|&node| !inside(window, at(node)) && held.binary_search(&node).is_err());
    }
    let empty = |set, what| {
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for p in &mesh.positions {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        ImportError::EmptySelection {
            set,
            what,
            low,
            high,
        }
    };
    if !fixed.is_empty() && held.is_empty() {
        return Err(empty("fixed", "node"));
    }
    if !domain.is_empty() && touched.is_empty() {
        return Err(empty("domain", "surface face"));
    }
    mesh.fixed = held;
    mesh.domain = touched;
    mesh.supported = supported;
    Ok(())
}
