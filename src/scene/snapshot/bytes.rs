//! Numbers and lists of a snapshot, little-endian, checked as they are read.

use super::Pairs;
use crate::corrections::Motion;
use crate::error::{Error, Result};
use crate::memory;
use crate::scene::Contact;
use crate::scene::contact::ContactSet;
use crate::scene::counters::{Counters, Source};

/// What is written.
pub(super) struct Writer(pub(super) Vec<u8>);

impl Writer {
    pub(super) fn u32(&mut self, value: u32) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn floats(&mut self, values: &[f32]) {
        self.u32(values.len() as u32);
        for value in values {
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    pub(super) fn indices(&mut self, values: &[u32]) {
        self.u32(values.len() as u32);
        values.iter().for_each(|&value| self.u32(value));
    }

    /// All counters but `was_corrected`, which stands behind the lists of corrections.
    pub(super) fn counters(&mut self, counters: &Counters) {
        let Counters {
            step_count,
            quiet,
            sleeping,
            rest_frames,
            source,
            source_before,
            max_displacement,
            was_corrected: _,
        } = *counters;
        self.u32(step_count as u32);
        self.u32((step_count >> 32) as u32);
        self.u32(quiet);
        self.u32(u32::from(sleeping));
        self.u32(rest_frames);
        self.u32(source_code(source));
        self.u32(source_code(source_before));
        self.u32(max_displacement.to_bits());
    }
}

fn source_code(source: Source) -> u32 {
    match source {
        Source::Rest => 0,
        Source::Model => 1,
        Source::Fallback => 2,
    }
}

/// What is left to read.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl<'a> Reader<'a> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        if count > self.0.len() {
            return Err(Error::Snapshot("is cut short".into()));
        }
        let (head, tail) = self.0.split_at(count);
        self.0 = tail;
        Ok(head)
    }

    pub(super) fn u32(&mut self) -> Result<u32> {
        let b = self.take(4)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    pub(super) fn f32(&mut self) -> Result<f32> {
        let value = f32::from_bits(self.u32()?);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Error::Snapshot("holds a value that is not finite".into()))
        }
    }

    /// Floats of exactly this many.
    pub(super) fn floats(&mut self, count: usize) -> Result<Vec<f32>> {
        let stored = self.u32()? as usize;
        if stored != count {
            return Err(Error::Snapshot(format!(
                "holds a list of {stored} numbers, must have {count}"
            )));
        }
        let mut list = memory::room(count, "a snapshot")?;
        for b in self.take(4 * count)?.chunks_exact(4) {
            list.push(Reader(b).f32()?);
        }
        Ok(list)
    }

    pub(super) fn contact(&mut self, node_count: usize) -> Result<ContactSet> {
        let count = self.u32()? as usize;
        if count > node_count {
            return Err(Error::Snapshot(
                "holds more contact nodes than the mesh has nodes".into(),
            ));
        }
        let mut nodes = memory::room(count, "a snapshot")?;
        for _ in 0..count {
            nodes.push(self.u32()?);
        }
        let vectors = self.floats(3 * count)?;
        let mut set = ContactSet::with_capacity(node_count)?;
        set.gather(
            Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            },
            node_count,
        )
        .map_err(|error| Error::Snapshot(error.to_string()))?;
        Ok(set)
    }

    /// What corrections know of the past: velocities and pairs.
    pub(super) fn past(&mut self, len: usize, contacts: usize) -> Result<Option<(Motion, Pairs)>> {
        let Some(count) = self.u32()?.checked_sub(1) else {
            return Ok(None);
        };
        let [velocity, velocity_before, inertia] =
            [self.floats(len)?, self.floats(len)?, self.floats(len)?];
        let numbers = self.floats(3)?;
        let motion = Motion {
            velocity,
            velocity_before,
            inertia,
            min_det: numbers[0],
            truncated_mm: numbers[1],
            error_mm: numbers[2],
            reaction: self.floats(3 * contacts)?,
        };
        let pairs: Result<Pairs> = (0..count)
            .map(|_| Ok([self.floats(len)?, self.floats(len)?]))
            .collect();
        Ok(Some((motion, pairs?)))
    }

    /// What [`Writer::counters`] wrote.
    pub(super) fn counters(&mut self) -> Result<Counters> {
        Ok(Counters {
            step_count: u64::from(self.u32()?) | (u64::from(self.u32()?) << 32),
            quiet: self.u32()?,
            sleeping: self.u32()? != 0,
            rest_frames: self.u32()?,
            source: self.source()?,
            source_before: self.source()?,
            max_displacement: self.f32()?,
            was_corrected: [false; 2],
        })
    }

    fn source(&mut self) -> Result<Source> {
        match self.u32()? {
            0 => Ok(Source::Rest),
            1 => Ok(Source::Model),
            2 => Ok(Source::Fallback),
            other => Err(Error::Snapshot(format!(
                "has an unknown state source {other}"
            ))),
        }
    }
}
