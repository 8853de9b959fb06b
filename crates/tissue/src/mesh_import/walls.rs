//! Where a lattice must be finer than it is: the thin places of a body, found by place.

use super::thickness::Sample;
use std::collections::HashMap;

/// Places in thin walls, with the spacing that they need, by cubes of the lattice.
pub struct Walls {
    size: f64,
    by_cube: HashMap<[i64; 3], Vec<([f64; 3], f64)>>,
}

impl Walls {
    /// `samples` where a spacing of the thickness over `fine` resolves the wall; `spacing` is that of the lattice.
    pub fn of(samples: &[Sample], fine: f64, spacing: f64) -> Self {
        let mut walls = Self {
            size: spacing,
            by_cube: HashMap::new(),
        };
        for sample in samples {
            let fine = sample.thickness / fine;
            if fine >= spacing {
                continue;
            }
            for place in [sample.at, sample.middle()] {
                let cube = place.map(|x| (x / spacing).floor() as i64);
                walls.by_cube.entry(cube).or_default().push((place, fine));
            }
        }
        walls
    }

    /// Whether a place in or beside a tetrahedron needs a spacing smaller than `size`.
    pub fn finer_than(&self, corners: &[[f64; 3]; 4], size: f64) -> bool {
        let margin = 0.1 * size;
        let low =
            [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min) - margin);
        let high = [0, 1, 2].map(|k| {
            corners
                .iter()
                .map(|p| p[k])
                .fold(f64::NEG_INFINITY, f64::max)
                + margin
        });
        let [from, to] = [low, high].map(|p| p.map(|x| (x / self.size).floor() as i64));
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    let places = self.by_cube.get(&[x, y, z]).map_or(&[][..], Vec::as_slice);
                    let within = |&(place, fine): &([f64; 3], f64)| {
                        fine < size && (0..3).all(|k| (low[k]..=high[k]).contains(&place[k]))
                    };
                    if places.iter().any(within) {
                        return true;
                    }
                }
            }
        }
        false
    }
}
