//! Where a lattice must be finer than it is: the thin places of a body, found by place.

use super::thickness::Sample;
use std::collections::HashMap;

/// Places in thin walls, with the spacing that they need, by cubes of the lattice.
pub struct Walls {
    size: f64,
    by_cube: HashMap<[i64; 3], Vec<Place>>,
    /// The largest of all.
    reach: f64,
}

/// A place in a thin wall.
struct Place {
    at: [f64; 3],
    /// The spacing that it needs.
    fine: f64,
    /// How far it speaks for what lies around it, mm: in a neck whose lattice is finer than the samples lie apart.
    reach: f64,
}

/// A sample's reach over the root of the area that it stands for.
const REACH: f64 = 0.6;
/// It has one where the lattice is finer than this part of that root.
const SPARSE: f64 = 0.5;

impl Walls {
    /// `samples` where a spacing of the thickness over `fine` resolves the wall; `spacing` is that of the lattice.
    pub fn of(samples: &[Sample], fine: f64, spacing: f64) -> Self {
        let mut walls = Self {
            size: spacing,
            by_cube: HashMap::new(),
            reach: 0.0,
        };
        for sample in samples {
            let fine = sample.thickness / fine;
            if fine >= spacing {
                continue;
            }
            let apart = sample.area.sqrt();
            let reach = match fine < SPARSE * apart {
                true => REACH * apart,
                false => 0.0,
            };
            walls.reach = walls.reach.max(reach);
            for at in [sample.at, sample.middle()] {
                let cube = at.map(|x| (x / spacing).floor() as i64);
                let place = Place { at, fine, reach };
                walls.by_cube.entry(cube).or_default().push(place);
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
        let cube = |x: f64| (x / self.size).floor() as i64;
        let from = low.map(|x| cube(x - self.reach));
        let to = high.map(|x| cube(x + self.reach));
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    let places = self.by_cube.get(&[x, y, z]).map_or(&[][..], Vec::as_slice);
                    let within = |place: &Place| {
                        let near = |k: usize| {
                            let reach = place.reach;
                            (low[k] - reach..=high[k] + reach).contains(&place.at[k])
                        };
                        place.fine < size && (0..3).all(near)
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
