//! How large loads may be.

use crate::error::{Error, Result};

/// The largest force on a node or at a point, in each direction, mN.
pub const LARGEST_FORCE: f32 = 1e6;
/// The largest pressure, Pa: ten times that of the air.
pub const LARGEST_PRESSURE: f32 = 1e6;

pub(super) const WHAT: &str = "the loads of a scene";

pub(super) fn check_size(
    value: f32,
    most: f32,
    unit: &str,
    name: impl Fn() -> String,
) -> Result<()> {
    if !value.is_finite() {
        return Err(Error::NonFinite(format!("{} is {value}", name())));
    }
    if value.abs() > most {
        return Err(Error::Argument(format!(
            "{} is {value} {unit}, must be at most {most}",
            name()
        )));
    }
    Ok(())
}
