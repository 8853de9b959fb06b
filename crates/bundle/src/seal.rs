//! The manifest's own digest: `manifest_sha256` is the SHA-256 of `bundle.json` with these 64 digits written as zeros.
//!
//! REQ-002: Any altered byte of a sealed manifest is found when the bundle is opened.

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::faults::{FILE, bad};
use super::files::hex;
use field::error::{Error, Result};

const FIELD: &str = "manifest_sha256";
const DIGITS: usize = 64;

/// Compares a manifest's digest with its bytes. One without a digest, as they were made before there was one, is taken.
pub(super) fn check(bytes: &[u8], manifest: &Value) -> Result<()> {
    let stated = match manifest.get(FIELD) {
        None => {
            tracing::warn!("{FILE}: no `{FIELD}`; `python -m upt_training seal BUNDLE` adds it");
            return Ok(());
        }
        Some(Value::String(text)) if text.len() == DIGITS => text,
        Some(_) => return Err(bad(FIELD, "must be 64 hex digits")),
    };
    // By bytes and not by the parsed value: the digest is of the file as it lies there.
    let places: Vec<usize> = bytes
        .windows(DIGITS)
        .enumerate()
        .filter(|(_, window)| *window == stated.as_bytes())
        .map(|(at, _)| at)
        .collect();
    let [at] = places[..] else {
        return Err(bad(
            FIELD,
            "must appear in the file exactly once, as plain text",
        ));
    };
    let mut hash = Sha256::new();
    hash.update(&bytes[..at]);
    hash.update([b'0'; DIGITS]);
    hash.update(&bytes[at + DIGITS..]);
    let found = hex(&hash.finalize());
    if found == *stated {
        return Ok(());
    }
    Err(Error::bundle(
        FILE,
        format!(
            "field `{FIELD}` says {stated}, the file has {found}: it was damaged or changed; fetch or make the bundle again, or, \
             after a change of your own, run `python -m upt_training seal BUNDLE`"
        ),
    ))
}
