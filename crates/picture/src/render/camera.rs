//! An orthographic camera that frames a set of points.

/// A view: `right`, `up` and `toward` (from the scene to the eye) are orthonormal.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    right: [f32; 3],
    up: [f32; 3],
    toward: [f32; 3],
    /// Point (in the view's right and up axes, mm) that the middle of the picture shows.
    centre: [f32; 2],
    /// Pixels a millimetre.
    scale: f32,
    width: usize,
    height: usize,
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(a: [f32; 3]) -> [f32; 3] {
    let length = dot(a, a).sqrt().max(1e-12);
    a.map(|value| value / length)
}

impl Camera {
    /// Looks along `-toward` at `points` (mm) with z up, framing all of them in `width` x `height` pixels
    /// with a margin of 4 %.
    pub fn framing(points: &[[f32; 3]], toward: [f32; 3], width: usize, height: usize) -> Self {
        let toward = unit(toward);
        let pole = if toward[2].abs() > 0.95 {
            [0.0, 1.0, 0.0]
        } else {
            [0.0, 0.0, 1.0]
        };
        let right = unit(cross(pole, toward));
        let up = cross(toward, right);
        let mut low = [f32::INFINITY; 2];
        let mut high = [f32::NEG_INFINITY; 2];
        for point in points {
            for (axis, direction) in [right, up].into_iter().enumerate() {
                let value = dot(*point, direction);
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let extent = [0, 1].map(|axis| (high[axis] - low[axis]).max(1e-3));
        let scale = (width as f32 / extent[0]).min(height as f32 / extent[1]) * 0.92;
        let centre = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        Self {
            right,
            up,
            toward,
            centre,
            scale,
            width,
            height,
        }
    }

    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Pixel x, pixel y (down) and depth (larger is nearer), for pictures of `samples` times the size.
    pub(super) fn project(&self, point: [f32; 3], samples: usize) -> [f32; 3] {
        let scale = self.scale * samples as f32;
        [
            (dot(point, self.right) - self.centre[0]) * scale + 0.5 * (self.width * samples) as f32,
            0.5 * (self.height * samples) as f32 - (dot(point, self.up) - self.centre[1]) * scale,
            dot(point, self.toward),
        ]
    }

    /// Direction to the light: over the viewer's left shoulder.
    pub(super) fn light(&self) -> [f32; 3] {
        unit([0, 1, 2].map(|k| self.toward[k] + 0.55 * self.up[k] - 0.45 * self.right[k]))
    }

    pub(super) fn toward(&self) -> [f32; 3] {
        self.toward
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_framed_points_lie_inside_the_picture_and_nearer_is_deeper() {
        let points = [[-10.0, 0.0, 0.0], [10.0, 5.0, 3.0], [0.0, -7.0, 20.0]];
        let camera = Camera::framing(&points, [-1.0, 0.0, 0.2], 120, 80);
        for point in points {
            let [x, y, _] = camera.project(point, 1);
            assert!(
                (0.0..120.0).contains(&x) && (0.0..80.0).contains(&y),
                "{x} {y}"
            );
        }
        assert!(camera.project(points[0], 1)[2] > camera.project(points[1], 1)[2]);
    }
}
