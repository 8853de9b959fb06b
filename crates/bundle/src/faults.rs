//! How the faults of a manifest are told: by field.

use field::error::{Error, Result};

/// File that the messages name.
pub(super) const FILE: &str = "bundle.json";

/// A fault of a field of the manifest.
pub(super) fn bad(field: &str, message: impl std::fmt::Display) -> Error {
    Error::bundle(FILE, format!("field `{field}`: {message}"))
}

/// That fault unless `ok`, with a message that says what the field must be.
pub(super) fn check(ok: bool, field: &str, message: &str) -> Result<()> {
    if ok { Ok(()) } else { Err(bad(field, message)) }
}
