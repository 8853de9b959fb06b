//! How thick a solid is beneath its surface: at each sample the diameter of the largest ball that
//! touches the surface there from within (the shrinking ball of Ma, Bae and Choi 2012).

use super::{RawSurface, SurfaceDistance};
use rayon::prelude::*;

/// Samples of a surface, about.
const SAMPLES: f64 = 16_000.0;
/// Samples along narrow faces, at most so many times as many.
const MOST_ALONG: f64 = 2.0;
/// A ball that touches at two places less than this apart, seen from its centre, lies in an edge of
/// the body, not in a wall: the cosine of 120 degrees.
const OPPOSITE: f64 = -0.5;
/// And beyond 160 degrees it lies in a wall whose sides are nearly parallel.
const ACROSS: f64 = -0.94;
/// Steps in which a ball shrinks.
const STEPS: usize = 12;
/// The part of its radius by which a ball may reach through the surface: the first one, from the
/// surface straight through the body, by more, as a tube of flat faces is askew beneath each of them.
const NEAR: f64 = 0.02;
const ACROSS_NEAR: f64 = 0.25;

/// A place of the surface, and the wall or neck beneath it.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub at: [f64; 3],
    pub inward: [f64; 3],
    /// Diameter of the ball, mm; infinite in the body's edges.
    pub thickness: f64,
    /// Whether the ball touches on opposite sides, as in walls and necks; in a rim that tapers off it does not.
    pub is_wall: bool,
    /// The part of the surface that the sample stands for, mm².
    pub area: f64,
}

impl Sample {
    /// The middle of the wall.
    pub fn middle(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.at[k] + 0.5 * self.thickness * self.inward[k])
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Spreads samples over a closed surface that looks outward, and measures beneath each.
pub fn samples(surface: &RawSurface, field: &SurfaceDistance) -> Vec<Sample> {
    let mut places = places(surface);
    places.par_iter_mut().for_each(|sample| {
        if let Some((thickness, cosine)) = ball(field, sample.at, sample.inward) {
            sample.thickness = thickness;
            sample.is_wall = cosine <= ACROSS;
        }
    });
    places
}

/// Samples about equally far apart: several on a large face, one for several small ones.
fn places(surface: &RawSurface) -> Vec<Sample> {
    let corners = |face: &[u32; 3]| face.map(|node| surface.positions[node as usize]);
    let crossed = |[a, b, c]: [[f64; 3]; 3]| elements::vector::cross(minus(b, a), minus(c, a));
    let sizes: Vec<f64> = (surface.faces.iter())
        .map(|face| {
            let twice = crossed(corners(face));
            0.5 * dot(twice, twice).sqrt()
        })
        .collect();
    let each = sizes.iter().sum::<f64>() / SAMPLES;
    // Narrow faces, as along a thin neck, have samples all along: too few of them lie at a face's middle.
    let along: Vec<usize> = (surface.faces.iter().zip(&sizes))
        .map(|(face, &area)| narrow(corners(face), area, each.sqrt()))
        .collect();
    let is_bounded = along.iter().sum::<usize>() as f64 <= MOST_ALONG * SAMPLES;
    let mut places = Vec::new();
    let mut left = 0.0;
    for ((face, &area), &along) in surface.faces.iter().zip(&sizes).zip(&along) {
        if along > 0 && is_bounded {
            let [a, b, c] = corners(face);
            let inward = crossed([a, b, c]).map(|x| -x / (2.0 * area));
            let (tip, base) = tip_and_base([a, b, c]);
            for step in 0..along {
                // From the tip to the middle of the side opposite to it.
                let by = (step as f64 + 0.5) / along as f64;
                places.push(Sample {
                    at: [0, 1, 2].map(|k| tip[k] + by * (base[k] - tip[k])),
                    inward,
                    thickness: f64::INFINITY,
                    is_wall: false,
                    area: area / along as f64,
                });
            }
            continue;
        }
        left += area;
        if left < each || area == 0.0 {
            continue;
        }
        let [a, b, c] = corners(face);
        let twice = crossed([a, b, c]);
        let inward = twice.map(|x| -x / (2.0 * area));
        let sides = (left / each).sqrt().ceil().min(256.0) as usize;
        let own = left / (sides * sides) as f64;
        left = 0.0;
        let mut add = |u: f64, v: f64| {
            let at = [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
            places.push(Sample {
                at,
                inward,
                thickness: f64::INFINITY,
                is_wall: false,
                area: own,
            });
        };
        // The centroids of a triangle cut into sides² triangles.
        let third = 1.0 / 3.0;
        for i in 0..sides {
            for j in 0..sides - i {
                let (u, v) = (i as f64, j as f64);
                let by = 1.0 / sides as f64;
                add((u + third) * by, (v + third) * by);
                if i + j + 1 < sides {
                    add((u + 2.0 * third) * by, (v + 2.0 * third) * by);
                }
            }
        }
    }
    places
}

/// The corner opposite to the shortest side, and that side's middle.
fn tip_and_base(corners: [[f64; 3]; 3]) -> ([f64; 3], [f64; 3]) {
    let side = |k: usize| {
        let way = minus(corners[(k + 2) % 3], corners[(k + 1) % 3]);
        dot(way, way)
    };
    let tip = (0..3).min_by(|&a, &b| side(a).total_cmp(&side(b)));
    let tip = tip.unwrap_or(0);
    let (one, other) = (corners[(tip + 1) % 3], corners[(tip + 2) % 3]);
    (corners[tip], [0, 1, 2].map(|k| 0.5 * (one[k] + other[k])))
}

/// Samples along a face that is long and narrow beside the way from sample to sample; 0 for other faces.
fn narrow(corners: [[f64; 3]; 3], area: f64, apart: f64) -> usize {
    let (tip, base) = tip_and_base(corners);
    let way = minus(base, tip);
    let length = dot(way, way).sqrt();
    match length > 2.0 * apart && area > 0.0 && 2.0 * area < length * apart {
        true => ((length / apart).ceil() as usize).min(64),
        false => 0,
    }
}

/// Diameter of the largest ball inside that touches the surface at `at`, and the cosine of the angle between the places where it
/// touches, from its centre; none in an edge of the body.
fn ball(field: &SurfaceDistance, at: [f64; 3], inward: [f64; 3]) -> Option<(f64, f64)> {
    let through = field.along(at, inward)?;
    let mut radius = 0.5 * through;
    // Where it touches besides `at`.
    let mut touched = [0, 1, 2].map(|k| at[k] + through * inward[k]);
    let centre = |radius: f64| [0, 1, 2].map(|k| at[k] + radius * inward[k]);
    let mut clear = radius;
    for step in 0..STEPS {
        let nearest = field.nearest(centre(radius));
        let far = minus(nearest, centre(radius));
        clear = dot(far, far).sqrt().min(radius);
        let near = if step == 0 { ACROSS_NEAR } else { NEAR };
        if clear >= radius * (1.0 - near) {
            break;
        }
        let way = minus(nearest, at);
        let smaller = dot(way, way) / (2.0 * dot(way, inward));
        if !(smaller > 0.0 && smaller < radius) {
            break;
        }
        (radius, touched) = (smaller, nearest);
    }
    let cosine = -dot(minus(touched, centre(radius)), inward) / radius;
    (cosine <= OPPOSITE).then_some((radius + clear, cosine))
}
