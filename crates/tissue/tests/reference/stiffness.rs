//! Stiffness that differs from element to element: springs in series, and the same factor everywhere.

use tissue::mesh::{Boundary, Mesh, MeshError, regular_box};
use tissue::solver::{ContactNode, FrameReport, Pressure, Solver, SolverOptions};

/// A bar of 4 x 4 x 12 mm held at its bottom.
fn bar() -> Mesh {
    let mut mesh = regular_box([4.0, 4.0, 12.0], [2, 2, 6]).unwrap();
    mesh.fixed = nodes_at(&mesh, 0.0);
    mesh
}

fn nodes_at(mesh: &Mesh, z: f32) -> Vec<u32> {
    (0..mesh.node_count() as u32)
        .filter(|n| (mesh.positions[*n as usize][2] - z).abs() < 1e-4)
        .collect()
}

/// The lower half ten times stiffer than the upper.
fn two_layers() -> Mesh {
    let mut mesh = bar();
    mesh.stiffness = (mesh.tets.iter())
        .map(|tet| {
            let height: f32 = tet.iter().map(|n| mesh.positions[*n as usize][2]).sum();
            if height < 4.0 * 6.0 { 10.0 } else { 1.0 }
        })
        .collect();
    mesh
}

/// Leads the top to `(0, 0, lift)` and lets the bar settle.
fn stretch(mesh: &Mesh, options: SolverOptions, lift: f32) -> (Vec<[f32; 3]>, FrameReport) {
    let contact: Vec<ContactNode> = nodes_at(mesh, 12.0)
        .into_iter()
        .map(|node| ContactNode {
            node,
            displacement: [0.0, 0.0, lift],
        })
        .collect();
    let mut solver = Solver::new(mesh, Boundary::Fixed, options).unwrap();
    let mut report = solver.step_frame(&contact, 0.05).unwrap();
    for _ in 0..6 {
        report = solver.step_frame(&contact, 0.05).unwrap();
    }
    let mut field = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut field);
    (field, report)
}

#[test]
fn layers_in_series_share_a_stretch_by_their_compliances() {
    let mesh = two_layers();
    let mut options = SolverOptions::default();
    // Without lateral contraction each layer is a spring of stiffness E A / 6 mm: 1/11 and 10/11 of the stretch.
    options.material.poisson = 0.0;
    options.material.damping_per_s = 300.0;
    let lift = 0.033;
    let (field, report) = stretch(&mesh, options, lift);
    for (position, u) in mesh.positions.iter().zip(&field) {
        let z = position[2];
        let wanted = lift / 11.0
            * if z <= 6.0 {
                z / 6.0
            } else {
                1.0 + 10.0 * (z - 6.0) / 6.0
            };
        assert!(
            (u[2] - wanted).abs() < 0.01 * lift,
            "z = {z}: {u:?}, springs in series want {wanted}"
        );
    }
    // Stress of the soft layer times the area, and half the force times the stretch.
    let strain = f64::from(lift) * 10.0 / 11.0 / 6.0;
    let force = 3.0 * strain * 16.0;
    let pull: f64 = report.reaction.iter().map(|f| f64::from(f[2])).sum();
    assert!(
        (pull + force).abs() < 0.015 * force,
        "{pull} mN, closed form {}",
        -force
    );
    let energy = 0.5 * force * f64::from(lift) * 1e-3;
    assert!(
        (report.strain_energy - energy).abs() < 0.015 * energy,
        "{} mJ, closed form {energy}",
        report.strain_energy
    );
}

#[test]
fn one_factor_everywhere_is_another_modulus_to_the_bit() {
    for pressure in [Pressure::Element, Pressure::AverageNodal] {
        let options = SolverOptions {
            pressure,
            mass_scaling_s: 2e-4,
            ..SolverOptions::default()
        };
        let mut harder = options.clone();
        harder.material.young_pa *= 4.0;
        let uniform = bar();
        let mut marked = bar();
        marked.stiffness = vec![4.0; marked.tets.len()];
        let (wanted, report) = stretch(&uniform, harder, 1.5);
        let (found, same) = stretch(&marked, options, 1.5);
        assert_eq!(found, wanted, "{pressure:?}");
        assert_eq!(same.reaction, report.reaction);
        assert_eq!(same.inner_steps, report.inner_steps);
    }
}

#[test]
fn a_stiff_layer_shortens_the_critical_step_by_the_root_of_its_factor() {
    let critical = |mesh: &Mesh| {
        Solver::new(mesh, Boundary::Fixed, SolverOptions::default())
            .unwrap()
            .critical_step_at_rest_s()
    };
    let ratio = critical(&bar()) / critical(&two_layers());
    assert!((ratio / 10f64.sqrt() - 1.0).abs() < 0.15, "{ratio}");
}

#[test]
fn stiffness_is_kept_by_the_file_and_changes_the_hash() {
    let folder = tempfile::tempdir().unwrap();
    let (plain, layers) = (bar(), two_layers());
    for (name, mesh) in [("plain", &plain), ("layers", &layers)] {
        let path = folder.path().join(name);
        mesh.write(&path).unwrap();
        let read = Mesh::read(&path).unwrap();
        assert_eq!(&read, mesh);
        assert_eq!(read.hash(), mesh.hash());
    }
    assert_ne!(plain.hash(), layers.hash());
}

#[test]
fn bad_stiffness_is_refused_by_element() {
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let mut mesh = two_layers();
        mesh.stiffness[5] = bad;
        assert!(matches!(
            mesh.validate(),
            Err(MeshError::Stiffness { tet: 5, .. })
        ));
    }
    let mut mesh = two_layers();
    mesh.stiffness.pop();
    assert!(matches!(
        mesh.validate(),
        Err(MeshError::StiffnessCount { .. })
    ));
}
