//! How a tool comes to the tissue: from far outside along its way in, until it nearly touches.

use super::legs::CLEARANCE_MM;
use crate::mesh::Mesh;
use contact::{Body, Pose, SPACING_MM, Samples, Vector};

/// How far outside an approach begins, mm.
const FAR_MM: f32 = 60.0;
/// A tool whose first touch is farther from its site than it is wide by this much came to another place, mm.
const ASIDE_MM: f32 = 3.0;

/// The whole surface at rest, the domain and the rest of it.
pub(super) struct Surface {
    domain: Vec<Vector>,
    others: Vec<Vector>,
}

impl Surface {
    pub fn new(mesh: &Mesh) -> Self {
        let mut inside = vec![false; mesh.surface.len()];
        mesh.domain
            .iter()
            .for_each(|row| inside[*row as usize] = true);
        let points = |wanted: bool| {
            let rows = mesh.surface.iter().zip(&inside);
            let faces = rows.filter(|(_, i)| **i == wanted).map(|(face, _)| *face);
            let samples = Samples::new(&mesh.positions, faces, &[], SPACING_MM);
            let position = |n: u32| Vector::from(mesh.positions[n as usize]);
            samples.rows().iter().map(|s| s.gather(position)).collect()
        };
        Self {
            domain: points(true),
            others: points(false),
        }
    }

    /// Distance of the nearest point of the surface, and that point.
    fn nearest(&self, body: &Body, pose: &Pose) -> (f32, Vector) {
        let mut nearest = (f32::INFINITY, Vector::ZERO);
        for point in self.domain.iter().chain(&self.others) {
            let distance = body.nearest_at(pose, *point).distance;
            if distance < nearest.0 {
                nearest = (distance, *point);
            }
        }
        nearest
    }

    /// The start of a tool that would be at `pose` with its end on the site, moved back against `inward` until it is clear;
    /// none where it touches something else first, or what it would touch is beyond the site.
    pub fn approach(
        &self,
        body: &Body,
        pose: &Pose,
        site: Vector,
        inward: Vector,
        width: f32,
    ) -> Option<Pose> {
        let mut back = FAR_MM;
        // Each step is at most the distance, so nothing is passed.
        for _ in 0..400 {
            let at = Pose::from_parts(pose.translation - inward * back, pose.rotation);
            let (distance, point) = self.nearest(body, &at);
            let left = distance - CLEARANCE_MM as f32;
            if left < 0.01 {
                let aside = point - site;
                let aside = (aside - inward * aside.dot(inward)).length();
                return (aside <= width + ASIDE_MM && left > -0.01).then_some(at);
            }
            back -= left;
            if back < -width - ASIDE_MM {
                return None;
            }
        }
        None
    }

    /// Whether the tool at a pose is more than `depth` deep in the surface outside of the domain, at rest.
    pub fn strays(&self, body: &Body, pose: &Pose, depth: f32) -> bool {
        let (low, high) = body.bounds(pose, 0.0);
        let near = self.others.iter();
        near.filter(|p| p.cmpge(low).all() && p.cmple(high).all())
            .any(|p| body.nearest_at(pose, *p).distance < -depth)
    }
}
