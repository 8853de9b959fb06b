//! A recording as it grows: lines that the host has not taken yet. A line is written before what it tells of is done, so that there is room for it or nothing
//! is done, and counts once that has been done.

use std::borrow::Cow;
use std::io;

use ::contact::Body;
use serde::Serialize;

use super::drive::Instrument;
use super::lines::{Header, Line, Step};
use crate::contact::Tool;
use crate::error::{Error, Result};
use crate::memory;

const WHAT: &str = "a recording";
/// Stands for the hash of a step that has not been made.
const DIGEST: &str = "0000000000000000000000000000000000000000000000000000000000000000";
/// What follows it: the ends of the text, of the step, of its line, and of the line.
const AFTER: usize = "\"}}\n".len();

/// Lines for the host.
#[derive(Default)]
pub(crate) struct Recorder {
    /// Whole lines.
    text: Vec<u8>,
    begun: Begun,
    /// Shapes with lists that instruments have had, by the place of their lines; and those of them whose lines count.
    hulls: Vec<Body>,
    known: usize,
    /// A step whose number this divides gets a hash.
    every: u64,
    steps: u64,
    /// All that count, but for the first line.
    lines: u64,
    /// It has been ended.
    ended: bool,
}

/// The lines of what is being done.
#[derive(Default)]
struct Begun {
    text: Vec<u8>,
    /// How many they are.
    lines: u64,
    /// Whether the last of them is a step, and whether that waits for its hash.
    is_step: bool,
    wants_digest: bool,
}

impl Recorder {
    /// One that begins with a header and, where a scene is not at rest, its state.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(crate) fn new(header: &Header, every: u64, state: Option<Line<'_>>) -> Result<Recorder> {
        let mut own = Recorder {
            every,
            ..Recorder::default()
        };
        write(&mut own.text, header)?;
        if let Some(state) = state {
            own.open(&state)?;
            own.close(|| [0; 32]);
        }
        Ok(own)
    }

    /// Whether lines are still added.
    pub(crate) fn is_on(&self) -> bool {
        !self.ended
    }

    /// Begins a line.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; then there is none.
    pub(crate) fn open(&mut self, line: &Line<'_>) -> Result<()> {
        let written = write(&mut self.begun.text, line);
        let tried = |()| memory::tried(self.text.try_reserve(self.begun.text.len()), WHAT);
        let room = written.and_then(tried);
        if room.is_err() {
            self.drop_open();
        }
        room?;
        self.begun.lines += 1;
        Ok(())
    }

    /// Begins the line of a step, which gets a hash where it is due.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; then there is none.
    pub(crate) fn open_step(&mut self, mut step: Step<'_>) -> Result<()> {
        self.begun.is_step = true;
        self.begun.wants_digest = (self.steps + 1).is_multiple_of(self.every);
        step.sha256 = self.begun.wants_digest.then_some(Cow::Borrowed(DIGEST));
        self.open(&Line::Step(step))
    }

    /// An instrument for a line; a shape with lists gets a line of its own before.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(crate) fn instrument<'a>(&mut self, tool: &'a Tool) -> Result<Instrument<'a>> {
        use ::contact::Shape;
        if !matches!(tool.body.shape(), Shape::Hull { .. } | Shape::Mesh { .. }) {
            return Ok(Instrument::new(tool, None));
        }
        let found = self.hulls.iter().position(|own| own.is_same(&tool.body));
        let at = match found {
            Some(at) => at,
            None => {
                memory::push(&mut self.hulls, tool.body.clone(), WHAT)?;
                self.open(&Line::Hull(Cow::Borrowed(tool.body.shape())))?;
                self.hulls.len() - 1
            }
        };
        Ok(Instrument::new(tool, Some(at)))
    }

    /// What the lines begun tell of has been done; `digest` is asked for the hash of a step.
    pub(crate) fn close(&mut self, digest: impl FnOnce() -> [u8; 32]) {
        self.steps += u64::from(std::mem::take(&mut self.begun.is_step));
        if std::mem::take(&mut self.begun.wants_digest) {
            let end = self.begun.text.len() - AFTER;
            let digits = digest().into_iter().flat_map(|byte| [byte >> 4, byte & 15]);
            let places = &mut self.begun.text[end - DIGEST.len()..end];
            for (place, digit) in places.iter_mut().zip(digits) {
                *place = b"0123456789abcdef"[usize::from(digit)];
            }
        }
        // There is room.
        self.text.append(&mut self.begun.text);
        self.lines += std::mem::take(&mut self.begun.lines);
        self.known = self.hulls.len();
    }

    /// What the lines begun tell of has failed, and changed nothing.
    pub(crate) fn drop_open(&mut self) {
        self.begun.text.clear();
        self.begun.lines = 0;
        (self.begun.is_step, self.begun.wants_digest) = (false, false);
        self.hulls.truncate(self.known);
    }

    /// Writes the last line.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; the recording then goes on.
    pub(crate) fn end(&mut self) -> Result<()> {
        let lines = self.lines;
        self.open(&Line::End(lines))?;
        self.close(|| [0; 32]);
        self.ended = true;
        self.hulls = Vec::new();
        Ok(())
    }

    /// The lines that no one has taken.
    pub(crate) fn text(&self) -> &[u8] {
        &self.text
    }

    /// Forgets them.
    pub(crate) fn forget(&mut self) {
        self.text.clear();
    }

    /// Bytes of the heap.
    pub(crate) fn held_bytes(&self) -> usize {
        self.text.capacity() + self.begun.text.capacity()
    }
}

/// Adds a line.
fn write(to: &mut Vec<u8>, line: &impl Serialize) -> Result<()> {
    let start = to.len();
    let mut room = Room(to);
    let written = serde_json::to_writer(&mut room, line).map_err(io::Error::from);
    let written = written.and_then(|()| io::Write::write_all(&mut room, b"\n"));
    written.map_err(|error| {
        to.truncate(start);
        Error::OutOfMemory(format!("{WHAT}: {error}"))
    })
}

/// A list that asks for its room.
struct Room<'a>(&'a mut Vec<u8>);

impl io::Write for Room<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let room = self.0.try_reserve(bytes.len());
        room.map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
