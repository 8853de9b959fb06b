//! Tools for a film: their shapes as triangles, and where they are at each frame.

use contact::Shape;
use serde_json::{Value, json};
use tissue::solver::{Tool, ToolPose};

/// Directions from pole to pole and around that a shape is drawn by. Even numbers leave out the planes in which a box has no corner.
const RINGS: usize = 14;
const SECTORS: usize = 24;

/// Points and triangles of a shape in its own frame, mm.
fn outline(shape: &Shape) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    if let Shape::Mesh { points, faces, .. } = shape {
        return (points.clone(), faces.clone());
    }
    let mut points = Vec::new();
    let ring = |at: usize| std::f32::consts::PI * (at as f32 + 0.5) / RINGS as f32;
    for at in 0..RINGS {
        let (sin, cos) = ring(at).sin_cos();
        for sector in 0..SECTORS {
            let turn = std::f32::consts::TAU * (sector as f32 + 0.5) / SECTORS as f32;
            points.push(farthest(shape, [sin * turn.cos(), cos, sin * turn.sin()]));
        }
    }
    let poles = points.len() as u32;
    points.extend([1.0, -1.0].map(|y| farthest(shape, [0.0, y, 0.0])));
    let node = |at: usize, sector: usize| (at * SECTORS + sector % SECTORS) as u32;
    let mut faces = Vec::new();
    for sector in 0..SECTORS {
        faces.push([poles, node(0, sector + 1), node(0, sector)]);
        faces.push([
            poles + 1,
            node(RINGS - 1, sector),
            node(RINGS - 1, sector + 1),
        ]);
        for at in 0..RINGS - 1 {
            let [a, b] = [node(at, sector), node(at, sector + 1)];
            let [c, d] = [node(at + 1, sector), node(at + 1, sector + 1)];
            faces.extend([[a, b, c], [b, d, c]]);
        }
    }
    (points, faces)
}

/// The point of a convex shape that lies farthest along a direction of length 1; in the middle where several do.
fn farthest(shape: &Shape, to: [f32; 3]) -> [f32; 3] {
    let sign = |x: f32| if x == 0.0 { 0.0 } else { x.signum() };
    let of_box = |half: [f32; 3], radius: f32| {
        [0, 1, 2].map(|k| sign(to[k]) * (half[k] - radius) + radius * to[k])
    };
    let of_points = |points: &[[f32; 3]], margin: f32| {
        let along = |p: &[f32; 3]| (0..3).map(|k| p[k] * to[k]).sum::<f32>();
        let most = (points.iter()).max_by(|a, b| along(a).total_cmp(&along(b)));
        most.map_or([0.0; 3], |p| [0, 1, 2].map(|k| p[k] + margin * to[k]))
    };
    match shape {
        Shape::Sphere { radius } => of_box([*radius; 3], *radius),
        Shape::Capsule {
            half_length,
            radius,
        } => of_box([*radius, half_length + radius, *radius], *radius),
        Shape::Box { half_extents } => of_box(*half_extents, 0.0),
        Shape::Spatula {
            half_extents,
            radius,
        } => of_box(*half_extents, *radius),
        Shape::Hull { points, margin } | Shape::Mesh { points, margin, .. } => {
            of_points(points, *margin)
        }
    }
}

/// Short numbers: a page holds many.
fn rounded(x: f32) -> f64 {
    (f64::from(x) * 1e4).round() / 1e4
}

/// A list of a film's tools: flat points and triangles, and poses `[x, y, z, qx, qy, qz, qw]` by frame.
pub fn json<'a>(tools: &[Tool], frames: impl Iterator<Item = &'a Vec<ToolPose>> + Clone) -> Value {
    let each = tools.iter().enumerate().map(|(index, tool)| {
        let (points, faces) = outline(&tool.shape);
        let poses = frames.clone().map(|poses| {
            let pose = &poses[index].pose;
            let (at, turn) = (pose.translation.to_array(), pose.rotation.to_array());
            at.into_iter()
                .chain(turn)
                .map(rounded)
                .collect::<Vec<f64>>()
        });
        json!({
            "points": points.as_flattened().iter().map(|x| rounded(*x)).collect::<Vec<f64>>(),
            "faces": faces.as_flattened(),
            "poses": poses.collect::<Vec<_>>(),
        })
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume inside of the triangles, positive where they face outwards.
    fn volume(shape: &Shape) -> f64 {
        let (points, faces) = outline(shape);
        let sixth = faces.iter().map(|face| {
            let [a, b, c] = face.map(|i| points[i as usize].map(f64::from));
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        });
        sixth.sum::<f64>() / 6.0
    }

    #[test]
    fn outlines_are_closed_face_outwards_and_have_the_shapes_volume() {
        let half_extents = [10.0, 20.0, 1.5];
        let corners = [-1.0f32, 1.0]
            .map(|x| [-1.0f32, 1.0].map(|y| [-1.0f32, 1.0].map(|z| [10.0 * x, 20.0 * y, 1.5 * z])));
        let points = corners.as_flattened().as_flattened().to_vec();
        let pi = std::f64::consts::PI;
        for (shape, expected) in [
            (Shape::Sphere { radius: 3.0 }, 36.0 * pi),
            (
                Shape::Capsule {
                    half_length: 20.0,
                    radius: 3.0,
                },
                36.0 * pi + 360.0 * pi,
            ),
            (Shape::Box { half_extents }, 2400.0),
            (
                Shape::Spatula {
                    half_extents,
                    radius: 1.0,
                },
                2330.0,
            ),
            (
                Shape::Hull {
                    points,
                    margin: 0.0,
                },
                2400.0,
            ),
        ] {
            let found = volume(&shape);
            assert!((found / expected - 1.0).abs() < 0.04, "{shape:?}: {found}");
        }
    }
}
