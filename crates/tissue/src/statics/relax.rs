//! The equilibrium next to a given state, to the last digits of f64: what other codes' solutions are compared with.

use super::StaticsError;
use super::energy::StrainEnergy;
use super::quasi_newton::{Pairs, product};
use crate::linear::{Factor, Lame, Stiffness};
use crate::material::Material;
use crate::mesh::Mesh;

/// Steps at most; a start near the equilibrium needs a few dozen.
const MOST_STEPS: usize = 400;
/// Largest component of the last step, mm.
const STEP_MM: f64 = 1e-9;

/// Moves the nodes of `start` (`[K,3]`, mm) to static equilibrium; those of `held` stay where they are.
///
/// Quasi-Newton steps (L-BFGS around the stiffness at rest) from a start without inverted elements.
///
/// # Errors
/// [`StaticsError::None`] where the start is inverted or 400 steps do not suffice, [`StaticsError::Linear`] where the stiffness has no factor.
pub fn relax(
    mesh: &Mesh,
    held: &[u32],
    material: &Material,
    start: &[[f32; 3]],
) -> Result<Vec<[f64; 3]>, StaticsError> {
    let mut held = held.to_vec();
    held.sort_unstable();
    held.dedup();
    let stiffness = Stiffness::assemble(
        mesh,
        &held,
        Lame::from_young(material.young_pa, material.poisson)?,
    )?;
    let factor = Factor::new(&stiffness, &mesh.positions, 1)?;
    let body = StrainEnergy::new(mesh, material);
    let free = &stiffness.free.nodes;
    let gather = |all: &[f64]| -> Vec<f64> {
        let nodes = free.iter().map(|&node| 3 * node as usize);
        nodes
            .flat_map(|at| [all[at], all[at + 1], all[at + 2]])
            .collect()
    };
    let moved = |from: &[f64], step: &[f64], part: f64| {
        let mut u = from.to_vec();
        for (&node, step) in free.iter().zip(step.as_chunks::<3>().0) {
            for (axis, s) in step.iter().enumerate() {
                u[3 * node as usize + axis] -= part * s;
            }
        }
        u
    };

    let mut u: Vec<f64> = start.as_flattened().iter().map(|&x| f64::from(x)).collect();
    let mut all = vec![0.0; u.len()];
    if body.evaluate(&u, &mut all).min_det <= 0.0 {
        return Err(StaticsError::None(
            "an element of the start is inverted".into(),
        ));
    }
    let mut gradient = gather(&all);
    let mut pairs = Pairs::default();
    for _ in 0..MOST_STEPS {
        let mut step = gradient.clone();
        pairs.before(&mut step);
        factor.solve(&mut step);
        pairs.after(&mut step);
        let slope = product(&gradient, &step);
        if slope.is_nan() || slope <= 0.0 {
            break;
        }
        // By slopes: the energy's own digits end long before the gradient's.
        let mut part = 1.0;
        let (next, after) = loop {
            let next = moved(&u, &step, part);
            let sound = body.evaluate(&next, &mut all).min_det > 0.0;
            let after = gather(&all);
            if sound && product(&after, &step) > -0.9 * slope || part < 1e-3 {
                break (next, after);
            }
            part *= 0.5;
        };
        let length = part * step.iter().fold(0.0f64, |most, s| most.max(s.abs()));
        let change = after.iter().zip(&gradient).map(|(a, b)| b - a).collect();
        step.iter_mut().for_each(|s| *s *= part);
        pairs.push(step, change);
        (u, gradient) = (next, after);
        if length < STEP_MM {
            return Ok(u.as_chunks::<3>().0.to_vec());
        }
    }
    Err(StaticsError::None(format!(
        "{MOST_STEPS} steps do not suffice"
    )))
}
