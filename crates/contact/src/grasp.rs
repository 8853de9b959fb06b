//! A grasper's hold: samples bound to places on the tool until they are let go or tear off.

use crate::body::Body;
use crate::samples::Samples;
use parry3d::math::{Pose, Vector};
use std::collections::TryReserveError;

/// A grasper holds samples within this distance of its surface, mm.
pub const REACH_MM: f32 = 0.5;

/// The part of the force on all bound samples that pulls or drags: a push along the mean of their outward normals tears
/// nothing off. (Forces of single samples are not unique where there are more samples than nodes.)
pub fn tension(force: Vector, normal: Vector) -> Vector {
    force - normal * force.dot(normal).max(0.0)
}

/// A bound sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Row of the samples.
    pub sample: u32,
    /// Its place in the tool's frame, mm.
    pub place: Vector,
}

/// What one tool holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grasp {
    anchors: Vec<Anchor>,
}

impl Grasp {
    /// Binds all samples within `reach_mm` of the tool's surface where they are now; what was held before is let go.
    /// Ascending by sample.
    ///
    /// # Errors
    /// No memory: some of the samples are bound.
    pub fn close(
        &mut self,
        samples: &Samples,
        body: &Body,
        pose: &Pose,
        reach_mm: f32,
        position: impl Fn(u32) -> Vector,
    ) -> Result<(), TryReserveError> {
        self.anchors.clear();
        let (low, high) = body.bounds(pose, reach_mm);
        for (row, sample) in samples.rows().iter().enumerate() {
            let point = sample.gather(&position);
            if point.cmplt(low).any() || point.cmpgt(high).any() {
                continue;
            }
            let place = pose.inverse_transform_point(point);
            if body.nearest(place).distance <= reach_mm {
                self.anchors.try_reserve(1)?;
                self.anchors.push(Anchor {
                    sample: row as u32,
                    place,
                });
            }
        }
        Ok(())
    }

    /// Takes what another holds; the room stays.
    ///
    /// # Errors
    /// No memory: nothing has changed.
    pub fn take(&mut self, other: &Grasp) -> Result<(), TryReserveError> {
        let more = other.anchors.len().saturating_sub(self.anchors.len());
        self.anchors.try_reserve_exact(more)?;
        self.anchors.clear();
        self.anchors.extend_from_slice(&other.anchors);
        Ok(())
    }

    /// Takes what was held, ascending by sample.
    pub fn restore(&mut self, anchors: Vec<Anchor>) {
        self.anchors = anchors;
    }

    /// The samples have other rows: `to` gives those of now, and what has none is let go.
    pub fn rename(&mut self, to: impl Fn(u32) -> Option<u32>) {
        self.anchors.retain_mut(|anchor| match to(anchor.sample) {
            Some(sample) => {
                anchor.sample = sample;
                true
            }
            None => false,
        });
        self.anchors.sort_unstable_by_key(|anchor| anchor.sample);
        self.anchors.dedup_by_key(|anchor| anchor.sample);
    }

    /// Lets go.
    pub fn open(&mut self) {
        self.anchors.clear();
    }

    /// What is held, ascending by sample.
    pub fn anchors(&self) -> &[Anchor] {
        &self.anchors
    }

    /// The place of a sample on the tool, if it is held.
    pub fn place(&self, sample: u32) -> Option<Vector> {
        let at = self.anchors.binary_search_by_key(&sample, |a| a.sample);
        at.ok().map(|at| self.anchors[at].place)
    }

    /// Lets go of everything when the [`tension`] on its samples, `pull`, is more than `tear_off`, a force in the caller's unit; tells whether
    /// it did. A tear-off force that is not positive never tears.
    pub fn tear(&mut self, pull: Vector, tear_off: f32) -> bool {
        let torn = !self.anchors.is_empty() && tear_off > 0.0 && pull.length() > tear_off;
        if torn {
            self.open();
        }
        torn
    }
}
