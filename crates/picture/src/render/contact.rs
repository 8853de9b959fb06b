//! A contact on an organ: where it is looked at from, and the body deformed.

use tissue::mesh::Mesh;

use super::camera::Camera;
use super::colour::Palette;
use super::raster::{Image, Surface, draw};

/// A camera that looks at the contact from outside, a little from above.
pub fn contact_camera(points: &[[f32; 3]], site: [f64; 3], width: usize, height: usize) -> Camera {
    let count = points.len().max(1) as f32;
    let mut centre = [0.0f32; 3];
    for point in points {
        for (sum, value) in centre.iter_mut().zip(point) {
            *sum += value / count;
        }
    }
    let out = [0, 1, 2].map(|k| site[k] as f32 - centre[k]);
    let length = (out[0] * out[0] + out[1] * out[1]).sqrt().max(1e-3);
    // Mostly along the nearest horizontal axis, so that the picture is the familiar lateral view.
    let lateral = [out[0].signum(), 0.0, 0.0];
    let toward = [0, 1, 2].map(|k| lateral[k] + 0.35 * out[k] / length * f32::from(k < 2));
    Camera::framing(points, [toward[0], toward[1], 0.22], width, height)
}

/// The mesh at `displacement`, coloured by `values`.
pub fn deformed(
    mesh: &Mesh,
    displacement: &[[f32; 3]],
    values: &[f32],
    palette: Palette,
    full_scale: f32,
    camera: &Camera,
) -> Image {
    let positions: Vec<[f32; 3]> = mesh
        .positions
        .iter()
        .zip(displacement)
        .map(|(rest, u)| [0, 1, 2].map(|k| rest[k] + u[k]))
        .collect();
    let surface = Surface {
        positions: &positions,
        faces: &mesh.surface,
        values,
        palette,
        full_scale,
    };
    draw(&surface, camera)
}

/// Length of each vector.
pub fn lengths(field: &[[f32; 3]]) -> Vec<f32> {
    field
        .iter()
        .map(|u| u.iter().map(|v| v * v).sum::<f32>().sqrt())
        .collect()
}
