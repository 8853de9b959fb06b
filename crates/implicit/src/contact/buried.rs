//! Tools that lie in the tissue. Samples of the surface cannot show it, because none of them lies in such a tool. So a probe is tested
//! against the solid that the whole surface bounds, and the tissue is moved along the shortest way out.

use ::contact::samples::LATTICE;
use ::contact::{Body, Pose, Samples, Vector};

use super::solid::Solid;
use super::state::State;
use crate::kernels::Isa;
use crate::kernels::nearest::{AT_ONCE, nearest_nodes};
use crate::memory::HeldBytes;

/// A tool whose middle lies less deep than this, or than its half thickness, is in contact and not in the tissue, mm.
const LEAST_MM: f32 = 1.0;
/// What lies deeper than this is looked for by the solid, mm.
const PIERCED_MM: f32 = 4.0;
/// A way out to a rim of the touchable surface that makes less than this (cosine) with the normal of the face there may go along the face: the
/// point lies beside the rim, in the tissue or not. In a fold the way out leans too, but leads to no rim.
const IN_DOUBT: f32 = 0.5;
/// A wall may have come so far through the one on its other side, mm.
const BESIDE_MM: f32 = 1.5;
/// Ways out of the solid are looked for as far as this, mm.
const LONGEST_MM: f32 = 30.0;

/// Where a tool in the tissue comes out.
#[derive(Clone, Copy, Debug, HeldBytes)]
pub(super) struct Buried {
    /// Unit direction of the shortest way out.
    pub out: Vector,
    /// Length of that way from the deepest of the tool's probes, mm.
    pub depth: f32,
    /// Row of the samples at which that way meets the surface.
    pub row: u32,
    /// The deepest probe, mm.
    point: Vector,
}

impl Buried {
    /// The way from the deepest probe out of the solid along a unit direction, mm; none where it is longer than [`LONGEST_MM`].
    pub fn way_along(&self, direction: Vector, mut solid: Solid<'_>) -> Option<Vector> {
        let mut length = f32::MAX;
        solid.each_crossing(self.point, direction, |crossing| {
            if crossing.leaves {
                length = length.min(crossing.along);
            }
        });
        (length <= LONGEST_MM).then_some(direction * length)
    }

    /// Where the tip of a thin tool has pierced the touchable surface, by no more than [`PIERCED_MM`]. Where that is in doubt, `is_inside` is asked
    /// whether a probe lies in the tissue.
    pub fn tip(
        tool: (&Body, &Pose),
        samples: &Samples,
        state: State<'_>,
        isa: Isa,
        is_inside: impl FnMut(Vector) -> bool,
    ) -> Option<Buried> {
        let least = 0.0;
        let deepest = match samples.has_walls() {
            true => deepest_by_walls(tool, samples, state, least, is_inside),
            false => deepest(tool, (samples, isa), state, least, is_inside),
        };
        deepest.filter(|buried| buried.depth < PIERCED_MM)
    }

    /// Where the deepest probe of a tool comes out through the touchable surface; none where no probe lies in the tissue, or only
    /// beneath a part of the surface that no tool touches, or where the tool went in through such a part.
    pub fn find(
        (body, pose): (&Body, &Pose),
        samples: &Samples,
        mut solid: Solid<'_>,
        isa: Isa,
    ) -> Option<Buried> {
        let least = LEAST_MM.min(body.size());
        let (tool, state) = ((body, pose), solid.state);
        let buried = match samples.has_walls() {
            true => deepest_by_walls(tool, samples, state, least, |point| solid.is_inside(point)),
            false => deepest(tool, (samples, isa), state, least, |_| true),
        }?;
        let point = buried.point;
        let is_in = !solid.is_nearer(point, buried.depth)
            && solid.is_inside(point)
            && !solid.is_left_elsewhere(tool, point, samples.nodes());
        is_in.then_some(buried)
    }
}

/// The deepest of a tool's probes that lie in a body with walls, more than `least` mm from its touchable surface. The two walls of a slit lie on each other, and
/// the nearest corner may be of the wrong one: of all triangles the nearest that has the probe behind it counts.
fn deepest_by_walls(
    (body, pose): (&Body, &Pose),
    samples: &Samples,
    state: State<'_>,
    least: f32,
    mut is_inside: impl FnMut(Vector) -> bool,
) -> Option<Buried> {
    let mut deepest: Option<Buried> = None;
    for point in probes(body, pose) {
        let depth = deepest.map_or(least, |buried| buried.depth);
        if let Some(found) = behind(point, samples, state)
            && found.depth > depth
            && is_inside(point)
        {
            deepest = Some(found);
        }
    }
    deepest
}

/// The way out of a point through the nearest triangle that has it behind itself; none where another triangle is clearly nearer.
/// It looks at all faces of the domain, so it is for bodies with walls alone; without walls
/// `deepest` finds the nearest node in lanes first.
fn behind(point: Vector, samples: &Samples, state: State<'_>) -> Option<Buried> {
    let (mut nearest, mut best) = (f32::MAX, None);
    let mut length = f32::MAX;
    for face in 0..samples.face_count() {
        let places = samples.corners(face);
        let [a, b, c] = places.map(|at| samples.corner_at(at, |node| state.position(node)));
        let weights = nearest_weights(point, [a, b, c]);
        let [u, v, w] = weights;
        let away = a * u + b * v + c * w - point;
        let square = away.length_squared();
        // `nearest` is of all faces and `length` of those that have the point behind them: the two
        // differ where a face in front of the point is nearer.
        nearest = nearest.min(square);
        if square < length && away.dot((b - a).cross(c - a)) > 0.0 {
            (length, best) = (square, Some((face, weights, away)));
        }
    }
    let (face, [_, v, w], out) = best?;
    let is_other = length.sqrt() > nearest.sqrt() + BESIDE_MM;
    if is_other || length > LONGEST_MM * LONGEST_MM {
        return None;
    }
    through(point, out, (samples, face, [v, w]))
}

/// The way `out` of a point through a face, at the lattice point nearest to weights `v` and `w` of its second and third corner.
fn through(
    point: Vector,
    out: Vector,
    (samples, face, weights): (&Samples, usize, [f32; 2]),
) -> Option<Buried> {
    // The lattice has `LATTICE` parts to an edge, and both numbers together stay within the face.
    let [i, j] = weights.map(|weight| (weight * LATTICE as f32).round() as u32);
    Some(Buried {
        out: out.try_normalize()?,
        depth: out.length(),
        row: samples.lattice_row(face, [i, j.min(LATTICE - i)])?,
        point,
    })
}

/// Where a tool's probes are, each once: those of a ball are all its middle.
fn probes(body: &Body, pose: &Pose) -> impl Iterator<Item = Vector> {
    // Equal probes follow each other, so the last one is enough to compare with.
    let mut last = None;
    let is_new = move |probe: &Vector| last.replace(*probe) != Some(*probe);
    let new = body.probes().filter(is_new);
    new.map(|probe| pose.transform_point(probe))
}

/// The deepest of a tool's probes that lie more than `least` mm below the touchable surface. Of one that may lie beside a rim of that surface
/// `is_inside` is asked.
fn deepest(
    (body, pose): (&Body, &Pose),
    (samples, isa): (&Samples, Isa),
    state: State<'_>,
    least: f32,
    mut is_inside: impl FnMut(Vector) -> bool,
) -> Option<Buried> {
    let mut deepest: Option<Buried> = None;
    let mut probes = probes(body, pose);
    loop {
        // By axis, which vectors of the processor take.
        let (mut points, mut count) = ([[0.0f32; AT_ONCE]; 3], 0);
        for (at, probe) in (0..AT_ONCE).zip(&mut probes) {
            let probe = probe.to_array();
            (0..3).for_each(|axis| points[axis][at] = probe[axis]);
            count += 1;
        }
        if count == 0 {
            return deepest;
        }
        let nodes = samples.nodes();
        let nearest = nearest_nodes(isa, (state.rest, state.u), nodes, &points);
        let squares = nearest.squares.iter().zip(nearest.places).take(count);
        for (at, (&square, place)) in squares.enumerate() {
            let depth = deepest.map_or(least, |buried| buried.depth);
            // No way out is longer than the distance to the nearest node, so this probe cannot be
            // deeper than the deepest so far.
            if square.sqrt() <= depth {
                continue;
            }
            let point = Vector::from([0, 1, 2].map(|axis| points[axis][at]));
            let (square, place) = nearest_inner(point, (square, place), samples, state);
            if square.sqrt() <= depth {
                continue;
            }
            if let Some((found, in_doubt)) = below(point, place, samples, state)
                && found.depth > depth
                && (!in_doubt || is_inside(point))
            {
                deepest = Some(found);
            }
        }
    }
}

/// The nearest corner of the samples' faces, given the nearest of those that are nodes: squared distance and place.
fn nearest_inner(
    point: Vector,
    nearest: (f32, u32),
    samples: &Samples,
    state: State<'_>,
) -> (f32, u32) {
    let inner = samples.inner_corners().iter();
    let places = samples.nodes().len() as u32..;
    inner.zip(places).fold(nearest, |least, (corner, place)| {
        let at = corner.gather(|node| state.position(node));
        match at.distance_squared(point) {
            square if square < least.0 => (square, place),
            _ => least,
        }
    })
}

/// The way out of a point that lies below the touchable surface where that is nearest, at the corner in place `nearest` of the samples', and
/// whether it leads along a face to a rim of the surface.
fn below(
    point: Vector,
    nearest: u32,
    samples: &Samples,
    state: State<'_>,
) -> Option<(Buried, bool)> {
    let mut best: Option<(f32, usize, [f32; 3], Vector)> = None;
    let mut face_outward = Vector::ZERO;
    let mut outward = Vector::ZERO;
    if samples.nodes().is_empty() {
        return None;
    }
    for &face in samples.faces_at(nearest) {
        let face = face as usize;
        let [a, b, c] = samples
            .corners(face)
            .map(|place| samples.corner_at(place, |node| state.position(node)));
        let weights = nearest_weights(point, [a, b, c]);
        let [u, v, w] = weights;
        let away = a * u + b * v + c * w - point;
        outward += (b - a).cross(c - a);
        if best.is_none_or(|best| away.length_squared() < best.0) {
            best = Some((away.length_squared(), face, weights, away));
            face_outward = (b - a).cross(c - a);
        }
    }
    let (_, face, weights, out) = best?;
    let [_, v, w] = weights;
    // Above the surface there is no way out to be found. The mean of the faces' normals holds on edges and nodes too.
    let along_normal = out.dot(face_outward);
    if out.dot(outward) <= 0.0 || along_normal <= 0.0 {
        return None;
    }
    let buried = through(point, out, (samples, face, [v, w]))?;
    let is_along = along_normal < IN_DOUBT * buried.depth * face_outward.length();
    Some((buried, is_along && is_on_rim(samples, face, weights)))
}

/// Whether a point of a face lies on an edge that no other face has, or at a corner of one.
/// An edge inside of the surface has two faces, one at its rim has one.
fn is_on_rim(samples: &Samples, face: usize, weights: [f32; 3]) -> bool {
    let corners = samples.corners(face);
    let is_at = |corner: u32| (corners.iter().zip(weights)).any(|(c, w)| *c == corner && w > 0.0);
    let is_single = |a: u32, b: u32| {
        let faces = samples.faces_at(a).iter();
        faces
            .filter(|face| samples.corners(**face as usize).contains(&b))
            .count()
            == 1
    };
    let around = |corner: u32| {
        let faces = samples.faces_at(corner).iter();
        let others = faces.flat_map(|face| samples.corners(*face as usize));
        others
            .into_iter()
            .any(|other| other != corner && is_single(corner, other))
    };
    let [a, b, c] = corners;
    match weights.iter().filter(|weight| **weight > 0.0).count() {
        1 => corners
            .into_iter()
            .any(|corner| is_at(corner) && around(corner)),
        2 => [(a, b), (b, c), (c, a)]
            .into_iter()
            .any(|(p, q)| is_at(p) && is_at(q) && is_single(p, q)),
        _ => false,
    }
}

/// Barycentric weights of the point of a triangle that is nearest to `p` (Ericson 2005, section 5.1.5).
fn nearest_weights(p: Vector, [a, b, c]: [Vector; 3]) -> [f32; 3] {
    let (ab, ac) = (b - a, c - a);
    let [d1, d2] = [ab, ac].map(|edge| edge.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let [d3, d4] = [ab, ac].map(|edge| edge.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let [d5, d6] = [ab, ac].map(|edge| edge.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    let (to_c, to_b) = (d4 - d3, d5 - d6);
    if va <= 0.0 && to_c >= 0.0 && to_b >= 0.0 {
        let w = to_c / (to_c + to_b);
        return [0.0, 1.0 - w, w];
    }
    let whole = va + vb + vc;
    [va / whole, vb / whole, vc / whole]
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::contact::{SPACING_MM, Shape};

    /// A plate of 20 by 20 mm that samples cover, and nothing beside it.
    #[test]
    fn a_tip_beside_the_rim_of_the_samples_is_not_in_the_tissue() {
        let at = |x: u32, y: u32| [10.0 * x as f32, 10.0 * y as f32, 0.0];
        let places: Vec<[f32; 3]> = (0..9).map(|i| at(i % 3, i / 3)).collect();
        let faces = [0, 1, 3, 4].into_iter();
        let faces: Vec<[u32; 3]> = faces
            .flat_map(|i| [[i, i + 1, i + 3], [i + 1, i + 4, i + 3]])
            .collect();
        let samples = Samples::new(&places, faces, &[], SPACING_MM);
        let ball = Shape::Sphere { radius: 1.0 };
        let body = Body::new(&ball).unwrap();
        let tip = |at: [f32; 3]| {
            let state = State {
                rest: places.as_flattened(),
                u: &[],
                start: &[],
            };
            let pose = Pose::from_translation(at.into());
            Buried::tip((&body, &pose), &samples, state, Isa::detect(), |_| false)
                .map(|tip| (tip.depth, tip.out))
        };
        let (depth, out) = tip([12.0, 9.0, -1.5]).unwrap();
        assert!((depth - 1.5).abs() < 1e-5 && out.distance(Vector::Z) < 1e-5);
        assert_eq!(tip([12.0, 9.0, 1.5]), None);
        // Below the plane of the plate, but beside it; and below its rim.
        assert_eq!(tip([21.5, 9.0, -0.3]), None);
        assert!(tip([20.2, 9.0, -1.5]).is_some());
    }
}
