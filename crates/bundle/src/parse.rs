//! The bytes of `bundle.json` -> a [`Manifest`], checked.

use serde::Deserialize;

use super::faults::{FILE, bad, check};
use super::manifest::Manifest;
use super::{known, seal};
use field::error::{Error, Result};

const VERSION: u64 = 1;

#[derive(Deserialize)]
/// Read first, so that a bundle of another format is refused by these and not by a missing field.
struct Header {
    format: String,
    version: u64,
}

/// Errors name the path of the field.
fn parse<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T> {
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        bad(&path, error.inner())
    })
}

impl Manifest {
    /// Parses and checks the bytes of `bundle.json`.
    pub fn parse(bytes: &[u8]) -> Result<Manifest> {
        let header: Header = parse(bytes)?;
        check(
            header.format == "upt-bundle",
            "format",
            "must be `upt-bundle`",
        )?;
        if header.version != VERSION {
            return Err(Error::Version(format!(
                "{FILE}: field `version` is {}, this library reads version {VERSION}",
                header.version
            )));
        }
        // Three readings of the same bytes: header, raw fields for what serde leaves out, and the
        // values.
        let fields: serde_json::Value = parse(bytes)?;
        seal::check(bytes, &fields)?;
        known::check(&fields)?;
        let manifest: Manifest = parse(bytes)?;
        manifest.check()?;
        Ok(manifest)
    }
}
