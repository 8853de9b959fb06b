//! Areas and volumes by rest positions `[K,3]`, mm, in f64.

/// Where a node is at rest. In f64 a difference of two f32 positions keeps its digits.
pub(super) fn at(positions: &[f32], node: u32) -> [f64; 3] {
    let i = 3 * node as usize;
    [
        positions[i] as f64,
        positions[i + 1] as f64,
        positions[i + 2] as f64,
    ]
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Six times the signed volume of a tetrahedron. Positive where the first three corners turn
/// counter-clockwise as seen from the fourth.
pub fn volume(positions: &[f32], tet: &[u32]) -> f64 {
    let origin = at(positions, tet[0]);
    let [a, b, c] = [1, 2, 3].map(|k| minus(at(positions, tet[k]), origin));
    let n = cross(a, b);
    n[0] * c[0] + n[1] * c[1] + n[2] * c[2]
}
