//! What filling gives: tetrahedra, or why there are none.

/// Tetrahedra made by [`stuff`](super::stuff), before they become a checked mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stuffed {
    /// `[K, 3]`, in the unit of the field.
    pub positions: Vec<[f64; 3]>,
    /// `[T, 4]`, positive volume: `(b - a) . ((c - a) x (d - a)) > 0`.
    pub tets: Vec<[u32; 4]>,
    /// Tetrahedra dropped because they hung on by an edge, a node or not at all.
    pub dropped: usize,
}

/// Why nothing was stuffed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StuffError {
    /// The spacing is not a positive finite number.
    #[error("lattice spacing {0} is not a positive finite length; give one in mm")]
    Spacing(f64),
    /// The lattice would not fit in 32-bit node numbers.
    #[error("lattice of {0} nodes is too large; use a larger spacing than {1} mm")]
    TooLarge(u64, f64),
    /// The field is not a number at a lattice node.
    #[error("the field is {value} at ({x}, {y}, {z}); it must be finite")]
    NotFinite { value: f64, x: f64, y: f64, z: f64 },
    /// No lattice node is inside.
    #[error("no lattice node lies inside the surface at spacing {0} mm; use a smaller spacing")]
    Empty(f64),
}

/// Six times the signed volume of the tetrahedron `a b c d`.
pub(crate) fn volume6(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}
