//! Instrument poses to a collision field, for hosts without a collision system.
//!
//! A surface node whose present position lies inside an instrument is in contact, and the collision
//! field `c` puts it on the instrument's surface: along the instrument's motion where that leads into the tissue,
//! else along the tissue's inward normal. Where either is far longer than the shortest way out, on a flank, it
//! takes the shortest. If the shortest way leads out of the tissue (the instrument's middle has passed the surface
//! within one step), the instrument must move into this side of the tissue; nodes that it reaches from the inside
//! are left alone.
//!
//! *Sliding*: a touched node is projected anew each time, and follows a retreating surface within [`SKIN_MM`] and the
//! instrument's own motion, until it is back at rest. *Sticking*: a touched node keeps its place on
//! the instrument until that would pull it beyond its rest position. Neither pulls tissue out: both are let go where their place lies
//! outward of their rest position, along the tissue's normal at rest. A node that was let go is touched again only where it is
//! [`HYSTERESIS_MM`] deep, so that one at the edge of a contact does not come and go.
//!
//! Every surface node is looked at, from where it is now, so large displacements need no care:
//! a bounding-box test a node, and the exact query for the few that pass. Lengths in mm.

mod touched;

use crate::contact::{MAX_TOOLS, Tool};
use crate::error::{Error, Result};
use crate::memory;
use parry3d::math::{Vec3A, Vec4, Vector};

use touched::Touched;

/// How far outside an instrument that does not move a node that was touched still follows it, mm.
pub const SKIN_MM: f32 = 0.5;
/// A node that was let go is touched again where it is this deep, mm.
pub const HYSTERESIS_MM: f32 = 0.1;
/// A way along the motion or the inward normal is taken up to this many times the shortest way out.
const FLANK: f32 = 3.0;
/// The longest way along the inward normal that is still taken as a contact, mm.
pub const SHELL_MM: f32 = 10.0;
const WHAT: &str = "the instruments' contacts";

/// A tool whose contact is told from where it is alone.
#[derive(Debug, Clone)]
pub struct Instrument {
    /// Shape and pose; the rest is for tools whose contact is solved.
    pub tool: Tool,
    /// Touched nodes move with the instrument until it leaves; otherwise they slide without friction.
    pub sticking: bool,
}

/// The nearest point of an instrument's surface.
struct Nearest {
    /// Negative inside, mm.
    distance: f32,
    point: Vector,
    /// Out of the instrument, unit length.
    normal: Vector,
}

impl Instrument {
    /// Whether another one is the same at the same place.
    pub(crate) fn is_same(&self, other: &Instrument) -> bool {
        self.sticking == other.sticking && self.tool.is_same(&other.tool)
    }

    fn bounds(&self) -> (Vector, Vector) {
        self.tool.body.bounds(&self.tool.pose, 0.0)
    }

    fn nearest(&self, point: Vector) -> Nearest {
        let found = self.tool.body.nearest_at(&self.tool.pose, point);
        Nearest {
            distance: found.distance,
            point: point - found.normal * found.distance,
            normal: found.normal,
        }
    }

    fn way_out(&self, from: Vector, direction: Vector, limit: f32) -> Option<f32> {
        let Tool { body, pose, .. } = &self.tool;
        body.way_out(pose, from, direction, limit)
    }

    fn to_local(&self, point: Vector) -> Vector {
        self.tool.pose.inverse_transform_point(point)
    }

    fn to_world(&self, local: Vector) -> Vector {
        self.tool.pose.transform_point(local)
    }
}

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
    touched: Touched,
    /// Rows of `surface` that the search looks at closely, and their positions.
    near: Vec<(u32, Vec3A)>,
    found: Found,
}

/// Nodes in contact, ascending, and their prescribed displacement `[m,3]`, mm.
#[derive(Debug)]
struct Found {
    nodes: Vec<u32>,
    vectors: Vec<f32>,
}

impl InstrumentContacts {
    /// Prepares a mesh: `positions [K,3]`, boundary triangles `[F,3]` (outward), and the nodes that
    /// the boundary condition holds, which are never in contact.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(positions: &[f32], surface_faces: &[u32], held: &[u32]) -> Result<Self> {
        let node_count = positions.len() / 3;
        let mut row = memory::filled(node_count, 0u32, WHAT)?;
        surface_faces
            .iter()
            .for_each(|&node| row[node as usize] += 1);
        held.iter().for_each(|&node| row[node as usize] = 0);
        let count = row.iter().filter(|&&faces| faces > 0).count();
        let mut surface = memory::room(count, WHAT)?;
        let mut face_offsets = memory::room(count + 1, WHAT)?;
        face_offsets.push(0);
        for (node, count) in row.iter_mut().enumerate() {
            let faces = std::mem::replace(count, u32::MAX);
            if faces > 0 {
                *count = surface.len() as u32;
                surface.push(node as u32);
                face_offsets.push(face_offsets[face_offsets.len() - 1] + faces);
            }
        }
        let mut faces = memory::filled(face_offsets[count] as usize, [0; 3], WHAT)?;
        let mut next = memory::copied(&face_offsets, WHAT)?;
        for face in surface_faces.chunks_exact(3) {
            for &node in face {
                let row = row[node as usize];
                if row != u32::MAX {
                    faces[next[row as usize] as usize] = [face[0], face[1], face[2]];
                    next[row as usize] += 1;
                }
            }
        }
        let rest = surface.iter().map(|&node| triple(positions, node).into());
        Ok(Self {
            node_count,
            rest: memory::collected(count, rest, WHAT)?,
            face_offsets,
            faces,
            positions: memory::copied(positions, WHAT)?,
            touched: Touched {
                by: memory::filled(count, 0, WHAT)?,
                left: memory::filled(count, 0, WHAT)?,
                anchor: memory::filled(count, [0.0; 3], WHAT)?,
                poses: memory::room(MAX_TOOLS, WHAT)?,
            },
            near: memory::room(count, WHAT)?,
            found: Found {
                nodes: memory::room(count, WHAT)?,
                vectors: memory::room(3 * count, WHAT)?,
            },
            surface,
        })
    }

    /// Forgets what is touched; the next call sees the instruments for the first time.
    pub fn reset(&mut self) {
        self.touched.forget();
    }

    /// Finds the contacts of instruments with the tissue at `displacement [K,3]`, mm. The list's
    /// places are the instruments' identities from call to call; a change of its length forgets
    /// what is touched. A node inside two instruments goes with the one that it is deeper in.
    ///
    /// Gives the nodes, ascending, and their prescribed displacement `[m,3]`, mm: the next step's
    /// collision field. No allocation on a mesh and instruments seen before.
    ///
    /// # Errors
    /// [`Error::Argument`] for a wrong length; the memory is then as before.
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
        if instruments.len() > MAX_TOOLS {
            return Err(Error::Argument(format!(
                "{} instruments; at most {MAX_TOOLS} are allowed at once",
                instruments.len()
            )));
        }
        let placed = instruments;
        if self.touched.poses.len() != instruments.len() {
            self.reset();
        }
        self.found.nodes.clear();
        self.found.vectors.clear();
        let mut low = Vector::splat(f32::INFINITY);
        let mut high = Vector::splat(f32::NEG_INFINITY);
        for instrument in placed {
            let (a, b) = instrument.bounds();
            (low, high) = (low.min(a), high.max(b));
        }
        self.sift(displacement, low.into(), high.into());
        for candidate in 0..self.near.len() {
            let (i, p) = self.near[candidate];
            let i = i as usize;
            let node = self.surface[i];
            let before = std::mem::replace(&mut self.touched.by[i], 0);
            let point = Vector::from(p);
            let target = match self.holder(point, before, placed) {
                Some((by, instrument)) => {
                    let kept = self.keep(i, by, point, instrument);
                    if kept.is_none() {
                        self.touched.left[i] = before;
                    }
                    kept.map(|to| (by, to))
                }
                None => self.touch(i, point, displacement, placed, before),
            };
            if let Some((by, target)) = target {
                self.touched.by[i] = by as u8 + 1;
                self.touched.left[i] = 0;
                self.found.nodes.push(node);
                let c = target - Vector::from(self.rest[i]);
                self.found.vectors.extend([c.x, c.y, c.z]);
            }
        }
        self.touched.poses.clear();
        let poses = placed.iter().map(|instrument| instrument.tool.pose);
        self.touched.poses.extend(poses);
        Ok((&self.found.nodes, &self.found.vectors))
    }

    /// What the last call found.
    pub fn found(&self) -> (&[u32], &[f32]) {
        (&self.found.nodes, &self.found.vectors)
    }

    /// Collects the nodes in a box, and those that were touched, with their positions: nearly all of a search's time.
    #[inline(never)]
    fn sift(&mut self, displacement: &[f32], low: Vec3A, high: Vec3A) {
        self.near.clear();
        let away = Vec3A::splat(SKIN_MM);
        let nodes = self.surface.iter().zip(&self.rest).zip(&self.touched.by);
        let nodes = nodes.zip(&mut self.touched.left);
        for (i, (((&node, &rest), &touched), left)) in nodes.enumerate() {
            let at = 3 * node as usize;
            // A load of four where there is a fourth number.
            let u = match displacement.get(at..at + 4) {
                Some(four) => Vec3A::from_vec4(Vec4::from_slice(four)),
                None => Vec3A::from_slice(&displacement[at..]),
            };
            let p = rest + u;
            if (p.cmpge(low) & p.cmple(high)).all() || touched != 0 {
                self.near.push((i as u32, p));
            } else if *left != 0 && !(p.cmpge(low - away) & p.cmple(high + away)).all() {
                *left = 0;
            }
        }
    }

    /// The instrument that a touched node is to follow; none where the node is (again) inside a
    /// sliding one, because the tissue has not followed yet: that is a touch like the first.
    fn holder<'a>(
        &self,
        point: Vector,
        before: u8,
        placed: &'a [Instrument],
    ) -> Option<(usize, &'a Instrument)> {
        let by = usize::from(before.checked_sub(1)?);
        let instrument = placed.get(by)?;
        let follows = instrument.sticking || instrument.nearest(point).distance > -1e-3;
        follows.then_some((by, instrument))
    }

    /// How instrument `by` has moved since the last call at a point that it is at now, mm; none at its first.
    fn motion(&self, by: usize, point: Vector, instrument: &Instrument) -> Option<Vector> {
        let from = self.touched.poses.get(by)?;
        Some(point - from.transform_point(instrument.to_local(point)))
    }

    /// Where a node goes that was touched before, or `None` where the instrument has left it.
    fn keep(&self, i: usize, by: usize, point: Vector, instrument: &Instrument) -> Option<Vector> {
        let rest = Vector::from(self.rest[i]);
        let target = match instrument.sticking {
            true => instrument.to_world(Vector::from(self.touched.anchor[i])),
            false => {
                let nearest = instrument.nearest(point);
                let moved = self.motion(by, point, instrument).unwrap_or_default();
                if nearest.distance > SKIN_MM + moved.length() {
                    return None;
                }
                nearest.point
            }
        };
        // Along the tissue's own normal, at rest: the instrument's may point anywhere on a flank, as may that of a dragged surface.
        let outward = self.outward(i, |_| Vector::ZERO);
        ((target - rest).dot(outward) <= 0.0).then_some(target)
    }

    /// Where a node inside an instrument goes, and by which; `None` where none touches it. An
    /// instrument that touched it `before` is known to come from outside.
    fn touch(
        &mut self,
        i: usize,
        point: Vector,
        displacement: &[f32],
        placed: &[Instrument],
        before: u8,
    ) -> Option<(usize, Vector)> {
        let mut normal = None;
        let mut deepest: Option<(f32, usize, Vector)> = None;
        for (by, instrument) in placed.iter().enumerate() {
            let (low, high) = instrument.bounds();
            if point.cmplt(low).any() || point.cmpgt(high).any() {
                continue;
            }
            let moved = |node| Vector::from(triple(displacement, node));
            let outward = *normal.get_or_insert_with(|| self.outward(i, moved));
            let nearest = instrument.nearest(point);
            // One that was let go must come some way in before it is touched again.
            let shallow = match usize::from(self.touched.left[i]) == by + 1 {
                true => -HYSTERESIS_MM,
                false => 0.0,
            };
            if nearest.distance >= shallow || deepest.is_some_and(|(d, _, _)| d <= nearest.distance)
            {
                continue;
            }
            let motion = self.motion(by, point, instrument);
            let mut target = nearest.point;
            if nearest.normal.dot(outward) > 0.0 {
                let known = usize::from(before) == by + 1;
                if !known && motion.is_some_and(|motion| motion.dot(outward) >= 0.0) {
                    continue;
                }
                match instrument.way_out(point, -outward, SHELL_MM) {
                    Some(length) => target = point - outward * length,
                    None => continue,
                }
            } else {
                let into = motion.map(Vector::normalize_or_zero);
                let into = into.filter(|into| into.dot(outward) < -0.5);
                let direction = into.unwrap_or(-outward);
                let most = SHELL_MM.min(-FLANK * nearest.distance);
                if let Some(length) = instrument.way_out(point, direction, most) {
                    target = point + direction * length;
                }
            }
            deepest = Some((nearest.distance, by, target));
        }
        let (_, by, target) = deepest?;
        self.touched.anchor[i] = placed[by].to_local(target).to_array();
        Some((by, target))
    }

    /// The surface's outward normal at a node of the mesh under a displacement; zero where it has none.
    fn outward(&self, i: usize, displacement: impl Fn(u32) -> Vector) -> Vector {
        let at = |node| Vector::from(triple(&self.positions, node)) + displacement(node);
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
