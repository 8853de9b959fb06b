//! Sampled contacts: the forces that weigh the compliance columns by what instruments do.

use anyhow::Result;
use tissue::linear::{Compliance, contact_forces};
use tissue::mesh::Mesh;
use tissue::schemes::SplitMix;

use super::sizes::Sizes;

/// Forces of one contact, mN: dof of the contact nodes (`3 * row + axis`) and value.
pub type Forces = Vec<(u32, f32)>;

/// About normal: variance 1, bounded.
fn normal(random: &mut SplitMix) -> f64 {
    (0..12).map(|_| random.unit()).sum::<f64>() - 6.0
}

/// `count` random patches of the domain, each pushed by two thirds of the deepest push in a random direction; a hundredth of it
/// varies from node to node, so that patches that deform are spanned too. At least three nodes a patch. `go_on` may
/// end it.
pub fn sample(
    mesh: &Mesh,
    compliance: &Compliance,
    sizes: &Sizes,
    count: usize,
    seed: u64,
    go_on: &dyn Fn() -> Result<()>,
) -> Result<Vec<Forces>> {
    let mut random = SplitMix(seed);
    let points: Vec<[f64; 3]> = compliance
        .nodes
        .iter()
        .map(|&node| mesh.positions[node as usize].map(f64::from))
        .collect();
    let push = sizes.push_mm * 2.0 / 3.0;
    let mut samples = Vec::with_capacity(count);
    for _ in 0..count {
        go_on()?;
        let centre = points[random.below(points.len())];
        let [low, high] = sizes.area_mm2;
        let radius = ((low + (high - low) * random.unit()) / std::f64::consts::PI).sqrt();
        let mut near: Vec<(f64, usize)> = points
            .iter()
            .enumerate()
            .map(|(row, p)| ((0..3).map(|k| (p[k] - centre[k]).powi(2)).sum::<f64>(), row))
            .filter(|(squared, _)| *squared <= (3.0 * radius).powi(2))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let inside = near
            .iter()
            .filter(|(squared, _)| *squared <= radius * radius)
            .count();
        near.truncate(inside.max(3));
        let mut rows: Vec<usize> = near.into_iter().map(|(_, row)| row).collect();
        rows.sort_unstable();
        let direction = [0; 3].map(|_| normal(&mut random));
        let length = direction
            .iter()
            .map(|x| x * x)
            .sum::<f64>()
            .sqrt()
            .max(1e-9);
        let vectors: Vec<[f64; 3]> = rows
            .iter()
            .map(|_| direction.map(|x| push * x / length + 0.01 * push * normal(&mut random)))
            .collect();
        let forces = contact_forces(compliance, &rows, &vectors)?.forces;
        samples.push(
            rows.iter()
                .zip(forces.as_chunks::<3>().0)
                .flat_map(|(&row, force)| {
                    [0, 1, 2].map(|k| ((3 * row + k) as u32, force[k] as f32))
                })
                .collect(),
        );
    }
    Ok(samples)
}
