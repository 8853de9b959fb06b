//! What commands say of lengths and places: the unit of a file, and how far a body spans.

use anyhow::{Result, bail};
use tissue::mesh_quality::Quality;

/// Millimetres a unit of a file, from the words of `--unit`.
///
/// # Errors
/// No such unit.
pub fn millimetres(unit: &str) -> Result<f64> {
    Ok(match unit {
        "mm" => 1.0,
        "cm" => 10.0,
        "m" => 1000.0,
        "in" => 25.4,
        other => match other.parse::<f64>() {
            Ok(scale) if scale.is_finite() && scale > 0.0 => scale,
            _ => {
                bail!("--unit is `{other}`; use mm, cm, m, in, or a number of millimetres per unit")
            }
        },
    })
}

/// From where to where along each axis.
pub fn span(quality: &Quality) -> String {
    let side = |k: usize| format!("{:.1} to {:.1}", quality.low_mm[k], quality.high_mm[k]);
    format!("x {}, y {}, z {} mm", side(0), side(1), side(2))
}
