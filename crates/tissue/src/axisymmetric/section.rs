//! A plane through the axis of a body of revolution, in triangles.

/// Nodes and triangles of a cylinder's plane.
#[derive(Clone, Debug)]
pub struct Section {
    /// Distance from the axis and place along it, mm.
    pub(super) places: Vec<[f64; 2]>,
    pub(super) triangles: Vec<[usize; 3]>,
    /// Lines of nodes from the axis outwards, and along it.
    counts: [usize; 2],
}

impl Section {
    /// A cylinder between lines at these distances from the axis, the first 0, and places along it, both rising; four triangles meet in the middle of each
    /// quadrilateral.
    pub fn grid(across: &[f64], along: &[f64]) -> Self {
        let counts = [across.len(), along.len()];
        let mut own = Self {
            places: Vec::new(),
            triangles: Vec::new(),
            counts,
        };
        for i in 0..counts[0] {
            own.places.extend(along.iter().map(|z| [across[i], *z]));
            let Some(next) = across.get(i + 1) else {
                break;
            };
            for j in 0..counts[1] - 1 {
                let middle = own.node(i, counts[1] + j);
                let around = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                let around = around.map(|[i, j]| own.node(i, j));
                for k in 0..4 {
                    own.triangles.push([around[k], around[(k + 1) % 4], middle]);
                }
                let r = 0.5 * (across[i] + next);
                own.places.push([r, 0.5 * (along[j] + along[j + 1])]);
            }
        }
        own
    }

    /// The node on the `i`-th line from the axis and the `j`-th along it.
    pub fn node(&self, i: usize, j: usize) -> usize {
        i * (2 * self.counts[1] - 1) + j
    }

    /// The nodes at the `j`-th place along the axis, from the axis outwards.
    pub fn level(&self, j: usize) -> Vec<usize> {
        (0..self.counts[0]).map(|i| self.node(i, j)).collect()
    }

    /// The nodes at the `i`-th distance from the axis, along it.
    pub fn side(&self, i: usize) -> Vec<usize> {
        (0..self.counts[1]).map(|j| self.node(i, j)).collect()
    }

    /// Distance from the axis and place along it of a node at rest, mm.
    pub fn place(&self, node: usize) -> [f64; 2] {
        self.places[node]
    }

    /// How far apart the unknowns of one triangle lie.
    pub(super) fn width(&self) -> usize {
        let apart = self.triangles.iter().map(|[a, b, c]| {
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            high - low
        });
        2 * apart.max().unwrap_or(0) + 1
    }
}

/// Lines in the middle between each two, so many times.
pub fn halved(mut lines: Vec<f64>, times: usize) -> Vec<f64> {
    for _ in 0..times {
        let pairs = lines.windows(2);
        let both = pairs.flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
        lines = both.chain(lines.last().copied()).collect();
    }
    lines
}
