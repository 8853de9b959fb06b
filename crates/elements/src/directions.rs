//! Directions of fibres, packed as the clusters are.

use crate::vector::dot;
use lanes::WIDTH;

/// Of sixteen clusters with `TETS` tetrahedra each.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Directions<const TETS: usize> {
    /// The direction at rest, unit or zero.
    pub direction: [[[f32; WIDTH]; 3]; TETS],
    /// Slope of the shape functions of corners 1..=3 along it, 1/mm.
    pub slopes: [[[f32; WIDTH]; 3]; TETS],
    /// Rest volume times the element's stiffness over the material's, mm³; zero in padding lanes and where there is no direction.
    pub volume: [[f32; WIDTH]; TETS],
}

impl<const TETS: usize> Directions<TETS> {
    /// Without any element.
    pub const EMPTY: Self = Self {
        direction: [[[0.0; WIDTH]; 3]; TETS],
        slopes: [[[0.0; WIDTH]; 3]; TETS],
        volume: [[0.0; WIDTH]; TETS],
    };

    /// Puts one element into a lane: its gradients (1/mm), its direction, and its volume (mm³) times its stiffness.
    pub fn set(
        &mut self,
        (tet, lane): (usize, usize),
        gradients: [[f64; 3]; 3],
        direction: [f32; 3],
        volume: f64,
    ) {
        let slopes = gradients.map(|g| dot(g, direction.map(f64::from)) as f32);
        for axis in 0..3 {
            self.direction[tet][axis][lane] = direction[axis];
            self.slopes[tet][axis][lane] = slopes[axis];
        }
        let is_none = direction == [0.0; 3];
        self.volume[tet][lane] = if is_none { 0.0 } else { volume as f32 };
    }

    /// The direction of an element.
    pub fn of(&self, tet: usize, lane: usize) -> [f32; 3] {
        self.direction[tet].map(|row| row[lane])
    }

    /// Takes the elements of another batch's cluster.
    pub fn copy_lane(&mut self, source: &Self, lane: usize, at: usize) {
        for tet in 0..TETS {
            for axis in 0..3 {
                self.direction[tet][axis][at] = source.direction[tet][axis][lane];
                self.slopes[tet][axis][at] = source.slopes[tet][axis][lane];
            }
            self.volume[tet][at] = source.volume[tet][lane];
        }
    }

    /// Lane `at` has no fibres.
    pub fn clear_lane(&mut self, at: usize) {
        for tet in 0..TETS {
            for axis in 0..3 {
                self.direction[tet][axis][at] = 0.0;
                self.slopes[tet][axis][at] = 0.0;
            }
            self.volume[tet][at] = 0.0;
        }
    }
}
