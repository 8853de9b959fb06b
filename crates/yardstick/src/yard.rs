//! What is measured of one state, from the displacement alone: the smallest det F of the elements, and how deep points of
//! the surface lie in the tools.

use contact::{Body, Placed, Pose, Samples, Search, Vector};
use elements::Tetrahedron;
use tissue::mesh::{Boundary, Mesh};

/// Distance of the points that penetration is looked for at, mm: closer than where contact is solved.
const SPACING_MM: f32 = 1.0;

/// A mesh made ready.
pub struct Yard {
    rest: Vec<Vector>,
    elements: Vec<Tetrahedron>,
    samples: Samples,
    search: Search,
}

impl Yard {
    pub fn new(mesh: &Mesh, boundary: Boundary) -> Self {
        let corner = |node: u32| mesh.positions[node as usize].map(f64::from);
        let elements = mesh.tets.iter();
        Self {
            rest: mesh.positions.iter().map(|p| Vector::from(*p)).collect(),
            elements: elements
                .map(|tet| Tetrahedron::new(*tet, tet.map(corner), 1.0))
                .collect(),
            samples: Samples::of_domain(
                &mesh.positions,
                &mesh.surface,
                &mesh.domain,
                &mesh.held_nodes(boundary),
                SPACING_MM,
            ),
            search: Search::default(),
        }
    }

    /// Smallest det F over all elements; 1 at rest, negative where one is inside out.
    pub fn smallest_det(&self, field: &[[f32; 3]]) -> f64 {
        let u = |node: u32| field[node as usize].map(f64::from);
        let dets = self.elements.iter();
        dets.map(|element| element.deformation(element.corners.map(u)).det)
            .fold(f64::INFINITY, f64::min)
    }

    /// How deep the deepest point of the surface lies in a tool, mm; 0 where none does.
    pub fn penetration(&mut self, field: &[[f32; 3]], bodies: &[Body], poses: &[Pose]) -> f64 {
        let placed: Vec<Placed> = bodies
            .iter()
            .zip(poses)
            .map(|(body, pose)| Placed {
                body,
                pose: *pose,
                skin: 0.0,
            })
            .collect();
        let rest = &self.rest;
        let found = self.search.find(&self.samples, &placed, |node| {
            rest[node as usize] + Vector::from(field[node as usize])
        });
        let depths = found.iter().map(|candidate| -candidate.distance);
        f64::from(depths.fold(0.0, f32::max))
    }
}

/// The longest way of a node from one state to another, mm.
pub fn jump(from: &[[f32; 3]], to: &[[f32; 3]]) -> f64 {
    let ways = from.iter().zip(to).map(|(a, b)| distance(*a, *b));
    f64::from(ways.fold(0.0, f32::max))
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact::{Rotation, Shape};
    use tissue::mesh::ellipsoid_phantom;

    #[test]
    fn a_mirrored_corner_is_inverted_and_a_ball_in_the_surface_is_seen() {
        let mesh = ellipsoid_phantom([30.0, 30.0, 30.0], 6).unwrap();
        let mut yard = Yard::new(&mesh, Boundary::Fixed);
        let mut field = vec![[0.0; 3]; mesh.node_count()];
        assert!((yard.smallest_det(&field) - 1.0).abs() < 1e-9);
        let node = mesh.surface[mesh.domain[0] as usize][0];
        let at = Vector::from(mesh.positions[node as usize]);
        let ball = [Body::new(&Shape::Sphere { radius: 4.0 }).unwrap()];
        let out = at.normalize();
        let touching = [Pose::from_parts(at + out * 3.0, Rotation::IDENTITY)];
        let depth = yard.penetration(&field, &ball, &touching);
        assert!((depth - 1.0).abs() < 0.05, "{depth}");
        let clear = [Pose::from_parts(at + out * 9.0, Rotation::IDENTITY)];
        assert_eq!(yard.penetration(&field, &ball, &clear), 0.0);
        // Twice the way to the centre turns every element of the node inside out.
        field[node as usize] = (at * -2.0).to_array();
        assert!(yard.smallest_det(&field) < 0.0);
        let length = f64::from(2.0 * at.length());
        let still = vec![[0.0; 3]; mesh.node_count()];
        assert!((jump(&still, &field) - length).abs() < 1e-3);
    }
}
