//! A Gmsh file as words of text and binary numbers of either byte order.

use crate::mesh_import::error::{Fault, fault};
use crate::mesh_import::words::short;

/// Walks the bytes of a file, text or binary.
pub struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    pub binary: bool,
    pub swapped: bool,
}

impl<'a> Cursor<'a> {
    /// To the next byte that is no white space.
    pub fn skip_space(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// The next word of text.
    pub fn word(&mut self) -> Result<&'a str, Fault> {
        self.skip_space();
        let start = self.at;
        while self
            .bytes
            .get(self.at)
            .is_some_and(|b| !b.is_ascii_whitespace())
        {
            self.at += 1;
        }
        if start == self.at {
            return fault("the file ends too early");
        }
        std::str::from_utf8(&self.bytes[start..self.at])
            .or_else(|_| fault(format!("byte {start}: not text where text is due")))
    }

    /// To the first byte of a binary block.
    pub fn begin_block(&mut self) {
        if self.binary {
            self.end_line();
        }
    }

    /// Past the end of the line, which opens a binary block.
    pub fn end_line(&mut self) {
        while self.at < self.bytes.len() && self.bytes[self.at] != b'\n' {
            self.at += 1;
        }
        self.at = (self.at + 1).min(self.bytes.len());
    }

    /// Bytes of a binary number, the lowest first.
    pub fn raw<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let Some(chunk) = self.bytes.get(self.at..self.at + N) else {
            return fault("the file ends inside a binary block");
        };
        self.at += N;
        let mut out = [0; N];
        out.copy_from_slice(chunk);
        if self.swapped {
            out.reverse();
        }
        Ok(out)
    }

    /// A number of text.
    pub fn parsed<T: std::str::FromStr>(&mut self) -> Result<T, Fault> {
        let word = self.word()?;
        word.parse().or_else(|_| {
            fault(format!(
                "`{}` (before byte {}) is not a number",
                short(word),
                self.at
            ))
        })
    }

    /// What is between quotes, in text.
    pub fn quoted(&mut self) -> Result<String, Fault> {
        self.skip_space();
        let rest = self.bytes[self.at..].strip_prefix(b"\"");
        let end = rest.and_then(|rest| rest.iter().position(|byte| *byte == b'"'));
        let (Some(rest), Some(end)) = (rest, end) else {
            return fault(format!(
                "byte {}: the name of a physical group has no quotes",
                self.at
            ));
        };
        self.at += end + 2;
        Ok(String::from_utf8_lossy(&rest[..end]).into_owned())
    }

    /// A 4-byte integer where binary.
    pub fn int(&mut self) -> Result<i64, Fault> {
        if self.binary {
            Ok(i64::from(i32::from_le_bytes(self.raw()?)))
        } else {
            self.parsed()
        }
    }

    /// An 8-byte size where binary.
    pub fn size(&mut self) -> Result<u64, Fault> {
        if self.binary {
            Ok(u64::from_le_bytes(self.raw()?))
        } else {
            self.parsed()
        }
    }

    /// A coordinate.
    pub fn real(&mut self) -> Result<f64, Fault> {
        if self.binary {
            Ok(f64::from_le_bytes(self.raw()?))
        } else {
            self.parsed()
        }
    }

    /// This word.
    pub fn expect(&mut self, wanted: &str) -> Result<(), Fault> {
        match self.word()? {
            word if word == wanted => Ok(()),
            word => fault(format!("`{}` where `{wanted}` is due", short(word))),
        }
    }

    /// Past the line `$End<section>`.
    pub fn skip_section(&mut self, section: &str) -> Result<(), Fault> {
        let end = format!("$End{section}");
        match self.bytes[self.at..]
            .windows(end.len())
            .position(|window| window == end.as_bytes())
        {
            Some(offset) => {
                self.at += offset + end.len();
                Ok(())
            }
            None => fault(format!("section ${section} has no {end}")),
        }
    }
}
