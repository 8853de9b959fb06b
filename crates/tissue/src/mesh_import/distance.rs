//! Exact signed distance to a closed, outward oriented triangle surface (parry's bounding volume
//! hierarchy and angle-weighted pseudo-normals; Baerentzen and Aanaes 2005 for the sign).

use super::{ImportError, RawSurface};
use crate::stuffing::Field;
use parry3d_f64::math::Vector;
use parry3d_f64::query::{PointQuery, Ray, RayCast};
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

/// Distance to a surface, mm, positive inside.
pub struct SurfaceDistance {
    surface: TriMesh,
    low: [f64; 3],
    high: [f64; 3],
}

impl SurfaceDistance {
    /// `surface` must be closed and oriented outward; [`super::import`] checks that.
    pub fn new(surface: RawSurface) -> Result<Self, ImportError> {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for p in &surface.positions {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let points = surface
            .positions
            .iter()
            .map(|p| Vector::new(p[0], p[1], p[2]))
            .collect();
        let surface = TriMesh::with_flags(points, surface.faces, TriMeshFlags::ORIENTED).map_err(
            |error| ImportError::Format {
                path: "surface".into(),
                reason: error.to_string(),
            },
        )?;
        Ok(Self { surface, low, high })
    }
}

/// A way through the body that is shorter than this part of its box is the face that it starts on.
const SKIN: f64 = 1e-9;

impl SurfaceDistance {
    /// The nearest point of the surface.
    pub(super) fn nearest(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let point = self
            .surface
            .project_local_point(Vector::new(x, y, z), false)
            .point;
        [point.x, point.y, point.z]
    }

    /// From a point of the surface along a direction of length 1 to where it comes out, mm.
    pub(super) fn along(&self, from: [f64; 3], way: [f64; 3]) -> Option<f64> {
        let size = (0..3).map(|k| self.high[k] - self.low[k]).sum::<f64>();
        let start = [0, 1, 2].map(|k| from[k] + SKIN * size * way[k]);
        let [origin, way] = [start, way].map(|[x, y, z]| Vector::new(x, y, z));
        self.surface
            .cast_local_ray(&Ray::new(origin, way), 2.0 * size, false)
    }
}

impl Field for SurfaceDistance {
    fn value(&self, [x, y, z]: [f64; 3]) -> f64 {
        let point = Vector::new(x, y, z);
        let nearest = self.surface.project_local_point(point, false);
        let distance = (nearest.point - point).length();
        if nearest.is_inside {
            distance
        } else {
            -distance
        }
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        (self.low, self.high)
    }
}
