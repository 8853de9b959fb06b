//! The shape functions of a brick of twenty nodes at its eight points of integration (Gauss and Legendre's, two a side).

/// Nodes in the brick's own coordinates, -1 to 1: corners, then the middles of edges, by the axis that they lie along.
pub const NODES: [[i32; 3]; 20] = [
    [-1, -1, -1],
    [1, -1, -1],
    [-1, 1, -1],
    [1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [-1, 1, 1],
    [1, 1, 1],
    [0, -1, -1],
    [0, 1, -1],
    [0, -1, 1],
    [0, 1, 1],
    [-1, 0, -1],
    [1, 0, -1],
    [-1, 0, 1],
    [1, 0, 1],
    [-1, -1, 0],
    [1, -1, 0],
    [-1, 1, 0],
    [1, 1, 0],
];

/// Derivatives of the shape functions by the brick's own coordinates.
fn slopes(x: [f64; 3]) -> [[f64; 3]; 20] {
    NODES.map(|node| {
        let n = node.map(f64::from);
        let a = [0, 1, 2].map(|k| 1.0 + n[k] * x[k]);
        let middle = (0..3).find(|k| node[*k] == 0);
        [0, 1, 2].map(|k| {
            let [p, q] = [(k + 1) % 3, (k + 2) % 3];
            match middle {
                None => {
                    let sum = n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - 2.0;
                    0.125 * n[k] * a[p] * a[q] * (sum + a[k])
                }
                Some(own) if own == k => -0.5 * x[k] * a[p] * a[q],
                Some(own) => {
                    let other = if own == p { q } else { p };
                    0.25 * n[k] * a[other] * (1.0 - x[own] * x[own])
                }
            }
        })
    })
}

/// A point of integration: its volume, mm³, and the gradients of the shape functions, 1/mm.
pub struct Point {
    pub volume: f64,
    pub gradients: [[f64; 3]; 20],
}

/// Those of a brick between planes: its middle lies halfway, so its coordinates are its own times half its edges.
pub fn points(places: &[[f64; 3]; 20]) -> [Point; 8] {
    let half = [0, 1, 2].map(|k| 0.5 * (places[7][k] - places[0][k]));
    let at = 1.0 / 3.0f64.sqrt();
    [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
        let x = NODES[corner].map(|n| at * f64::from(n));
        Point {
            volume: half[0] * half[1] * half[2],
            gradients: slopes(x).map(|slope| [0, 1, 2].map(|k| slope[k] / half[k])),
        }
    })
}
