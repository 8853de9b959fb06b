//! The dent under a tool in cross-section: surface of the truth and of a prediction, at rest, and the tool's outline, as SVG.

use std::fmt::Write;

use contact::{Body, Pose, Vector};
use tissue::mesh::Mesh;

use picture::plot::escape;
use yardstick::cases::ToolCase;

/// Half the width and half the height of the picture, mm.
const HALF_MM: [f32; 2] = [26.0, 17.0];
const PIXELS_PER_MM: f32 = 8.0;
/// Cells of the tool's outline, mm.
const CELL_MM: f32 = 0.5;

pub const TRUTH: &str = "#1d2733";
pub const REST: &str = "#b9c2cc";
pub const TOOL: &str = "#e4ddd0";

/// A plane through the tool's end: along it and up its shaft.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    origin: Vector,
    across: Vector,
    up: Vector,
}

/// The end of a tool, where its shaft, local y, is lowest.
fn tip(body: &Body, pose: &Pose) -> Vector {
    let (low, _) = body.bounds(&Pose::IDENTITY, 0.0);
    pose.transform_point(Vector::new(0.0, low.y, 0.0))
}

impl Plane {
    /// Through the first tool's shaft: along its slide, or through the second tool's end where there is one.
    pub fn of(case: &ToolCase, frame: usize) -> Self {
        let poses = case.at(frame);
        let up = poses[0].rotation * Vector::Y;
        let origin = tip(&case.bodies[0], &poses[0]);
        let toward = match poses.get(1) {
            Some(second) => tip(&case.bodies[1], second) - origin,
            None => poses[0].rotation * Vector::Z,
        };
        let flat = toward - up * toward.dot(up);
        let across = if flat.length() > 1e-3 {
            flat.normalize()
        } else {
            poses[0].rotation * Vector::Z
        };
        let middle = if poses.len() > 1 { 0.5 } else { 0.0 };
        Self {
            origin: origin + flat * middle,
            across,
            up,
        }
    }

    fn flat(&self, point: Vector) -> [f32; 2] {
        let from = point - self.origin;
        [from.dot(self.across), from.dot(self.up)]
    }

    fn world(&self, [x, y]: [f32; 2]) -> Vector {
        self.origin + self.across * x + self.up * y
    }

    /// Where a deformed surface meets the plane: pieces of lines.
    fn cut(&self, mesh: &Mesh, field: Option<&[[f32; 3]]>) -> Vec<[[f32; 2]; 2]> {
        let normal = self.across.cross(self.up);
        let position = |node: u32| {
            let rest = Vector::from(mesh.positions[node as usize]);
            field.map_or(rest, |field| rest + Vector::from(field[node as usize]))
        };
        let mut pieces = Vec::new();
        for face in &mesh.surface {
            let corners = face.map(position);
            let heights = corners.map(|corner| (corner - self.origin).dot(normal));
            let mut ends = Vec::new();
            for k in 0..3 {
                let (a, b) = (heights[k], heights[(k + 1) % 3]);
                if (a < 0.0) != (b < 0.0) {
                    let t = a / (a - b);
                    ends.push(self.flat(corners[k] + (corners[(k + 1) % 3] - corners[k]) * t));
                }
            }
            if let [a, b] = ends[..]
                && near(a)
                && near(b)
            {
                pieces.push([a, b]);
            }
        }
        pieces
    }
}

/// Within the picture, with a margin for what its edge cuts.
fn near([x, y]: [f32; 2]) -> bool {
    x.abs() < HALF_MM[0] + 12.0 && y.abs() < HALF_MM[1] + 12.0
}

fn pixel([x, y]: [f32; 2]) -> (f32, f32) {
    (
        (x + HALF_MM[0]) * PIXELS_PER_MM,
        (HALF_MM[1] - y) * PIXELS_PER_MM,
    )
}

fn path(out: &mut String, pieces: &[[[f32; 2]; 2]], stroke: &str, width: f32) {
    let mut data = String::new();
    for piece in pieces {
        let ((ax, ay), (bx, by)) = (pixel(piece[0]), pixel(piece[1]));
        let _ = write!(data, "M{ax:.1} {ay:.1}L{bx:.1} {by:.1}");
    }
    let _ = write!(
        out,
        "<path d=\"{data}\" fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>"
    );
}

/// The part of a tool in the plane: the corner of each cell's polygon where the signed distance is below zero.
fn tool(out: &mut String, plane: &Plane, body: &Body, pose: &Pose) {
    let distance = |at: [f32; 2]| body.nearest_at(pose, plane.world(at)).distance;
    let columns = (2.0 * HALF_MM[0] / CELL_MM) as i32;
    let rows = (2.0 * HALF_MM[1] / CELL_MM) as i32;
    let (mut filled, mut outline) = (String::new(), Vec::new());
    for row in 0..rows {
        for column in 0..columns {
            let corner = |dx: i32, dy: i32| {
                [
                    (column + dx) as f32 * CELL_MM - HALF_MM[0],
                    (row + dy) as f32 * CELL_MM - HALF_MM[1],
                ]
            };
            let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let distances = corners.map(distance);
            if distances.iter().all(|d| *d >= 0.0) {
                continue;
            }
            let (mut polygon, mut ends) = (Vec::new(), Vec::new());
            for k in 0..4 {
                let (a, b) = (distances[k], distances[(k + 1) % 4]);
                if a < 0.0 {
                    polygon.push(corners[k]);
                }
                if (a < 0.0) != (b < 0.0) {
                    let t = a / (a - b);
                    let (from, to) = (corners[k], corners[(k + 1) % 4]);
                    let at = [0, 1].map(|i| from[i] + (to[i] - from[i]) * t);
                    polygon.push(at);
                    ends.push(at);
                }
            }
            for (index, at) in polygon.iter().enumerate() {
                let (x, y) = pixel(*at);
                let letter = if index == 0 { 'M' } else { 'L' };
                let _ = write!(filled, "{letter}{x:.1} {y:.1}");
            }
            filled.push('Z');
            if let [a, b] = ends[..] {
                outline.push([a, b]);
            }
        }
    }
    let _ = write!(
        out,
        "<path d=\"{filled}\" fill=\"{TOOL}\" stroke=\"{TOOL}\" stroke-width=\"0.6\"/>"
    );
    path(out, &outline, "#9c8f78", 1.2);
}

/// The tools at `frame`, the surface at rest, the truth, and a prediction in `colour`: what is inside of an `svg` of 416 by 272.
pub fn drawing(
    mesh: &Mesh,
    case: &ToolCase,
    frame: usize,
    prediction: &[[f32; 3]],
    colour: &str,
) -> String {
    let plane = Plane::of(case, frame);
    let height = 2.0 * HALF_MM[1] * PIXELS_PER_MM;
    let mut body = String::new();
    for (shape, pose) in case.bodies.iter().zip(case.at(frame)) {
        tool(&mut body, &plane, shape, &pose);
    }
    path(&mut body, &plane.cut(mesh, None), REST, 1.2);
    path(
        &mut body,
        &plane.cut(mesh, Some(case.trajectory.frame(frame))),
        TRUTH,
        3.2,
    );
    path(&mut body, &plane.cut(mesh, Some(prediction)), colour, 1.8);
    let scale = 10.0 * PIXELS_PER_MM;
    let (x, y) = (14.0, height - 14.0);
    let _ = write!(
        body,
        "<path d=\"M{x} {y}h{scale}\" stroke=\"#44505c\" stroke-width=\"2\"/><text x=\"{}\" y=\"{}\">10 mm</text>",
        x + scale + 6.0,
        y + 4.0
    );
    body
}

/// One picture with its name.
pub fn picture(
    mesh: &Mesh,
    case: &ToolCase,
    frame: usize,
    prediction: &[[f32; 3]],
    name: &str,
    colour: &str,
) -> String {
    let [width, height] = HALF_MM.map(|half| 2.0 * half * PIXELS_PER_MM);
    let body = drawing(mesh, case, frame, prediction, colour);
    format!(
        "<figure><svg viewBox=\"0 0 {width} {height}\" role=\"img\" class=\"section\">{body}</svg><figcaption>{}</figcaption></figure>",
        escape(name)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact::{Rotation, Shape};
    use tissue::mesh::ellipsoid_phantom;

    #[test]
    fn a_plane_cuts_a_sphere_in_a_circle() {
        let mesh = ellipsoid_phantom([10.0, 10.0, 10.0], 8).unwrap();
        let plane = Plane {
            origin: Vector::ZERO,
            across: Vector::X,
            up: Vector::Z,
        };
        let pieces = plane.cut(&mesh, None);
        assert!(pieces.len() > 20);
        for at in pieces.iter().flatten() {
            let radius = at[0].hypot(at[1]);
            assert!((8.5..10.5).contains(&radius), "{radius}");
        }
        let mut out = String::new();
        let ball = Body::new(&Shape::Sphere { radius: 3.0 }).unwrap();
        let pose = Pose::from_parts(Vector::ZERO, Rotation::IDENTITY);
        tool(&mut out, &plane, &ball, &pose);
        assert!(out.contains("#9c8f78"));
    }
}
