//! Bytes of a snapshot as text: base64 of RFC 4648, with padding.

use std::borrow::Cow;
use std::fmt;

use serde::de::{Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};

const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Bytes that a line holds as text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bytes<'a>(pub Cow<'a, [u8]>);

impl fmt::Display for Bytes<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for part in self.0.chunks(3) {
            let mut whole = [0; 3];
            whole[..part.len()].copy_from_slice(part);
            let [a, b, c] = whole.map(u32::from);
            let bits = a << 16 | b << 8 | c;
            let mut text = [18, 12, 6, 0].map(|by| DIGITS[(bits >> by & 63) as usize]);
            text[part.len() + 1..].fill(b'=');
            out.write_str(std::str::from_utf8(&text).map_err(|_| fmt::Error)?)?;
        }
        Ok(())
    }
}

impl Serialize for Bytes<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Bytes<'_> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(Text)
    }
}

struct Text;

impl Visitor<'_> for Text {
    type Value = Bytes<'static>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("bytes as base64")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Bytes<'static>, E> {
        let bytes = read(text.as_bytes()).ok_or_else(|| E::custom("the text is not base64"))?;
        Ok(Bytes(Cow::Owned(bytes)))
    }
}

/// None for what [`Bytes`] does not write.
fn read(text: &[u8]) -> Option<Vec<u8>> {
    let filled = text
        .iter()
        .rev()
        .take_while(|&&digit| digit == b'=')
        .count();
    if !text.len().is_multiple_of(4) || filled > 2 {
        return None;
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let digits = &text[..text.len() - filled];
    for part in digits.chunks(4) {
        let mut bits = 0;
        for &digit in part {
            bits = bits << 6 | DIGITS.iter().position(|&one| one == digit)? as u32;
        }
        bits <<= 6 * (4 - part.len());
        bytes.extend_from_slice(&bits.to_be_bytes()[1..part.len()]);
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_nothing_else() {
        let known = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
        ];
        for (bytes, text) in known {
            assert_eq!(Bytes(Cow::Borrowed(bytes.as_bytes())).to_string(), text);
            assert_eq!(read(text.as_bytes()).as_deref(), Some(bytes.as_bytes()));
        }
        let all: Vec<u8> = (0..=255).collect();
        let text = Bytes(Cow::Borrowed(&all)).to_string();
        assert_eq!(read(text.as_bytes()), Some(all));
        for wrong in ["Zg=", "Z===", "Zm9*", "Zg==Zg=="] {
            assert_eq!(read(wrong.as_bytes()), None, "{wrong}");
        }
    }
}
