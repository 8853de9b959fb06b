//! A rigid body without friction that the surface of the tissue meets.

use crate::band::Band;
use std::f64::consts::PI;

/// What of it the tissue meets.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A ball on the axis, of a radius in mm.
    Ball(f64),
    /// A plate across the axis.
    Plate,
}

/// A shape above the tissue that moves along the axis.
#[derive(Clone, Copy, Debug)]
pub struct Obstacle {
    pub shape: Shape,
    /// Its lowest place at rest, mm.
    pub low: f64,
    /// How far that moves in the whole way, mm.
    pub motion: f64,
    /// Pressure by depth, Pa/mm: the more, the less of the tissue lies inside of it.
    pub stiffness: f64,
}

/// Gauss's points of an edge, and their weights.
const POINTS: [[f64; 2]; 3] = [
    [0.112_701_665_379_258_3, 5.0 / 18.0],
    [0.5, 4.0 / 9.0],
    [0.887_298_334_620_741_7, 5.0 / 18.0],
];

impl Obstacle {
    /// Distance of a place from it, which is negative inside, with its gradient and the curvature across that.
    fn gap(&self, way: f64, [r, z]: [f64; 2]) -> (f64, [f64; 2], f64) {
        let low = self.low + way * self.motion;
        match self.shape {
            Shape::Plate => (low - z, [0.0, -1.0], 0.0),
            Shape::Ball(radius) => {
                let d = [r, z - low - radius];
                let far = d[0].hypot(d[1]).max(1e-9 * radius);
                (far - radius, d.map(|d| d / far), 1.0 / far)
            }
        }
    }

    /// Adds its forces on an edge of the surface to `force` and, if that is asked for, their derivatives to `band`; returns what pushes it up, µN.
    pub(super) fn meet(
        &self,
        way: f64,
        nodes: [usize; 2],
        rest: [[f64; 2]; 2],
        u: &[f64],
        force: &mut [f64],
        mut band: Option<&mut Band>,
    ) -> f64 {
        let mut up = 0.0;
        let length = (rest[1][0] - rest[0][0]).hypot(rest[1][1] - rest[0][1]);
        for [part, weight] in POINTS {
            let shares = [1.0 - part, part];
            let mixed = |value: &dyn Fn(usize) -> f64| shares[0] * value(0) + shares[1] * value(1);
            let place = [0, 1].map(|k| mixed(&|a| rest[a][k] + u[2 * nodes[a] + k]));
            let (gap, normal, curvature) = self.gap(way, place);
            if gap >= 0.0 {
                continue;
            }
            let ring = 2.0 * PI * mixed(&|a| rest[a][0]);
            let weight = weight * length * ring * self.stiffness;
            up += weight * gap * normal[1];
            for row in 0..4 {
                let (a, k) = (row / 2, row % 2);
                force[2 * nodes[a] + k] += shares[a] * weight * gap * normal[k];
                let Some(band) = band.as_deref_mut() else {
                    continue;
                };
                for column in 0..4 {
                    let (b, l) = (column / 2, column % 2);
                    let both = normal[k] * normal[l];
                    let across = if k == l { 1.0 - both } else { -both };
                    let value = shares[a] * shares[b] * (both + gap * curvature * across);
                    band.add(2 * nodes[a] + k, 2 * nodes[b] + l, weight * value);
                }
            }
        }
        up
    }
}
