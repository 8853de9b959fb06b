//! Equilibria against the end of a long hold in the explicit solver, and against their own definition.

use std::collections::BTreeMap;

use super::*;
use crate::linear::compliance_columns;
use crate::mesh::box_phantom;
use crate::solver::{Solver, SolverOptions};
use crate::tensors::{Dtype, Tensor, write_file};

fn phantom() -> Mesh {
    box_phantom([60.0, 60.0, 30.0], [6, 6, 4]).unwrap()
}

/// The file that `upt prior` writes.
fn write_columns(mesh: &Mesh, path: &FilePath) {
    let material = Material::default();
    let lame = Lame::from_young(material.young_pa, material.poisson).unwrap();
    let stiffness = Stiffness::assemble(mesh, &mesh.fixed, lame).unwrap();
    let factor = Factor::new(&stiffness, &mesh.positions, 1).unwrap();
    let mut nodes: Vec<u32> = (mesh.domain.iter())
        .flat_map(|&face| mesh.surface[face as usize])
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut columns = Vec::new();
    let compliance = compliance_columns(&stiffness, &factor, &nodes, 32, |_, rows| {
        columns.extend_from_slice(rows);
        Ok(())
    })
    .unwrap();
    let bytes = |values: &mut dyn Iterator<Item = f32>| values.flat_map(f32::to_le_bytes).collect();
    let (rows, width) = (3 * nodes.len(), 3 * mesh.node_count());
    let tensors = [
        Tensor::new(
            "columns",
            Dtype::F32,
            vec![rows, width],
            bytes(&mut columns.into_iter()),
        ),
        Tensor::new(
            "compliance",
            Dtype::F32,
            vec![rows, rows],
            bytes(&mut compliance.block.iter().map(|v| *v as f32)),
        ),
        Tensor::new(
            "contact_nodes",
            Dtype::I32,
            vec![nodes.len()],
            nodes
                .iter()
                .flat_map(|n| (*n as i32).to_le_bytes())
                .collect(),
        ),
    ];
    let metadata = [
        ("mesh_sha256", mesh.hash()),
        ("boundary", "fixed".to_string()),
        ("young_pa", material.young_pa.to_string()),
        ("poisson", material.poisson.to_string()),
    ];
    let metadata: BTreeMap<String, String> = metadata.map(|(k, v)| (k.to_string(), v)).into();
    write_file(path, &metadata, &tensors).unwrap();
}

/// A solver on the phantom; the folder of its columns lives as long.
fn solver(mesh: &Mesh) -> (StaticSolver, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.columns.safetensors");
    write_columns(mesh, &path);
    let solver = StaticSolver::new(mesh, Boundary::Fixed, Material::default(), &path).unwrap();
    (solver, folder)
}

/// A push of `depth` mm, tilted, on the nodes within 13 mm of the middle of the top.
fn push(mesh: &Mesh, depth: f32) -> Vec<ContactNode> {
    let near = |p: [f32; 3]| p[2] > 29.9 && (p[0] - 30.0).hypot(p[1] - 30.0) < 13.0;
    let nodes = (0..mesh.node_count()).filter(|&node| near(mesh.positions[node]));
    nodes
        .map(|node| ContactNode {
            node: node as u32,
            displacement: [0.4 * depth, 0.1 * depth, -0.9 * depth],
        })
        .collect()
}

#[test]
fn an_equilibrium_is_where_a_long_hold_in_the_explicit_solver_ends() {
    let mesh = phantom();
    let (statics, _folder) = solver(&mesh);
    let sites = vec![vec![push(&mesh, 5.0), push(&mesh, 10.0)]];
    let outcome = statics.equilibria(&sites, |_| {}).unwrap().remove(0);
    assert_eq!(outcome.failure, None);
    assert_eq!(outcome.found.len(), 2);

    let options = SolverOptions {
        inner_step_s: 5e-4,
        ..SolverOptions::default()
    };
    let mut moving = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let mut report = None;
    for frame in 1..=100 {
        let depth = (frame as f32).min(20.0) / 20.0;
        report = Some(moving.step_frame(&push(&mesh, 10.0 * depth), 0.05).unwrap());
    }
    let mut held = vec![[0.0f32; 3]; mesh.node_count()];
    moving.displacement(&mut held);
    let report = report.unwrap();

    let last = &outcome.found[1];
    let apart = (held.as_flattened().iter().zip(&last.displacement))
        .fold(0.0f64, |most, (a, b)| most.max((f64::from(*a) - b).abs()));
    assert!(apart < 5e-3, "{apart} mm from the end of the hold");
    for (found, dynamic) in last.reaction.iter().zip(report.reaction.as_flattened()) {
        assert!((found - f64::from(*dynamic)).abs() < 0.02 * length(&last.reaction));
    }
    assert!((last.energy.value * 1e-3 / report.strain_energy - 1.0).abs() < 1e-3);
    assert!((last.energy.min_det - report.min_det_f).abs() < 1e-3);

    // Far from linear, else this would show nothing.
    let half = &outcome.found[0].displacement;
    let nonlinear = (half.iter().zip(&last.displacement))
        .fold(0.0f64, |most, (a, b)| most.max((2.0 * a - b).abs()));
    assert!(nonlinear > 0.3, "{nonlinear} mm");
}

#[test]
fn forces_are_the_derivative_of_the_energy() {
    let mesh = phantom();
    let body = StrainEnergy::new(&mesh, &Material::default());
    let wave = |(at, x): (usize, &f32)| 0.4 * (f64::from(*x) * 0.31 + at as f64).sin();
    let mut u: Vec<f64> = mesh
        .positions
        .as_flattened()
        .iter()
        .enumerate()
        .map(wave)
        .collect();
    let mut gradient = vec![0.0; u.len()];
    let mut other = vec![0.0; u.len()];
    assert!(body.evaluate(&u, &mut gradient).min_det > 0.3);
    for dof in [0, 50, 101, 333] {
        let (start, step) = (u[dof], 1e-5);
        u[dof] = start + step;
        let up = body.evaluate(&u, &mut other).value;
        u[dof] = start - step;
        let down = body.evaluate(&u, &mut other).value;
        u[dof] = start;
        let slope = (up - down) / (2.0 * step);
        assert!(
            (slope - gradient[dof]).abs() < 1e-5 * (1.0 + slope.abs()),
            "dof {dof}"
        );
    }
}

#[test]
fn a_tighter_tolerance_moves_an_equilibrium_by_little() {
    let mesh = phantom();
    let (mut statics, _folder) = solver(&mesh);
    let sites = vec![vec![push(&mesh, 12.0)]];
    let usual = statics.equilibria(&sites, |_| {}).unwrap().remove(0);
    statics.tolerance_mm = 1e-6;
    let exact = statics.equilibria(&sites, |_| {}).unwrap().remove(0);
    let apart = (usual.found[0]
        .displacement
        .iter()
        .zip(&exact.found[0].displacement))
    .fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
    assert!(apart > 0.0 && apart < 2e-2, "{apart} mm");
}

#[test]
fn a_push_that_cannot_be_reached_is_reported_with_what_was() {
    let mesh = phantom();
    let (statics, _folder) = solver(&mesh);
    // The third presses the top through the held bottom.
    let sites = vec![vec![push(&mesh, 6.0), push(&mesh, 12.0), push(&mesh, 40.0)]];
    let outcome = statics.equilibria(&sites, |_| {}).unwrap().remove(0);
    assert_eq!(outcome.found.len(), 2);
    assert_eq!(outcome.failure.unwrap().0, 2);
}

#[test]
fn a_case_has_eight_sites_of_four_depths_and_the_same_bytes_each_time() {
    let mesh = phantom();
    let (statics, _folder) = solver(&mesh);
    for scheme in [Scheme::Static, Scheme::StaticTwo] {
        let mut most = 0;
        let (one, skipped) = statics.trajectory(scheme, 5, |done| most = done).unwrap();
        let (two, _) = statics.trajectory(scheme, 5, |_| {}).unwrap();
        assert_eq!(one, two);
        assert_eq!(most, 32);
        assert_eq!(one.frame_count() == 33, skipped.is_empty());
        assert!(one.frame_count() > 20, "{skipped:?}");
        for frame in 1..one.frame_count() {
            let (nodes, vectors) = one.contact(frame);
            for (node, vector) in nodes.iter().zip(vectors) {
                assert_eq!(one.frame(frame)[*node as usize], *vector);
            }
        }
    }
}

#[test]
fn columns_of_another_body_are_refused() {
    let mesh = phantom();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.columns.safetensors");
    write_columns(&mesh, &path);
    let refused = |mesh: &Mesh, material: Material| {
        let made = StaticSolver::new(mesh, Boundary::Fixed, material, &path);
        made.err()
            .map(|error| error.to_string())
            .unwrap_or_default()
    };
    let other = box_phantom([60.0, 60.0, 31.0], [6, 6, 4]).unwrap();
    assert!(refused(&other, Material::default()).contains("`mesh_sha256`"));
    let softer = Material {
        poisson: 0.45,
        ..Material::default()
    };
    assert!(refused(&mesh, softer).contains("`poisson` is 0.49, not 0.45"));
}
