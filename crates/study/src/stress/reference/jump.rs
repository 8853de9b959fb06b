//! A stiff inclusion: elements near the middle of the body are a thousand times stiffer than the rest.

use anyhow::Result;
use tissue::contact::ContactDomain;
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::SolverOptions;

use super::{Body, Press, SUBJECT};
use crate::stress::Row;

const JUMP: f32 = 1000.0;

/// Presses the body with the inclusion in it. The right answer is checked by what stiffness does: the inclusion keeps
/// its shape while the tissue around it deforms.
pub fn row(body: &Body, base: &SolverOptions) -> Result<Row> {
    let mut mesh = body.mesh.clone();
    mesh.stiffness = inclusion(&mesh);
    let stiff = mesh.stiffness.iter().filter(|s| **s == JUMP).count();
    let body = Body {
        domain: ContactDomain::new(&mesh, Boundary::Fixed)?,
        seed: body.seed,
        mesh,
    };
    let outcome = body.press(base.clone(), Press::default())?;
    let (inside, outside) = strains(&body.mesh, &outcome.field);
    let text = format!(
        "{stiff} of {} elements are stiff: {}; RMS strain {inside:.1e} inside, {outside:.1e} outside",
        body.mesh.tets.len(),
        outcome.text()
    );
    let good = outcome.complete() && inside < 0.02 * outside;
    Ok(Row::new(
        SUBJECT,
        "stiffness jump of 1000 inside the mesh",
        text,
        good,
    ))
}

/// Elements whose centroid is within 0.6 of the half extents of the bounding box from its middle.
fn inclusion(mesh: &Mesh) -> Vec<f32> {
    let bound = |axis: usize, pick: fn(f32, f32) -> f32| {
        (mesh.positions.iter().map(|p| p[axis])).fold(mesh.positions[0][axis], pick)
    };
    let low = [0, 1, 2].map(|k| bound(k, f32::min));
    let high = [0, 1, 2].map(|k| bound(k, f32::max));
    (mesh.tets.iter())
        .map(|tet| {
            let distance: f32 = (0..3)
                .map(|k| {
                    let centre = tet
                        .iter()
                        .map(|n| mesh.positions[*n as usize][k])
                        .sum::<f32>()
                        / 4.0;
                    ((2.0 * centre - low[k] - high[k]) / (high[k] - low[k])).powi(2)
                })
                .sum();
            if distance < 0.36 { JUMP } else { 1.0 }
        })
        .collect()
}

/// RMS over elements of the relative change of edge lengths, in the inclusion and outside of it.
fn strains(mesh: &Mesh, field: &[[f32; 3]]) -> (f64, f64) {
    let (mut sums, mut counts) = ([0.0; 2], [0.0f64; 2]);
    for (tet, stiffness) in mesh.tets.iter().zip(&mesh.stiffness) {
        let part = usize::from(*stiffness == 1.0);
        for (i, a) in tet.iter().enumerate() {
            for b in &tet[i + 1..] {
                let edge = between(mesh.positions[*a as usize], mesh.positions[*b as usize]);
                let change = between(field[*a as usize], field[*b as usize]);
                let (mut rest, mut moved) = (0.0, 0.0);
                for (edge, change) in edge.iter().zip(change) {
                    rest += edge * edge;
                    moved += (edge + change).powi(2);
                }
                sums[part] += ((moved / rest).sqrt() - 1.0).powi(2);
                counts[part] += 1.0;
            }
        }
    }
    let rms = |part: usize| (sums[part] / counts[part].max(1.0)).sqrt();
    (rms(0), rms(1))
}

fn between(a: [f32; 3], b: [f32; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| f64::from(a[k]) - f64::from(b[k]))
}
