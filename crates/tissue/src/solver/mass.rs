//! Lumped nodal mass, with selective mass scaling where it is asked for.
//!
//! The few thinnest elements set the inner step of the whole mesh. An element whose
//! own critical step is shorter than wanted is made denser until it is that long
//! (selective mass scaling; Olovsson, Simonsson and Unosson 2005): statics stay
//! as they are, and dynamics change by the mass that is added.

use crate::material::Material;
use crate::mesh::tet_volume;
use elements::{Tetrahedra, shape_gradients};

/// Nodal masses and what scaling added to them.
pub(super) struct LumpedMass {
    /// By node, g.
    pub mass: Vec<f64>,
    /// By node, mm³; a quarter of each element around it, times its stiffness over the material's.
    pub stiff_volume: Vec<f64>,
    /// By element: its density over its own without scaling, at least 1.
    pub factor: Vec<f32>,
    /// Added mass over the mass of the body.
    pub added: f64,
}

impl LumpedMass {
    /// `shares`: by how much of its volume each element counts, all of it where the list is empty. `shortest_step_s`: elements with a shorter critical step of
    /// their own are scaled to it; 0 scales none.
    pub fn new(
        mesh: Tetrahedra<'_>,
        shares: &[f32],
        material: &Material,
        shortest_step_s: f64,
    ) -> Self {
        let mut result = Self {
            mass: vec![0.0; mesh.positions.len()],
            stiff_volume: vec![0.0; mesh.positions.len()],
            factor: Vec::with_capacity(mesh.tets.len()),
            added: 0.0,
        };
        // Masses, g.
        let (mut plain, mut scaled) = (0.0, 0.0);
        for (element, tet) in mesh.tets.iter().enumerate() {
            let share = shares.get(element).copied().map_or(1.0, f64::from);
            let volume = tet_volume(mesh.positions, *tet) * share;
            let stiffness = f64::from(mesh.stiffness_of(element));
            let density = mesh.laws.density_of(element, material.density_kg_m3);
            let heavier = density / material.density_kg_m3;
            let step = element_step_s(mesh.positions, *tet, material)
                * (heavier / stiffness).sqrt()
                / fibre_speed(mesh, element, material);
            let factor = (shortest_step_s / step).powi(2).max(1.0);
            let mass = 1e-6 * density * volume;
            plain += mass;
            scaled += factor * mass;
            result.factor.push(factor as f32);
            for node in tet {
                result.stiff_volume[*node as usize] += 0.25 * volume * stiffness;
                result.mass[*node as usize] += 0.25 * factor * mass;
            }
        }
        result.added = scaled / plain - 1.0;
        result
    }
}

/// Speed of pressure waves along an element's taut fibres over that in its matrix, at rest; 1 without fibres.
fn fibre_speed(mesh: Tetrahedra<'_>, element: usize, material: &Material) -> f64 {
    let moduli = mesh.laws.moduli_of(element, material.moduli());
    match moduli.law.fibres() {
        Some(fibres) if mesh.laws.fibre_of(element) != [0.0; 3] => {
            let wave = moduli.bulk_pa / moduli.shear_pa + 4.0 / 3.0;
            (1.0 + 4.0 * fibres.rise(0.0) / wave).sqrt()
        }
        _ => 1.0,
    }
}

/// Critical step of one element of the material's own stiffness with a quarter of its mass at each corner, s:
/// `2 / omega` with `omega² = 4 (kappa + 4/3 mu) / rho` times the largest eigenvalue of `sum_a g_a (x) g_a`.
fn element_step_s(positions: &[[f32; 3]], tet: [u32; 4], material: &Material) -> f64 {
    let (slopes, _) = shape_gradients(tet.map(|node| positions[node as usize]));
    let first = [0, 1, 2].map(|j| -(slopes[0][j] + slopes[1][j] + slopes[2][j]));
    let mut sum = [[0.0; 3]; 3];
    for g in slopes.iter().chain([&first]) {
        for i in 0..3 {
            for j in 0..3 {
                sum[i][j] += g[i] * g[j];
            }
        }
    }
    (material.wave_speed_mm_s() * largest_eigenvalue(sum).sqrt()).recip()
}

/// Of a symmetric 3x3 matrix, in closed form.
fn largest_eigenvalue(a: [[f64; 3]; 3]) -> f64 {
    let mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
    let off = a[0][1].powi(2) + a[0][2].powi(2) + a[1][2].powi(2);
    let spread: f64 = (0..3).map(|i| (a[i][i] - mean).powi(2)).sum::<f64>() + 2.0 * off;
    let p = (spread / 6.0).sqrt();
    if p <= f64::EPSILON * mean.abs() {
        return mean;
    }
    let b = |i: usize, j: usize| (a[i][j] - if i == j { mean } else { 0.0 }) / p;
    let half_determinant = 0.5
        * (b(0, 0) * (b(1, 1) * b(2, 2) - b(1, 2) * b(2, 1))
            - b(0, 1) * (b(1, 0) * b(2, 2) - b(1, 2) * b(2, 0))
            + b(0, 2) * (b(1, 0) * b(2, 1) - b(1, 1) * b(2, 0)));
    mean + 2.0 * p * (half_determinant.clamp(-1.0, 1.0).acos() / 3.0).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalue_of_known_matrices() {
        assert!(
            (largest_eigenvalue([[2.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 3.0]]) - 5.0).abs()
                < 1e-12
        );
        assert!(
            (largest_eigenvalue([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]) - 3.0).abs()
                < 1e-12
        );
        assert!(
            (largest_eigenvalue([[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]]) - 4.0).abs()
                < 1e-12
        );
    }
}
