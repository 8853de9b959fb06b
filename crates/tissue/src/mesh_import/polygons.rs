//! Polygons as triangles: a fan where that covers the polygon once, ears cut off one by one where it is not convex
//! (Meisters 1975).

/// Polygons of more corners are always fans: cutting ears takes up to the cube of the corners.
const MOST_CORNERS: usize = 32;

/// Triangles of a polygon of nodes. They do not depend on where its list begins, so that a polygon that comes twice is cut twice
/// in the same way. Nodes that `positions` lacks are left for the checks.
pub fn triangles(polygon: &[u32], positions: &[[f64; 3]]) -> Vec<[u32; 3]> {
    let first = (0..polygon.len())
        .min_by_key(|&at| polygon[at])
        .unwrap_or(0);
    let mut ring = polygon.to_vec();
    ring.rotate_left(first);
    let fan: Vec<[u32; 3]> = (1..ring.len().saturating_sub(1))
        .map(|side| [ring[0], ring[side], ring[side + 1]])
        .collect();
    if !(4..=MOST_CORNERS).contains(&ring.len())
        || ring.iter().any(|&node| node as usize >= positions.len())
    {
        return fan;
    }
    let at = |node: u32| positions[node as usize];
    // Newell's normal, twice the polygon's area long.
    let normal = fan
        .iter()
        .fold([0.0; 3], |sum, face| add(sum, area(face.map(at))));
    let is_turned_right = |face: &[u32; 3]| dot(area(face.map(at)), normal) >= 0.0;
    if fan.iter().all(is_turned_right) {
        return fan;
    }
    ears(ring, at, normal).unwrap_or(fan)
}

/// Cuts ears off; none where the ring passes through itself.
fn ears(
    mut ring: Vec<u32>,
    at: impl Fn(u32) -> [f64; 3],
    normal: [f64; 3],
) -> Option<Vec<[u32; 3]>> {
    let mut out = Vec::new();
    while ring.len() > 3 {
        let count = ring.len();
        let corner = |k: usize| {
            [
                ring[(k + count - 1) % count],
                ring[k],
                ring[(k + 1) % count],
            ]
        };
        let ear = (0..count).find(|&k| {
            let face = corner(k);
            let place = face.map(&at);
            dot(area(place), normal) > 0.0
                && ring
                    .iter()
                    .filter(|node| !face.contains(node))
                    .all(|&node| !covers(place, at(node), normal))
        })?;
        out.push(corner(ear));
        ring.remove(ear);
    }
    out.push([ring[0], ring[1], ring[2]]);
    Some(out)
}

/// Whether a triangle that is turned as `normal` holds a point, seen along `normal`.
fn covers([a, b, c]: [[f64; 3]; 3], point: [f64; 3], normal: [f64; 3]) -> bool {
    [[a, b], [b, c], [c, a]]
        .iter()
        .all(|&[p, q]| dot(area([p, q, point]), normal) >= 0.0)
}

/// Twice the area vector of a triangle.
fn area([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
