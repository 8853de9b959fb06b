//! Bytes of a snapshot as text: base64 of RFC 4648, with padding.
//!
//! A line of a recording is JSON, which has no bytes. The text is written straight into the line,
//! without a string of its own: a snapshot of a large scene has megabytes.

use std::borrow::Cow;
use std::fmt;

use base64::Engine;
use base64::display::Base64Display;
use base64::engine::general_purpose::STANDARD;
use serde::de::{Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};

/// Bytes that a line holds as text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bytes<'a>(pub Cow<'a, [u8]>);

impl Serialize for Bytes<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&Base64Display::new(&self.0, &STANDARD))
    }
}

impl<'de> Deserialize<'de> for Bytes<'_> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(Text)
    }
}

/// Reads them. A line is read from a string that may be gone afterwards, so the bytes are owned.
struct Text;

impl Visitor<'_> for Text {
    type Value = Bytes<'static>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("bytes as base64")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Bytes<'static>, E> {
        let bytes = STANDARD.decode(text).map_err(E::custom)?;
        Ok(Bytes(Cow::Owned(bytes)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_holds_bytes_as_padded_text() {
        let bytes = Bytes(Cow::Borrowed(b"foob".as_slice()));
        assert_eq!(serde_json::to_string(&bytes).unwrap(), "\"Zm9vYg==\"");
        let read: Bytes<'_> = serde_json::from_str("\"Zm9vYg==\"").unwrap();
        assert_eq!(read, bytes);
        let wrong = serde_json::from_str::<Bytes<'_>>("\"Zm9*\"").unwrap_err();
        assert!(wrong.to_string().contains("Invalid symbol"), "{wrong}");
    }
}
