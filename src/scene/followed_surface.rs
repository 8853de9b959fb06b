//! What a scene keeps of the surface that a host follows.

use std::sync::Arc;

use topology::{Body, RestMesh, Surface};

use super::points::AttachedPoints;
use super::published::BodyNumber;
use crate::bundle::Mesh;
use crate::error::Result;
use crate::memory;

pub const WHAT: &str = "the surface of a body";

/// The surface that a host follows.
pub struct Followed {
    pub surface: Surface,
    /// The body that it is of.
    pub body: BodyNumber,
    /// Of each vertex, mm.
    pub rest: Vec<[f32; 3]>,
    /// Slots that the last update has changed.
    pub changed: Vec<u32>,
    /// Slots that have changed and of which the host has not been told: there was no memory.
    untold: Vec<u32>,
    /// The host has not been told of any of it.
    is_new: bool,
    /// Its vertices as points on nodes, once frames show them.
    points: Option<Arc<AttachedPoints>>,
}

impl Followed {
    /// That of an intact body, of which the host knows nothing.
    pub fn new(mesh: &RestMesh) -> Result<Followed> {
        Ok(Followed {
            surface: Surface::new(mesh)?,
            body: BodyNumber::default(),
            rest: Vec::new(),
            changed: Vec::new(),
            untold: Vec::new(),
            is_new: true,
            points: None,
        })
    }

    /// Whether it is that of a body, all of it.
    pub fn is_of(&self, body: BodyNumber) -> bool {
        self.body == body && !self.is_new
    }

    /// Follows the body, whose nodes are those of `mesh`. Returns the first new vertex, and whether all are new. After an error another call goes on.
    pub fn follow(&mut self, body: &Body, mesh: &Mesh) -> Result<(usize, bool)> {
        self.points = None;
        let mut change = self.surface.update(body)?.triangles;
        if self.untold.is_empty() {
            std::mem::swap(&mut self.untold, &mut change);
        }
        if let Err(error) = memory::reserve(&mut self.untold, change.len(), WHAT) {
            self.is_new = true;
            return Err(error);
        }
        self.untold.append(&mut change);
        self.untold.sort_unstable();
        self.untold.dedup();
        let is_new = self.is_new;
        let first = self.rest.len();
        let new = first as u32..self.surface.vertices.len() as u32;
        memory::reserve(&mut self.rest, new.len(), WHAT)?;
        let all = match is_new {
            true => self.surface.triangles.len(),
            false => 0,
        };
        let mut changed = memory::collected(all, 0..all as u32, WHAT)?;
        let nodes = mesh.positions.as_chunks::<3>().0;
        let place = |node: u32| nodes[node as usize].map(f64::from);
        let places = new.map(|vertex| self.surface.place(vertex, place).map(|x| x as f32));
        self.rest.extend(places);
        if !is_new {
            std::mem::swap(&mut changed, &mut self.untold);
        }
        self.changed = changed;
        self.untold.clear();
        self.is_new = false;
        Ok((if is_new { 0 } else { first }, is_new))
    }

    /// Its vertices as points on nodes.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn points(&mut self) -> Result<Arc<AttachedPoints>> {
        let points = match self.points.take() {
            Some(points) => points,
            None => Arc::new(AttachedPoints::on_nodes(&self.surface.vertices)?),
        };
        Ok(Arc::clone(self.points.insert(points)))
    }

    /// Bytes of the heap, nearly: a vertex is in the list, in the map by nodes and in `rest`, a triangle in two lists.
    pub fn held_bytes(&self) -> usize {
        let points = self.points.as_ref().map_or(0, |points| 32 * points.len());
        160 * self.rest.len() + 20 * self.surface.triangles.len() + points
    }
}
