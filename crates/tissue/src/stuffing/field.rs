//! Fields that can be stuffed: signed distances on a voxel grid, and half spaces to cut them by.

/// A continuous scalar field, positive inside the body.
pub trait Field: Sync {
    /// Value at `point`, in the unit of length of the positions.
    fn value(&self, point: [f64; 3]) -> f64;
    /// A box `(low, high)` that holds every point where the field is positive.
    fn bounds(&self) -> ([f64; 3], [f64; 3]);
}

/// Values on a regular grid of cubic voxels, trilinear in between, the outermost value beyond.
#[derive(Clone, Debug)]
pub struct GridField {
    /// Position of sample `[0, 0, 0]`.
    pub origin: [f64; 3],
    /// Edge of a voxel.
    pub voxel: f64,
    /// Samples along x, y, z; at least 2 each.
    pub shape: [usize; 3],
    /// `[nx, ny, nz]` row-major (z fastest), positive inside.
    pub values: Vec<f32>,
}

impl Field for GridField {
    fn value(&self, point: [f64; 3]) -> f64 {
        let mut index = [0usize; 3];
        let mut fraction = [0.0f64; 3];
        for axis in 0..3 {
            let last = (self.shape[axis] - 1) as f64;
            let at = ((point[axis] - self.origin[axis]) / self.voxel).clamp(0.0, last);
            index[axis] = (at.floor() as usize).min(self.shape[axis] - 2);
            fraction[axis] = at - index[axis] as f64;
        }
        let sample = |dx: usize, dy: usize, dz: usize| {
            let [x, y, z] = [index[0] + dx, index[1] + dy, index[2] + dz];
            f64::from(self.values[(x * self.shape[1] + y) * self.shape[2] + z])
        };
        let [fx, fy, fz] = fraction;
        let along_z = |dx, dy| sample(dx, dy, 0) * (1.0 - fz) + sample(dx, dy, 1) * fz;
        let along_y = |dx| along_z(dx, 0) * (1.0 - fy) + along_z(dx, 1) * fy;
        along_y(0) * (1.0 - fx) + along_y(1) * fx
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let mut high = self.origin;
        for axis in 0..3 {
            high[axis] += self.voxel * (self.shape[axis] - 1) as f64;
        }
        (self.origin, high)
    }
}

impl GridField {
    /// Volume inside of a distance field within this grid, by its samples: of the voxel around each the part that is inside, about.
    pub fn volume_of(&self, field: &impl Field) -> f64 {
        let [nx, ny, nz] = self.shape;
        let mut sum = 0.0;
        for x in 0..nx {
            for y in 0..ny {
                for z in 0..nz {
                    let index = [x as f64, y as f64, z as f64];
                    let point = [0, 1, 2].map(|k| self.origin[k] + self.voxel * index[k]);
                    sum += (0.5 + field.value(point) / self.voxel).clamp(0.0, 1.0);
                }
            }
        }
        sum * self.voxel.powi(3)
    }
}

/// `inner` with its surface moved outward by `by`.
pub struct Offset<'a, F> {
    pub inner: &'a F,
    pub by: f64,
}

impl<F: Field> Field for Offset<'_, F> {
    fn value(&self, point: [f64; 3]) -> f64 {
        self.inner.value(point) + self.by
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let (low, high) = self.inner.bounds();
        (low.map(|x| x - self.by), high.map(|x| x + self.by))
    }
}

/// The part of `inner` where `normal . p + offset > 0`; `normal` has length 1.
#[derive(Clone, Debug)]
pub struct HalfSpace<F> {
    pub inner: F,
    pub normal: [f64; 3],
    pub offset: f64,
}

impl<F: Field> Field for HalfSpace<F> {
    fn value(&self, point: [f64; 3]) -> f64 {
        let [a, b, c] = self.normal;
        let plane = a * point[0] + b * point[1] + c * point[2] + self.offset;
        self.inner.value(point).min(plane)
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        self.inner.bounds()
    }
}
