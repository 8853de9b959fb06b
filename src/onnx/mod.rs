//! The only place that knows `ort`: finding the library, environment, providers, sessions.

use crate::error::{Error, Result};

/// JSON list of providers: `[{"name","available","reason"}]`. Loads ONNX Runtime.
pub fn providers_json() -> Result<String> {
    Err(Error::Unsupported("providers".into()))
}
