//! A legacy VTK file as words, lines and numbers, text or big-endian bytes. Counts are held against what is left of the file.

use super::super::error::{Fault, fault};
use super::super::words::{real, short};
use super::kinds::Kind;
use std::borrow::Cow;

/// Walks the bytes of a file.
pub struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Whether the numbers that come next are binary; words never are.
    pub is_binary: bool,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            is_binary: false,
        }
    }

    /// Where it stands, for a message.
    pub fn place(&self) -> String {
        let before = &self.bytes[..self.at];
        format!(
            "line {}",
            1 + before.iter().filter(|b| **b == b'\n').count()
        )
    }

    /// The rest of the line, and past it.
    pub fn line(&mut self) -> Cow<'a, str> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| *b == b'\n');
        let line = &rest[..end.unwrap_or(rest.len())];
        self.at += end.map_or(rest.len(), |end| end + 1);
        String::from_utf8_lossy(line)
    }

    /// Past the metadata of an array of this width, which end with an empty line; names of components may be empty too.
    pub fn skip_metadata(&mut self, width: usize) {
        self.line();
        loop {
            let line = self.line();
            if line.trim() == "COMPONENT_NAMES" {
                for _ in 0..width.min(self.bytes.len() - self.at) {
                    self.line();
                }
            } else if line.trim().is_empty() {
                return;
            }
        }
    }

    /// The next word, or none at the end.
    pub fn keyword(&mut self) -> Option<&'a str> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let word = &rest[start..];
        let end = word.iter().position(u8::is_ascii_whitespace);
        let word = &word[..end.unwrap_or(word.len())];
        self.at += start + word.len();
        // What is not UTF-8 can only be a name.
        Some(std::str::from_utf8(word).unwrap_or("?"))
    }

    /// The next word.
    pub fn word(&mut self) -> Result<&'a str, Fault> {
        match self.keyword() {
            Some(word) => Ok(word),
            None => fault("the file ends too early: is it cut off?"),
        }
    }

    /// Whether the next word begins so; blanks before it are skipped if it does.
    pub fn is_next(&mut self, word: &[u8]) -> bool {
        let rest = &self.bytes[self.at..];
        let is_next = rest.trim_ascii_start().starts_with(word);
        if is_next {
            self.at += rest.len() - rest.trim_ascii_start().len();
        }
        is_next
    }

    /// A whole number of things.
    pub fn count(&mut self) -> Result<usize, Fault> {
        let word = self.word()?;
        match word.parse() {
            Ok(count) => Ok(count),
            Err(_) => fault(format!("`{}` is not a count", short(word))),
        }
    }

    /// A type, and past its line.
    pub fn kind(&mut self) -> Result<Kind, Fault> {
        let word = self.word()?;
        let Some(kind) = Kind::of_legacy(word) else {
            return fault(format!("`{}` is no type of numbers", short(word)));
        };
        if kind == Kind::Bit {
            return fault("bits are neither coordinates nor nodes");
        }
        self.line();
        Ok(kind)
    }

    /// So many numbers.
    pub fn reals(&mut self, kind: Kind, count: usize) -> Result<Vec<f64>, Fault> {
        if !self.is_binary {
            return self.texts(count, |word| real(word, 0).ok());
        }
        let mut numbers = kind.reals(self.taken(kind, count)?, true);
        numbers.truncate(count); // Bits fill whole bytes.
        Ok(numbers)
    }

    /// So many whole numbers.
    pub fn wholes(&mut self, kind: Kind, count: usize) -> Result<Vec<i64>, Fault> {
        if !self.is_binary {
            return self.texts(count, |word| word.parse().ok());
        }
        Ok(kind.wholes(self.taken(kind, count)?, true))
    }

    fn texts<T>(
        &mut self,
        count: usize,
        number: impl Fn(&str) -> Option<T>,
    ) -> Result<Vec<T>, Fault> {
        // A word takes two bytes at least.
        if count > 1 + (self.bytes.len() - self.at) / 2 {
            return fault(format!(
                "{count} numbers are announced, more than the rest of the file can hold: is it cut off?"
            ));
        }
        let mut out = Vec::with_capacity(count);
        for _ in 0..count {
            let word = self.word()?;
            match number(word) {
                Some(number) => out.push(number),
                None => return fault(format!("`{}` is not a number", short(word))),
            }
        }
        Ok(out)
    }

    fn taken(&mut self, kind: Kind, count: usize) -> Result<&'a [u8], Fault> {
        let rest = &self.bytes[self.at..];
        let taken = kind.bytes_of(count).and_then(|length| rest.get(..length));
        let Some(taken) = taken else {
            return fault(format!(
                "{count} numbers are announced, more than the rest of the file can hold: is it cut off?"
            ));
        };
        self.at += taken.len();
        Ok(taken)
    }

    /// Texts: a line each, or behind a length whose two highest bits say how many bytes it has.
    pub fn skip_texts(&mut self, count: usize) -> Result<(), Fault> {
        for _ in 0..count {
            let rest = &self.bytes[self.at..];
            let Some(&first) = rest.first() else {
                return fault("the file ends inside a list of texts: is it cut off?");
            };
            if !self.is_binary {
                self.line();
                continue;
            }
            let bytes = [8, 4, 2, 1][usize::from(first >> 6)];
            let head = rest.get(..bytes).unwrap_or_default();
            let length = head
                .iter()
                .fold(0u64, |sum, &byte| sum << 8 | u64::from(byte));
            let length = usize::try_from(length & (u64::MAX >> (66 - 8 * bytes))).ok();
            let end = length.and_then(|length| self.at.checked_add(bytes)?.checked_add(length));
            match end.filter(|end| !head.is_empty() && *end <= self.bytes.len()) {
                Some(end) => self.at = end,
                None => return fault("a text reaches beyond the end: is the file cut off?"),
            }
        }
        Ok(())
    }
}
