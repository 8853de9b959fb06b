//! The process-wide part: options that hold for all models, and when they may change.

use crate::error::Result;
use crate::options::InitOptions;

/// Sets the process-wide options; the first model does it with the defaults. A second call with other options is
/// [`crate::Error::State`].
pub fn init(options: &InitOptions) -> Result<()> {
    let _ = options;
    Ok(())
}

/// Ends the process-wide part; [`crate::Error::State`] while models or scenes live.
pub fn shutdown() -> Result<()> {
    Ok(())
}
