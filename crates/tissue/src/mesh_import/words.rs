//! Files as lines and words: numbers whose errors name the line.

use super::ImportError;
use super::error::{Fault, fault};
use std::borrow::Cow;
use std::path::Path;

/// The bytes of a regular file.
pub fn bytes_of(path: &Path) -> Result<Vec<u8>, ImportError> {
    crate::regular_file::read(path).map_err(|error| ImportError::Io {
        path: path.into(),
        error,
    })
}

/// Without a byte order mark, which editors on Windows put in front.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// The text of a file. Names and comments may be in any encoding, so that what is not UTF-8 becomes a replacement character; a
/// line may end as on old Macintoshes.
pub fn text(bytes: &[u8]) -> Cow<'_, str> {
    let text = String::from_utf8_lossy(without_mark(bytes));
    if text.contains('\r') && !text.contains('\n') {
        return text.replace('\r', "\n").into();
    }
    text
}

/// A number, also with the exponent that Fortran writes (`1.5D3`).
pub fn real(word: &str, line: usize) -> Result<f64, Fault> {
    if let Ok(number) = word.parse() {
        return Ok(number);
    }
    match word.replace(['D', 'd'], "e").parse() {
        Ok(number) => Ok(number),
        Err(_) => fault(format!("line {line}: `{}` is not a number", short(word))),
    }
}

/// A whole number that is not negative.
pub fn whole(word: &str, line: usize) -> Result<u64, Fault> {
    match word.trim().parse() {
        Ok(number) => Ok(number),
        Err(_) => fault(format!(
            "line {line}: `{}` is not a whole number",
            short(word)
        )),
    }
}

/// The beginning of a word, for a message.
pub fn short(word: &str) -> Cow<'_, str> {
    match word.char_indices().nth(40) {
        Some((end, _)) => format!("{}...", &word[..end]).into(),
        None => word.into(),
    }
}

/// The words of a text, each with the number of its line; from a `#` on, a line is a comment.
pub struct Words<'a> {
    text: &'a str,
    line: usize,
}

impl<'a> Words<'a> {
    pub fn new(text: &'a str) -> Self {
        Self { text, line: 1 }
    }

    /// The words of a text that begins at a line of its file.
    pub fn from_line(text: &'a str, line: usize) -> Self {
        Self { text, line }
    }

    /// The line that has been reached, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// The next word, or none at the end.
    pub fn next(&mut self) -> Option<&'a str> {
        loop {
            let start = self.text.find(|c: char| !c.is_ascii_whitespace());
            let (space, rest) = self.text.split_at(start.unwrap_or(self.text.len()));
            self.line += space.bytes().filter(|b| *b == b'\n').count();
            self.text = rest;
            if rest.is_empty() {
                return None;
            }
            if !rest.starts_with('#') {
                let end = rest.find(|c: char| c.is_ascii_whitespace());
                let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
                self.text = rest;
                return Some(word);
            }
            self.text = &rest[rest.find('\n').unwrap_or(rest.len())..];
        }
    }

    /// The next word, which stays the next.
    pub fn peek(&self) -> Option<&'a str> {
        Self {
            text: self.text,
            line: self.line,
        }
        .next()
    }

    fn due(&mut self, what: &str) -> Result<&'a str, Fault> {
        match self.next() {
            Some(word) => Ok(word),
            None => fault(format!(
                "line {}: the file ends where {what} is due: is it cut off?",
                self.line
            )),
        }
    }

    pub fn real(&mut self) -> Result<f64, Fault> {
        let word = self.due("a number")?;
        real(word, self.line)
    }

    pub fn point(&mut self) -> Result<[f64; 3], Fault> {
        Ok([self.real()?, self.real()?, self.real()?])
    }

    pub fn whole(&mut self) -> Result<u64, Fault> {
        let word = self.due("a whole number")?;
        whole(word, self.line)
    }

    /// A count of rows of so many words, which the rest of the file must be able to hold.
    pub fn count(&mut self, what: &str, words: usize) -> Result<usize, Fault> {
        let count = self.whole()?;
        // A word takes two bytes at least.
        let most = 1 + self.text.len() / (2 * words.max(1));
        match usize::try_from(count).ok().filter(|count| *count <= most) {
            Some(count) => Ok(count),
            None => fault(format!(
                "line {}: the file announces {count} {what} but is too short for them: is it cut off?",
                self.line
            )),
        }
    }
}
