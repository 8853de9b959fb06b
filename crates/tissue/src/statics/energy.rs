//! Strain energy of the reference's law and its derivative, all in f64.
//!
//! The law's `W` is constant on each linear tetrahedron ([`elements`]), so the derivative by a corner is
//! `V P g_a` with its stress `P` and the shape gradients `g_a`.
//! Units: mm, mN; moduli mN/mm², energies mN mm (µJ).

use crate::material::Material;
use crate::mesh::Mesh;
use elements::energy_density;
use elements::{Moduli, Tetrahedron};

/// The energy of a body as a function of its displacement.
pub(crate) struct StrainEnergy {
    elements: Vec<Tetrahedron>,
    /// mN/mm², by number of a law ([`elements::Laws`]).
    moduli: Vec<Moduli>,
    /// Numbers of the elements' laws; empty where the body has one.
    region: Vec<u8>,
}

/// A material's moduli in mN/mm².
fn moduli(material: &Material) -> Moduli {
    Moduli {
        shear_pa: material.shear_pa() * 1e-3,
        bulk_pa: material.bulk_pa() * 1e-3,
        law: material.law,
    }
}

/// The same by number of a law.
pub(super) fn moduli_by_law(mesh: &Mesh, material: &Material) -> Vec<Moduli> {
    let own = moduli(material);
    let others = mesh.regions.iter().map(|region| Moduli {
        law: region.law,
        ..own
    });
    std::iter::once(own).chain(others).collect()
}

/// The energy and its least volume ratio at one displacement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energy {
    /// mN mm; infinite where an element is flat or inverted.
    pub value: f64,
    /// Smallest det F.
    pub min_det: f64,
}

impl StrainEnergy {
    /// Rest shape of a validated mesh.
    pub fn new(mesh: &Mesh, material: &Material) -> Self {
        let elements = mesh.tets.iter().enumerate().map(|(at, &corners)| {
            let rest = corners.map(|node| mesh.positions[node as usize].map(f64::from));
            Tetrahedron::new(corners, rest, f64::from(mesh.stiffness_of(at)))
                .along(mesh.laws().fibre_of(at))
        });
        Self {
            elements: elements.collect(),
            moduli: moduli_by_law(mesh, material),
            region: mesh.region.clone(),
        }
    }

    /// Energy at `u [3K]` (mm), and its derivative (mN) to `gradient [3K]`.
    ///
    /// Where an element is inverted the energy is infinite and the gradient unspecified.
    pub fn evaluate(&self, u: &[f64], gradient: &mut [f64]) -> Energy {
        gradient.fill(0.0);
        let mut sum = Energy {
            value: 0.0,
            min_det: f64::INFINITY,
        };
        for (tet, element) in self.elements.iter().enumerate() {
            let moduli = self.moduli[usize::from(self.region.get(tet).copied().unwrap_or(0))];
            let at = element.corners.map(|node| 3 * node as usize);
            let state = element.deformation(at.map(|at| [u[at], u[at + 1], u[at + 2]]));
            if state.det.is_nan() || state.det <= 0.0 {
                sum.value = f64::INFINITY;
                sum.min_det = state.det;
                return sum;
            }
            sum.min_det = sum.min_det.min(state.det);
            sum.value += element.volume * energy_density(&state, moduli);
            for (at, force) in at.into_iter().zip(element.forces(&state, moduli)) {
                for (axis, force) in force.into_iter().enumerate() {
                    gradient[at + axis] += force;
                }
            }
        }
        sum
    }
}
