//! Instrument poses to a collision field, for hosts without a collision system.
//!
//! A surface node whose present position lies inside an instrument is in contact, and the collision
//! field `c` puts it on the instrument's surface: the shortest way out. If that way leads out of the
//! tissue (the instrument's middle has passed the surface within one step), the node goes along
//! its inward normal instead, provided that the instrument moves into this side of the tissue and the
//! way is within the shell; nodes that an instrument reaches from the inside are left alone.
//!
//! *Sliding*: a touched node is projected anew each time, and follows a retreating surface (at most
//! the skin's depth a call) until it is back at rest. *Sticking*: a touched node keeps its place on
//! the instrument until that would pull it beyond its rest position. Neither can pull tissue out.
//!
//! Every surface node is looked at, from where it is now, so large displacements need no care:
//! a bounding-box test a node, and the exact query for the few that pass. Lengths in mm.

mod shape;

pub use shape::{Instrument, Shape};

use crate::error::{Error, Result};
use parry3d::math::{Vec3A, Vec4, Vector};
use shape::Placed;

/// How far outside an instrument a node that was touched still follows it, mm.
pub const SKIN_MM: f32 = 0.5;
/// The longest way along the inward normal that is still taken as a contact, mm.
pub const SHELL_MM: f32 = 10.0;
/// Instruments at once.
pub const MAX_INSTRUMENTS: usize = 64;

/// Contact search on one mesh, with the memory of what is touched. One thread at a time.
#[derive(Debug)]
pub struct InstrumentContacts {
    node_count: usize,
    /// Surface nodes that are not held, ascending.
    surface: Vec<u32>,
    /// Their rest positions.
    rest: Vec<Vec3A>,
    /// Surface triangles around each of them, rows of `faces`; a face is its three mesh nodes.
    face_offsets: Vec<u32>,
    faces: Vec<[u32; 3]>,
    positions: Vec<f32>,
    /// Instrument plus one that touched the node at the last call; 0: none.
    touched_by: Vec<u8>,
    /// Place on a sticking instrument, in its frame.
    anchor: Vec<[f32; 3]>,
    /// Centres at the last call.
    centres: Vec<Vector>,
    /// Rows of `surface` that the search looks at closely, and their positions.
    near: Vec<(u32, Vec3A)>,
    nodes: Vec<u32>,
    vectors: Vec<f32>,
}

impl InstrumentContacts {
    /// Prepares a mesh: `positions [K,3]`, boundary triangles `[F,3]` (outward), and the nodes that
    /// the boundary condition holds, which are never in contact.
    pub fn new(positions: &[f32], surface_faces: &[u32], held: &[u32]) -> Self {
        let node_count = positions.len() / 3;
        let mut row = vec![0u32; node_count];
        surface_faces
            .iter()
            .for_each(|&node| row[node as usize] += 1);
        held.iter().for_each(|&node| row[node as usize] = 0);
        let mut surface = Vec::new();
        let mut face_offsets = vec![0];
        for (node, count) in row.iter_mut().enumerate() {
            let faces = std::mem::replace(count, u32::MAX);
            if faces > 0 {
                *count = surface.len() as u32;
                surface.push(node as u32);
                face_offsets.push(face_offsets[face_offsets.len() - 1] + faces);
            }
        }
        let mut faces = vec![[0; 3]; face_offsets[surface.len()] as usize];
        let mut next = face_offsets.clone();
        for face in surface_faces.chunks_exact(3) {
            for &node in face {
                let row = row[node as usize];
                if row != u32::MAX {
                    faces[next[row as usize] as usize] = [face[0], face[1], face[2]];
                    next[row as usize] += 1;
                }
            }
        }
        let rest = surface
            .iter()
            .map(|&node| triple(positions, node).into())
            .collect();
        let count = surface.len();
        Self {
            node_count,
            rest,
            face_offsets,
            faces,
            positions: positions.to_vec(),
            touched_by: vec![0; count],
            anchor: vec![[0.0; 3]; count],
            centres: Vec::with_capacity(MAX_INSTRUMENTS),
            near: Vec::with_capacity(count),
            nodes: Vec::with_capacity(count),
            vectors: Vec::with_capacity(3 * count),
            surface,
        }
    }

    /// Forgets what is touched; the next call sees the instruments for the first time.
    pub fn reset(&mut self) {
        self.touched_by.fill(0);
        self.centres.clear();
    }

    /// Finds the contacts of instruments with the tissue at `displacement [K,3]`, mm. The list's
    /// places are the instruments' identities from call to call; a change of its length forgets
    /// what is touched. A node inside two instruments goes with the one that it is deeper in.
    ///
    /// Gives the nodes, ascending, and their prescribed displacement `[m,3]`, mm: the next step's
    /// collision field. No allocation on a mesh and instruments seen before.
    ///
    /// # Errors
    /// [`Error::Argument`] for a wrong length, size or rotation, [`Error::NonFinite`] for a pose
    /// that is not finite; the memory is then as before.
    pub fn find(
        &mut self,
        instruments: &[Instrument],
        displacement: &[f32],
    ) -> Result<(&[u32], &[f32])> {
        if displacement.len() != 3 * self.node_count {
            return Err(Error::Argument(format!(
                "displacement has {} numbers; it must have 3 K = {}",
                displacement.len(),
                3 * self.node_count
            )));
        }
        if instruments.len() > MAX_INSTRUMENTS {
            return Err(Error::Argument(format!(
                "{} instruments; at most {MAX_INSTRUMENTS} at once",
                instruments.len()
            )));
        }
        let mut placed: [Option<Placed>; MAX_INSTRUMENTS] = [const { None }; MAX_INSTRUMENTS];
        for (index, instrument) in instruments.iter().enumerate() {
            placed[index] = Some(Placed::new(instrument, index)?);
        }
        let placed = &placed[..instruments.len()];
        if self.centres.len() != instruments.len() {
            self.reset();
        }
        self.nodes.clear();
        self.vectors.clear();
        let mut low = Vector::splat(f32::INFINITY);
        let mut high = Vector::splat(f32::NEG_INFINITY);
        for instrument in placed.iter().flatten() {
            let (a, b) = instrument.bounds(0.0);
            (low, high) = (low.min(a), high.max(b));
        }
        self.sift(displacement, low.into(), high.into());
        for candidate in 0..self.near.len() {
            let (i, p) = self.near[candidate];
            let i = i as usize;
            let node = self.surface[i];
            let before = std::mem::replace(&mut self.touched_by[i], 0);
            let point = Vector::from(p);
            let target = match self.holder(i, point, before, placed) {
                Some((by, instrument)) => self.keep(i, point, instrument).map(|to| (by, to)),
                None => self.touch(i, point, displacement, placed, before),
            };
            if let Some((by, target)) = target {
                self.touched_by[i] = by as u8 + 1;
                self.nodes.push(node);
                let c = target - Vector::from(self.rest[i]);
                self.vectors.extend([c.x, c.y, c.z]);
            }
        }
        self.centres.clear();
        self.centres
            .extend(placed.iter().flatten().map(Placed::centre));
        Ok((&self.nodes, &self.vectors))
    }

    /// What the last call found.
    pub fn found(&self) -> (&[u32], &[f32]) {
        (&self.nodes, &self.vectors)
    }

    /// Collects the nodes in a box, and those that were touched, with their positions: nearly all of a search's time.
    #[inline(never)]
    fn sift(&mut self, displacement: &[f32], low: Vec3A, high: Vec3A) {
        self.near.clear();
        let nodes = self.surface.iter().zip(&self.rest).zip(&self.touched_by);
        for (i, ((&node, &rest), &touched)) in nodes.enumerate() {
            let at = 3 * node as usize;
            // A load of four where there is a fourth number.
            let u = match displacement.get(at..at + 4) {
                Some(four) => Vec3A::from_vec4(Vec4::from_slice(four)),
                None => Vec3A::from_slice(&displacement[at..]),
            };
            let p = rest + u;
            if (p.cmpge(low) & p.cmple(high)).all() || touched != 0 {
                self.near.push((i as u32, p));
            }
        }
    }

    /// The instrument that a touched node is to follow; none where the node is (again) inside a
    /// sliding one, because the tissue has not followed yet: that is a touch like the first.
    fn holder<'a>(
        &self,
        i: usize,
        point: Vector,
        before: u8,
        placed: &'a [Option<Placed>],
    ) -> Option<(usize, &'a Placed)> {
        let by = usize::from(before.checked_sub(1)?);
        let instrument = placed.get(by)?.as_ref()?;
        let hint = point - Vector::from(self.rest[i]);
        let follows = instrument.sticking || instrument.nearest(point, hint).distance > -1e-3;
        follows.then_some((by, instrument))
    }

    /// Where a node goes that was touched before, or `None` where the instrument has left it.
    fn keep(&self, i: usize, point: Vector, instrument: &Placed) -> Option<Vector> {
        let rest = Vector::from(self.rest[i]);
        if instrument.sticking {
            let target = instrument.to_world(Vector::from(self.anchor[i]));
            let normal = instrument.nearest(target, point - rest).normal;
            return ((target - rest).dot(normal) > 0.0).then_some(target);
        }
        let nearest = instrument.nearest(point, point - rest);
        let pushed = (nearest.point - rest).dot(nearest.normal) > 0.0;
        (nearest.distance <= SKIN_MM && pushed).then_some(nearest.point)
    }

    /// Where a node inside an instrument goes, and by which; `None` where none touches it. An
    /// instrument that touched it `before` is known to come from outside.
    fn touch(
        &mut self,
        i: usize,
        point: Vector,
        displacement: &[f32],
        placed: &[Option<Placed>],
        before: u8,
    ) -> Option<(usize, Vector)> {
        let mut normal = None;
        let mut deepest: Option<(f32, usize, Vector)> = None;
        for (by, instrument) in placed.iter().enumerate() {
            let Some(instrument) = instrument else {
                continue;
            };
            let (low, high) = instrument.bounds(0.0);
            if point.cmplt(low).any() || point.cmpgt(high).any() {
                continue;
            }
            let outward = *normal.get_or_insert_with(|| self.outward(i, displacement));
            let nearest = instrument.nearest(point, -outward);
            if nearest.distance >= 0.0 || deepest.is_some_and(|(d, _, _)| d <= nearest.distance) {
                continue;
            }
            let mut target = nearest.point;
            if nearest.normal.dot(outward) > 0.0 {
                let motion = self.centres.get(by).map(|from| instrument.centre() - *from);
                let known = usize::from(before) == by + 1;
                if !known && motion.is_some_and(|motion| motion.dot(outward) >= 0.0) {
                    continue;
                }
                match instrument.way_out(point, -outward, SHELL_MM) {
                    Some(length) => target = point - outward * length,
                    None => continue,
                }
            }
            deepest = Some((nearest.distance, by, target));
        }
        let (_, by, target) = deepest?;
        if let Some(instrument) = &placed[by] {
            self.anchor[i] = instrument.to_local(target).to_array();
        }
        Some((by, target))
    }

    /// The surface's outward normal at a node of the deformed mesh; zero where it has none.
    fn outward(&self, i: usize, displacement: &[f32]) -> Vector {
        let at = |node| {
            Vector::from(triple(&self.positions, node)) + Vector::from(triple(displacement, node))
        };
        let row = self.face_offsets[i] as usize..self.face_offsets[i + 1] as usize;
        self.faces[row]
            .iter()
            .map(|&[a, b, c]| (at(b) - at(a)).cross(at(c) - at(a)))
            .sum::<Vector>()
            .normalize_or_zero()
    }
}

fn triple(field: &[f32], node: u32) -> [f32; 3] {
    let at = 3 * node as usize;
    [field[at], field[at + 1], field[at + 2]]
}

#[cfg(test)]
mod tests;
