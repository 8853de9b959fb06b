//! Filling triangles: barycentric scan conversion with a z-buffer, then averaging the samples of a pixel.

use anyhow::{Context, Result};

use super::{Camera, Palette};

/// Samples a pixel along each axis.
const SAMPLES: usize = 2;

/// A triangle surface with one value a node.
pub struct Surface<'a> {
    /// `[K,3]`, mm, deformed.
    pub positions: &'a [[f32; 3]],
    /// Triangles, outward.
    pub faces: &'a [[u32; 3]],
    /// `[K]`, the value to colour by, or empty: plain tissue.
    pub values: &'a [f32],
    pub palette: Palette,
    /// The value that gets the last colour.
    pub full_scale: f32,
}

/// An RGBA picture, 8 bits a channel, transparent where nothing is drawn.
pub struct Image {
    pub width: usize,
    pub height: usize,
    pub rgba: Vec<u8>,
}

impl Image {
    /// The picture as a PNG file's bytes.
    pub fn png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&self.rgba))
            .context("cannot encode a PNG")?;
        Ok(bytes)
    }

    /// Draws `other` over this opaque picture, its upper left corner at (`x`, `y`).
    pub fn blend(&mut self, other: &Image, x: usize, y: usize) {
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            for column in 0..other.width.min(self.width.saturating_sub(x)) {
                let to = ((y + row) * self.width + x + column) * 4;
                let from = (row * other.width + column) * 4;
                let alpha = u32::from(other.rgba[from + 3]);
                for channel in 0..3 {
                    let mixed = u32::from(other.rgba[from + channel]) * alpha
                        + u32::from(self.rgba[to + channel]) * (255 - alpha);
                    self.rgba[to + channel] = (mixed / 255) as u8;
                }
            }
        }
    }

    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, rgba: [u8; 4]) -> Self {
        Self {
            width,
            height,
            rgba: rgba.repeat(width * height),
        }
    }
}

/// Draws the surface as the camera sees it.
pub fn draw(surface: &Surface<'_>, camera: &Camera) -> Image {
    let (width, height) = camera.size();
    let (wide, high) = (width * SAMPLES, height * SAMPLES);
    let projected: Vec<[f32; 3]> = surface
        .positions
        .iter()
        .map(|point| camera.project(*point, SAMPLES))
        .collect();
    let normals = vertex_normals(surface.positions, surface.faces);
    let shades: Vec<[f32; 3]> = (0..surface.positions.len())
        .map(|node| shade(surface, camera, &normals, node))
        .collect();
    let mut depth = vec![f32::NEG_INFINITY; wide * high];
    let mut samples = vec![[0.0f32; 3]; wide * high];
    for face in surface.faces {
        let corners = face.map(|node| node as usize);
        let [a, b, c] = corners.map(|node| projected[node]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        // Outward faces that look at the eye turn clockwise on a picture whose y points down.
        if area >= -1e-9 {
            continue;
        }
        let range = |axis: usize, limit: usize| {
            let low = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
            let high = (a[axis].max(b[axis]).max(c[axis]).ceil().max(0.0) as usize).min(limit);
            low..high
        };
        for y in range(1, high) {
            for x in range(0, wide) {
                let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
                let edge = |p: [f32; 3], q: [f32; 3]| {
                    ((q[0] - p[0]) * (py - p[1]) - (q[1] - p[1]) * (px - p[0])) / area
                };
                let weights = [edge(b, c), edge(c, a), edge(a, b)];
                if weights.iter().any(|weight| *weight < -1e-4) {
                    continue;
                }
                let z = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2];
                let index = y * wide + x;
                if z > depth[index] {
                    depth[index] = z;
                    samples[index] =
                        [0, 1, 2].map(|k| (0..3).map(|i| weights[i] * shades[corners[i]][k]).sum());
                }
            }
        }
    }
    resolve(&samples, &depth, width, height)
}

/// Colour of a node: its value's colour under one light with a soft highlight.
fn shade(surface: &Surface<'_>, camera: &Camera, normals: &[[f32; 3]], node: usize) -> [f32; 3] {
    let value = surface.values.get(node).copied().unwrap_or(0.0);
    let base = surface.palette.colour(value / surface.full_scale.max(1e-9));
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let normal = normals[node];
    let diffuse = dot(normal, camera.light()).max(0.0);
    let facing = dot(normal, camera.toward()).max(0.0);
    let half = [0, 1, 2].map(|k| camera.light()[k] + camera.toward()[k]);
    let highlight = (dot(normal, half) / dot(half, half).sqrt())
        .max(0.0)
        .powi(40);
    let light = 0.30 + 0.62 * diffuse + 0.14 * facing;
    base.map(|channel| (channel * light + 0.10 * highlight).clamp(0.0, 1.0))
}

/// Unit normals, the mean of the faces around a node weighted by area.
fn vertex_normals(positions: &[[f32; 3]], faces: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut normals = vec![[0.0f32; 3]; positions.len()];
    for face in faces {
        let [a, b, c] = face.map(|node| positions[node as usize]);
        let (u, v) = (
            [0, 1, 2].map(|k| b[k] - a[k]),
            [0, 1, 2].map(|k| c[k] - a[k]),
        );
        let area = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        for node in face {
            for (sum, part) in normals[*node as usize].iter_mut().zip(area) {
                *sum += part;
            }
        }
    }
    for normal in &mut normals {
        let length = normal
            .iter()
            .map(|value| value * value)
            .sum::<f32>()
            .sqrt()
            .max(1e-20);
        *normal = normal.map(|value| value / length);
    }
    normals
}

fn resolve(samples: &[[f32; 3]], depth: &[f32], width: usize, height: usize) -> Image {
    let wide = width * SAMPLES;
    let mut rgba = Vec::with_capacity(width * height * 4);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0f32; 3];
            let mut covered = 0u32;
            for index in (0..SAMPLES * SAMPLES)
                .map(|s| (y * SAMPLES + s / SAMPLES) * wide + x * SAMPLES + s % SAMPLES)
            {
                if depth[index] > f32::NEG_INFINITY {
                    covered += 1;
                    for (total, part) in sum.iter_mut().zip(samples[index]) {
                        *total += part;
                    }
                }
            }
            let count = covered.max(1) as f32;
            rgba.extend(sum.map(|value| (value / count * 255.0).round() as u8));
            rgba.push((covered * 255 / (SAMPLES * SAMPLES) as u32) as u8);
        }
    }
    Image {
        width,
        height,
        rgba,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron seen from -y: its front is drawn, its middle opaque, its corners transparent.
    #[test]
    fn a_tetrahedron_covers_the_middle_and_takes_the_value_s_colour() {
        let positions = [
            [0.0, 0.0, 0.0],
            [10.0, 0.0, 0.0],
            [0.0, 10.0, 0.0],
            [0.0, 0.0, 10.0],
        ];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let draw_with = |value: f32| {
            let values = [value; 4];
            let surface = Surface {
                positions: &positions,
                faces: &faces,
                values: &values,
                palette: Palette::Error,
                full_scale: 1.0,
            };
            draw(
                &surface,
                &Camera::framing(&positions, [0.0, -1.0, 0.0], 40, 40),
            )
        };
        let (pale, dark) = (draw_with(0.0), draw_with(1.0));
        let pixel = |image: &Image, x: usize, y: usize| -> [u8; 4] {
            image.rgba[(y * image.width + x) * 4..][..4]
                .try_into()
                .unwrap()
        };
        assert_eq!(pixel(&pale, 12, 30)[3], 255);
        assert_eq!(
            pixel(&pale, 36, 4)[3],
            0,
            "the upper right is outside the triangle"
        );
        assert!(pixel(&pale, 12, 30)[0] > pixel(&dark, 12, 30)[0] + 60);
        assert_eq!(&pale.png().unwrap()[1..4], b"PNG");
    }
}
