//! The point of a surface that lies nearest to a place.

use crate::tie::TiePoint;
use parry3d::math::Vector;
use parry3d::query::PointQueryWithLocation;
use parry3d::shape::Triangle;

/// As nodes of a face and weights; the first of points that are as near. None of no faces.
pub fn nearest(
    faces: impl Iterator<Item = [u32; 3]>,
    position: impl Fn(u32) -> Vector,
    place: Vector,
) -> Option<TiePoint> {
    // All faces are looked at: this is asked where a host sets a tie, and never in a step.
    let mut found: Option<(f32, TiePoint)> = None;
    for nodes in faces {
        let [a, b, c] = nodes.map(&position);
        // `false`: the surface itself is meant, not the solid behind it.
        let (point, at) = Triangle::new(a, b, c).project_local_point_and_get_location(place, false);
        let distance = point.point.distance_squared(place);
        if found.is_some_and(|(least, _)| least <= distance) {
            continue;
        }
        // A flat triangle has no weights: its first corner then.
        let weights = at.barycentric_coordinates().unwrap_or([1.0, 0.0, 0.0]);
        found = Some((distance, TiePoint { nodes, weights }));
    }
    found.map(|(_, sample)| sample)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_over_a_face_an_edge_and_a_corner_has_its_point() {
        let nodes = [
            Vector::ZERO,
            Vector::X * 3.0,
            Vector::Y * 3.0,
            Vector::new(3.0, 3.0, 0.0),
        ];
        let faces = [[0, 1, 2], [1, 3, 2]];
        for (place, wanted) in [
            (Vector::new(0.5, 1.0, 2.0), Vector::new(0.5, 1.0, 0.0)),
            (Vector::new(2.5, 2.0, -1.0), Vector::new(2.5, 2.0, 0.0)),
            (Vector::new(1.0, -4.0, 0.0), Vector::new(1.0, 0.0, 0.0)),
            (Vector::new(9.0, 8.0, 0.0), Vector::new(3.0, 3.0, 0.0)),
        ] {
            let found = nearest(faces.into_iter(), |node| nodes[node as usize], place).unwrap();
            let point = found.gather(|node| nodes[node as usize]);
            assert!(point.distance(wanted) < 1e-5, "{place}: {found:?}");
            assert!((found.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        }
    }
}
