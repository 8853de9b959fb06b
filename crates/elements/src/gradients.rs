//! Gradients of shape functions, packed as the clusters are: what a law in principal stretches needs beside the slots.

use lanes::WIDTH;

/// Of sixteen clusters with `TETS` tetrahedra each.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Gradients<const TETS: usize> {
    /// `rows[t][3 k + i]`: component `i` of the gradient of corner `k` of `corners(t)`, 1/mm.
    pub rows: [[[f32; WIDTH]; 9]; TETS],
    /// Rest volume times the element's stiffness over the material's, mm³; zero in padding lanes.
    pub volume: [[f32; WIDTH]; TETS],
}

impl<const TETS: usize> Gradients<TETS> {
    /// Without any element.
    pub const EMPTY: Self = Self {
        rows: [[[0.0; WIDTH]; 9]; TETS],
        volume: [[0.0; WIDTH]; TETS],
    };

    /// Puts one element into a lane: its gradients (1/mm), and its volume (mm³) times its stiffness.
    pub fn set(&mut self, tet: usize, lane: usize, gradients: [[f64; 3]; 3], volume: f64) {
        let values = gradients.as_flattened();
        for (row, value) in self.rows[tet].iter_mut().zip(values) {
            row[lane] = *value as f32;
        }
        self.volume[tet][lane] = volume as f32;
    }

    /// Takes the elements of another batch's cluster.
    pub fn copy_lane(&mut self, source: &Self, lane: usize, at: usize) {
        let own = self.rows.as_flattened_mut().iter_mut();
        for (own, source) in own.zip(source.rows.as_flattened()) {
            own[at] = source[lane];
        }
        for (own, source) in self.volume.iter_mut().zip(&source.volume) {
            own[at] = source[lane];
        }
    }

    /// Lane `at` becomes the shape of `lane`, without volume.
    pub fn repeat_lane(&mut self, lane: usize, at: usize) {
        for row in self.rows.as_flattened_mut() {
            row[at] = row[lane];
        }
        for row in &mut self.volume {
            row[at] = 0.0;
        }
    }
}
