//! The contact of `hard-slide`: patches along a walk over the surface.

use std::f64::consts::PI;

use super::load::Draw;
use crate::contact::{ContactDomain, ContactError, Patch};

/// Waypoints of a sliding contact.
pub(super) const SLIDE_STOPS: usize = 24;
/// Length of the walk, mm.
const SLIDE_MM: f64 = 25.0;

/// Patches along a straight walk over `domain`: of eight headings, the first being the draw's, the one
/// whose end lies nearest to a face (the walk must not leave `domain`).
pub(super) fn slide(
    domain: &ContactDomain,
    start: &Patch,
    draw: Draw,
    area: f64,
) -> Result<Vec<Patch>, ContactError> {
    let point = |heading: [f64; 3], part: f64| {
        [0, 1, 2].map(|k| start.site[k] + SLIDE_MM * part * heading[k])
    };
    let nearest_to = |goal: [f64; 3]| {
        (0..domain.face_count())
            .map(|face| (distance(domain.centroids()[face], goal), face))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((0.0, start.seed))
    };
    let heading = (0..8)
        .map(|turn| {
            let theta = 2.0 * PI * (draw.angle + f64::from(turn) / 8.0);
            start.direction(PI / 2.0, theta)
        })
        .min_by(|a, b| {
            let miss = |heading| nearest_to(point(heading, 1.0)).0;
            miss(*a).total_cmp(&miss(*b))
        })
        .unwrap_or(start.tangents[0]);
    let mut patches: Vec<Patch> = Vec::with_capacity(SLIDE_STOPS);
    for stop in 0..SLIDE_STOPS {
        let part = stop as f64 / (SLIDE_STOPS - 1) as f64;
        let (_, nearest) = nearest_to(point(heading, part));
        match patches.last() {
            Some(last) if last.seed == nearest => patches.push(last.clone()),
            _ => patches.push(domain.grow(nearest, area)?),
        }
    }
    Ok(patches)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}
