//! Homogeneous deformations: the patch test, uniaxial stress and simple shear.
//!
//! Every boundary node is led to `(F - 1) X`; interior nodes must follow and the
//! reactions must be the closed form's first Piola stress times the face area.

use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh, regular_box};
use tissue::solver::{ContactNode, FrameReport, Pressure, Solver, SolverOptions};

type Matrix = [[f64; 3]; 3];

const SIDE: f32 = 20.0;

/// Leads the surface of a distorted box to `F` and lets the inside settle.
fn settle(f: Matrix, pressure: Pressure) -> (Mesh, Solver, Vec<ContactNode>, FrameReport) {
    let mut mesh = regular_box([SIDE; 3], [4; 3]).unwrap();
    let inside = |p: &[f32; 3]| p.iter().all(|v| *v > 1e-3 && *v < SIDE - 1e-3);
    // Irregular interior nodes, so that elements of different shapes must agree.
    for (i, p) in mesh.positions.iter_mut().enumerate() {
        if inside(p) {
            for (k, v) in p.iter_mut().enumerate() {
                *v += 0.8 * ((7 * i + 3 * k) as f32).sin();
            }
        }
    }
    let contact: Vec<ContactNode> = (0..mesh.node_count())
        .filter(|i| !inside(&mesh.positions[*i]))
        .map(|i| ContactNode {
            node: i as u32,
            displacement: affine(f, mesh.positions[i]),
        })
        .collect();
    let mut options = SolverOptions {
        pressure,
        ..SolverOptions::default()
    };
    options.material.damping_per_s = 400.0;
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let mut report = solver.step_frame(&contact, 0.05).unwrap();
    for _ in 0..8 {
        report = solver.step_frame(&contact, 0.05).unwrap();
    }
    (mesh, solver, contact, report)
}

fn affine(f: Matrix, p: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|i| {
        let moved: f64 = (0..3).map(|j| f[i][j] * f64::from(p[j])).sum();
        (moved - f64::from(p[i])) as f32
    })
}

/// `P = mu J^(-2/3) (F - I1/3 F^-T) + kappa J (J - 1) F^-T` for a diagonal or shear `F`.
fn piola(f: Matrix) -> Matrix {
    let material = Material::default();
    let minor = |i: usize, j: usize| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (c, d) = ((j + 1) % 3, (j + 2) % 3);
        f[a][c] * f[b][d] - f[a][d] * f[b][c]
    };
    let det: f64 = (0..3).map(|j| f[0][j] * minor(0, j)).sum();
    let invariant: f64 = f.iter().flatten().map(|v| v * v).sum();
    [0, 1, 2].map(|i| {
        [0, 1, 2].map(|j| {
            let inverse_transposed = minor(i, j) / det;
            material.shear_pa()
                * det.powf(-2.0 / 3.0)
                * (f[i][j] - invariant / 3.0 * inverse_transposed)
                + material.bulk_pa() * det * (det - 1.0) * inverse_transposed
        })
    })
}

/// Force (mN) of the tissue on whatever holds the face at `x_axis = SIDE`, from the nodal reactions:
/// the moment `sum_n f_n X_n` equals `-P V` for a homogeneous stress.
fn stress_from_reactions(mesh: &Mesh, contact: &[ContactNode], report: &FrameReport) -> Matrix {
    let volume = f64::from(SIDE).powi(3);
    let mut moment = [[0.0; 3]; 3];
    for (entry, force) in contact.iter().zip(&report.reaction) {
        let p = mesh.positions[entry.node as usize];
        for i in 0..3 {
            for j in 0..3 {
                // mN mm / mm³ = kPa
                moment[i][j] -= f64::from(force[i]) * f64::from(p[j]) / volume * 1e3;
            }
        }
    }
    moment
}

fn check(f: Matrix, pressure: Pressure) {
    let (mesh, solver, contact, report) = settle(f, pressure);
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    for (i, found) in u.iter().enumerate() {
        let wanted = affine(f, mesh.positions[i]);
        for k in 0..3 {
            assert!(
                (found[k] - wanted[k]).abs() < 2e-4,
                "node {i}: {found:?}, patch test wants {wanted:?}"
            );
        }
    }
    let (found, wanted) = (stress_from_reactions(&mesh, &contact, &report), piola(f));
    let scale = wanted.iter().flatten().fold(1.0f64, |m, v| m.max(v.abs()));
    for i in 0..3 {
        for j in 0..3 {
            assert!(
                (found[i][j] - wanted[i][j]).abs() < 2e-3 * scale,
                "P[{i}][{j}] = {} Pa, closed form {}",
                found[i][j],
                wanted[i][j]
            );
        }
    }
}

/// Verifies REQ-080.
#[test]
fn a_general_linear_field_passes_the_patch_test() {
    let f = [[1.05, 0.1, -0.03], [0.02, 0.97, 0.06], [0.0, -0.04, 1.02]];
    check(f, Pressure::Element);
    check(f, Pressure::AverageNodal);
}

#[test]
fn uniaxial_stress_has_the_closed_form_and_free_sides() {
    let stretch = 0.8;
    // Lateral stretch from P_xx = 0, by bisection on the closed form.
    let lateral_stress = |l: f64| piola([[l, 0.0, 0.0], [0.0, l, 0.0], [0.0, 0.0, stretch]])[0][0];
    let (mut low, mut high) = (0.9, 1.4);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if lateral_stress(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let f = [[low, 0.0, 0.0], [0.0, low, 0.0], [0.0, 0.0, stretch]];
    assert!(piola(f)[2][2] < -500.0, "a real load");
    check(f, Pressure::Element);
}

#[test]
fn simple_shear_has_the_closed_form() {
    let f = [[1.0, 0.0, 0.4], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let shear = piola(f)[0][2];
    // J = 1: P_xz = mu gamma (1 + gamma²/3) for this law's isochoric part.
    let mu = Material::default().shear_pa();
    assert!((shear - mu * 0.4).abs() < 0.06 * mu);
    check(f, Pressure::Element);
}

#[test]
fn strain_energy_of_a_homogeneous_state_is_the_density_times_the_volume() {
    let f = [[1.1, 0.0, 0.0], [0.0, 0.95, 0.0], [0.0, 0.0, 0.97]];
    let (_, _, _, report) = settle(f, Pressure::Element);
    let material = Material::default();
    let det: f64 = 1.1 * 0.95 * 0.97;
    let invariant = 1.1f64.powi(2) + 0.95f64.powi(2) + 0.97f64.powi(2);
    let density = 0.5 * material.shear_pa() * (invariant * det.powf(-2.0 / 3.0) - 3.0)
        + 0.5 * material.bulk_pa() * (det - 1.0).powi(2);
    let wanted = density * f64::from(SIDE).powi(3) * 1e-6;
    assert!((report.strain_energy / wanted - 1.0).abs() < 1e-3);
    assert!((report.min_det_f - det).abs() < 1e-4);
}
