//! A uniform cell grid over points in mm: radius queries and nearest point, for load-time searches.
//!
//! Cells are cubes with about two points each, so a query looks at a few of them. Points of a cell
//! lie one behind the other, in the order of their numbers, which makes ties of
//! [`PointGrid::nearest`] the same on every machine. It is made when a bundle is opened and no step
//! uses it.

use crate::memory;

/// Points sorted into cubic cells.
#[derive(Debug)]
pub struct PointGrid {
    /// `[n,3]`, mm.
    points: Vec<f32>,
    /// Lowest corner of the grid, mm; edge of a cell, mm; cells along each axis.
    origin: [f32; 3],
    cell: f32,
    dims: [usize; 3],
    /// Points by cell, ascending in each: those of cell `c` are `items[offsets[c]..offsets[c + 1]]`.
    offsets: Vec<u32>,
    items: Vec<u32>,
}

/// Squared distance in f64 of f32 coordinates, `(dx*dx + dy*dy) + dz*dz`.
pub fn squared_distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let [dx, dy, dz] = [0, 1, 2].map(|k| a[k] as f64 - b[k] as f64);
    (dx * dx + dy * dy) + dz * dz
}

impl PointGrid {
    /// A grid of about two points a cell over `points [n,3]`, n > 0.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn try_new(points: Vec<f32>) -> crate::error::Result<PointGrid> {
        const WHAT: &str = "a grid of points";
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for point in points.chunks_exact(3) {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let count = (points.len() / 3).max(1);
        // A flat cloud, or a single point, still has a cell.
        let extent = [0, 1, 2].map(|axis| (high[axis] - low[axis]).max(1e-3));
        let volume = extent[0] as f64 * extent[1] as f64 * extent[2] as f64;
        let longest = extent.iter().copied().fold(0.0, f32::max);
        // At most some 256 cells along the longest axis, however thin the cloud is.
        let cell = (libm::cbrt(2.0 * volume / count as f64) as f32).max(longest / 256.0);
        let dims = extent.map(|length| (length / cell) as usize + 1);
        let mut grid = PointGrid {
            points,
            origin: low,
            cell,
            dims,
            offsets: memory::filled(dims[0] * dims[1] * dims[2] + 1, 0, WHAT)?,
            items: memory::filled(count, 0, WHAT)?,
        };
        let cells = grid
            .points
            .chunks_exact(3)
            .map(|p| grid.index(grid.cell_of([p[0], p[1], p[2]])));
        let cells = memory::collected(count, cells, WHAT)?;
        for &cell in &cells {
            grid.offsets[cell + 1] += 1;
        }
        // Counts become starts.
        for i in 1..grid.offsets.len() {
            grid.offsets[i] += grid.offsets[i - 1];
        }
        let mut next = memory::copied(&grid.offsets, WHAT)?;
        for (item, &cell) in cells.iter().enumerate() {
            grid.items[next[cell] as usize] = item as u32;
            next[cell] += 1;
        }
        Ok(grid)
    }

    /// Points outside of the grid are in the nearest cell of its border.
    fn cell_of(&self, p: [f32; 3]) -> [usize; 3] {
        [0, 1, 2].map(|axis| {
            let c = ((p[axis] - self.origin[axis]) / self.cell).floor();
            (c.max(0.0) as usize).min(self.dims[axis] - 1)
        })
    }

    /// Place of a cell in the list of all.
    fn index(&self, c: [usize; 3]) -> usize {
        (c[2] * self.dims[1] + c[1]) * self.dims[0] + c[0]
    }

    /// Where a point is, mm.
    fn point(&self, item: u32) -> [f32; 3] {
        let i = 3 * item as usize;
        [self.points[i], self.points[i + 1], self.points[i + 2]]
    }

    /// Calls `visit(index, squared distance)` for every point with `d2 <= radius^2`, in no particular order.
    pub fn within(&self, p: [f32; 3], radius: f64, mut visit: impl FnMut(u32, f64)) {
        // A hair more than the radius, so that rounding of cell borders loses no point.
        let reach = (radius * (1.0 + 1e-5)) as f32 + 1e-3;
        let low = self.cell_of([p[0] - reach, p[1] - reach, p[2] - reach]);
        let high = self.cell_of([p[0] + reach, p[1] + reach, p[2] + reach]);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let cell = self.index([x, y, z]);
                    for &item in
                        &self.items[self.offsets[cell] as usize..self.offsets[cell + 1] as usize]
                    {
                        let d2 = squared_distance(p, self.point(item));
                        if d2 <= radius * radius {
                            visit(item, d2);
                        }
                    }
                }
            }
        }
    }

    /// Index of the nearest point; ties take the smallest index.
    pub fn nearest(&self, p: [f32; 3]) -> u32 {
        let mut radius = self.cell as f64;
        // Outside of the grid's box the first radius that can reach it.
        let outside: f64 = (0..3)
            .map(|axis| {
                let low = self.origin[axis];
                let high = low + self.cell * self.dims[axis] as f32;
                (low - p[axis]).max(p[axis] - high).max(0.0) as f64
            })
            .fold(0.0, f64::max);
        radius += outside;
        loop {
            let mut best: Option<(f64, u32)> = None;
            self.within(p, radius, |item, d2| {
                if best.is_none_or(|b| (d2, item) < b) {
                    best = Some((d2, item));
                }
            });
            if let Some((_, item)) = best {
                return item;
            }
            // Whatever lies within the radius was found, so the first hit is the nearest of all.
            radius *= 2.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(count: usize) -> Vec<f32> {
        let mut state = 1u64;
        (0..3 * count)
            .map(|_| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                (state >> 40) as f32 / (1u64 << 24) as f32 * 100.0
            })
            .collect()
    }

    #[test]
    fn queries_find_what_a_full_search_finds() {
        let points = cloud(700);
        let grid = PointGrid::try_new(points.clone()).unwrap();
        for p in cloud(60).chunks_exact(3) {
            let p = [p[0] * 1.4 - 20.0, p[1], p[2]];
            let mut found = Vec::new();
            grid.within(p, 17.0, |item, _| found.push(item));
            found.sort_unstable();
            let distance = |i: &u32| {
                let i = 3 * *i as usize;
                squared_distance(p, [points[i], points[i + 1], points[i + 2]])
            };
            let all: Vec<u32> = (0..700u32).filter(|i| distance(i) <= 17.0 * 17.0).collect();
            assert_eq!(found, all);
            let best = (0..700u32)
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .unwrap();
            assert_eq!(distance(&grid.nearest(p)), distance(&best));
        }
    }

    #[test]
    fn points_in_a_plane_and_a_single_point_work() {
        let flat: Vec<f32> = cloud(50)
            .chunks_exact(3)
            .flat_map(|p| [p[0], p[1], 0.0])
            .collect();
        assert!(PointGrid::try_new(flat).unwrap().nearest([50.0, 50.0, 3.0]) < 50);
        assert_eq!(
            PointGrid::try_new(vec![1.0, 2.0, 3.0])
                .unwrap()
                .nearest([1e6, 0.0, 0.0]),
            0
        );
    }
}
