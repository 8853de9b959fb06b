//! Bricks of twenty nodes between planes: corners, and the middles of their edges.

use super::brick::NODES;

/// How much smaller than their mean the last cells are.
const GRADING: f64 = 0.75;

/// Planes of cells and their middles from the middle of a side to its end, or over the whole of it; mm, rising.
pub fn lines(cells: usize, half: f64, whole: bool) -> Vec<f64> {
    let upper = |k: usize| {
        let t = k as f64 / cells as f64;
        half * (t + GRADING * t * (1.0 - t))
    };
    let corners: Vec<f64> = match whole {
        false => (0..=cells).map(upper).collect(),
        true => {
            let lower = (1..=cells).rev().map(|k| -upper(k));
            lower.chain((0..=cells).map(upper)).collect()
        }
    };
    let mut out = vec![corners[0]];
    for pair in corners.windows(2) {
        out.extend([0.5 * (pair[0] + pair[1]), pair[1]]);
    }
    out
}

/// Nodes and bricks.
pub struct Grid {
    /// At rest, mm.
    pub places: Vec<[f64; 3]>,
    /// In the order of [`NODES`].
    pub bricks: Vec<[usize; 20]>,
}

impl Grid {
    /// Between planes across each axis: those of cells, and one in the middle of each two.
    pub fn new(planes: [&[f64]; 3]) -> Self {
        let counts = planes.map(<[f64]>::len);
        let mut places = Vec::new();
        let mut numbers = vec![None; counts.iter().product()];
        let slot = |at: [usize; 3]| (at[0] * counts[1] + at[1]) * counts[2] + at[2];
        for i in 0..counts[0] {
            for j in 0..counts[1] {
                for k in 0..counts[2] {
                    // Middles of faces and of bricks have none.
                    if i % 2 + j % 2 + k % 2 < 2 {
                        numbers[slot([i, j, k])] = Some(places.len());
                        places.push([planes[0][i], planes[1][j], planes[2][k]]);
                    }
                }
            }
        }
        let mut bricks = Vec::new();
        for i in (1..counts[0]).step_by(2) {
            for j in (1..counts[1]).step_by(2) {
                for k in (1..counts[2]).step_by(2) {
                    let node = |way: [i32; 3]| {
                        let near = |at: usize, by: i32| at.wrapping_add_signed(by as isize);
                        numbers[slot([near(i, way[0]), near(j, way[1]), near(k, way[2])])]
                            .unwrap_or_default()
                    };
                    bricks.push(NODES.map(node));
                }
            }
        }
        Self { places, bricks }
    }

    /// The largest distance between two unknowns of a brick.
    pub fn width(&self) -> usize {
        let apart = |nodes: &[usize; 20]| {
            let most = nodes.iter().copied().max().unwrap_or(0);
            let least = nodes.iter().copied().min().unwrap_or(0);
            3 * (most - least) + 2
        };
        self.bricks.iter().map(apart).max().unwrap_or(0)
    }
}
