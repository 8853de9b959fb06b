//! How the faults of a manifest are told: by field.

use field::error::{Error, Result};

/// File that the messages name.
pub(super) const FILE: &str = "bundle.json";

pub(super) fn bad(field: &str, message: impl std::fmt::Display) -> Error {
    Error::bundle(FILE, format!("field `{field}`: {message}"))
}

pub(super) fn check(ok: bool, field: &str, message: &str) -> Result<()> {
    if ok { Ok(()) } else { Err(bad(field, message)) }
}
