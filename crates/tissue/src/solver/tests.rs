//! Nodal forces against the derivative of the strain energy in f64.

use super::*;
use crate::material::Material;
use crate::mesh::box_phantom;
use crate::statics::energy::StrainEnergy;

/// Forces of a displacement, mN, by every instruction set of this processor.
fn forces(mesh: &Mesh, material: Material, u: &[[f32; 3]]) -> Vec<(Isa, Vec<[f32; 3]>)> {
    let found = Isa::available().into_iter().map(|isa| {
        let options = SolverOptions {
            isa: Some(isa),
            material,
            ..SolverOptions::default()
        };
        let mut solver = Solver::new(mesh, Boundary::Fixed, options).unwrap();
        for (slot, u) in solver.partition.slot_of_node.iter().zip(u) {
            solver.fields.displacement[*slot as usize].0[..3].copy_from_slice(u);
        }
        solver.update_forces();
        let slots = solver.partition.slot_of_node.iter();
        let rows = slots.map(|slot| {
            let [x, y, z, _] = solver.fields.force[*slot as usize].0;
            [x * 1e-3, y * 1e-3, z * 1e-3]
        });
        (isa, rows.collect())
    });
    found.collect()
}

/// Several chunks of all kinds of clusters, far from the origin, with stiffness that differs.
fn body() -> Mesh {
    let mut mesh = box_phantom([60.0; 3], [10; 3]).unwrap();
    for position in &mut mesh.positions {
        position[0] += 100.0;
    }
    mesh.stiffness = (0..mesh.tets.len())
        .map(|tet| 1.0 + (tet % 3) as f32)
        .collect();
    mesh
}

#[test]
fn forces_are_the_derivative_of_the_energy() {
    let mesh = body();
    let partition = Partition::new(mesh.tetrahedra(), &Material::default()).unwrap();
    assert!(partition.chunks.len() > 1);
    assert!(partition.octahedra.count() > 0 && partition.pairs.count() > 0);
    // Up to 0.6 mm a node in elements of some 5 mm, and 10 mm of the whole.
    let u: Vec<[f32; 3]> = (0..mesh.node_count())
        .map(|node| {
            let noise =
                [0.754_877_7, 0.569_840_3, 0.362_4].map(|step| (node as f32 * step).fract() - 0.5);
            [10.0 + 1.2 * noise[0], 1.2 * noise[1], 1.2 * noise[2]]
        })
        .collect();
    let laws =
        ["neo-hookean", "ogden:-163,-18", "ogden:-157,-18.7"].map(|law| law.parse().unwrap());
    for (poisson, law) in [0.3, 0.49, 0.4998]
        .into_iter()
        .flat_map(|nu| laws.map(|law| (nu, law)))
    {
        let material = Material {
            poisson,
            ..Material::default()
        }
        .with_law(law);
        let wide: Vec<f64> = u.as_flattened().iter().map(|v| f64::from(*v)).collect();
        let mut gradient = vec![0.0; wide.len()];
        let energy = StrainEnergy::new(&mesh, &material).evaluate(&wide, &mut gradient);
        assert!(energy.min_det > 0.2 && energy.min_det < 0.9, "{energy:?}");
        let largest = gradient.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (isa, found) in forces(&mesh, material, &u) {
            let worst = found
                .as_flattened()
                .iter()
                .zip(&gradient)
                .fold(0.0f64, |m, (f, g)| m.max((f64::from(*f) + g).abs()));
            assert!(
                worst < 3e-6 * largest,
                "{isa:?}, nu = {poisson}, {law}: {worst} of {largest} mN"
            );
        }
    }
}

/// Strain by rounding alone: a few parts in ten million, against the bulk modulus.
#[test]
fn forces_at_rest_are_rounding() {
    let mesh = body();
    let material = Material::default();
    let u = vec![[0.0; 3]; mesh.node_count()];
    // Pa mm² = µN; a node's share of its elements' faces is about 36 mm², the modulus up to three times the material's.
    let bound = (3e-7 * 3.0 * material.bulk_pa() * 36.0 * 1e-3) as f32;
    for (isa, found) in forces(&mesh, material, &u) {
        let worst = found
            .as_flattened()
            .iter()
            .fold(0.0f32, |m, f| m.max(f.abs()));
        assert!(worst < bound, "{isa:?}: {worst} mN, bound {bound}");
    }
}

/// Rounding is an initial strain of some 1e-7: the body goes where that leads it, and no further.
#[test]
fn a_body_at_rest_stays_there() {
    let mesh = body();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default()).unwrap();
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    for _ in 0..20 {
        solver.step_frame(&[], 0.05).unwrap();
        solver.displacement(&mut u);
        let worst = u.as_flattened().iter().fold(0.0f32, |m, v| m.max(v.abs()));
        assert!(worst < 5e-5, "{worst} mm");
    }
}

/// A body all of whose elements are of a region with a density is one of that density, scaled masses and all.
#[test]
fn regions_have_the_masses_of_their_density() {
    let plain = body();
    let mut heavy = plain.clone();
    heavy.region = vec![1; heavy.tets.len()];
    heavy.regions = vec![elements::Region {
        name: "heavy".into(),
        law: elements::Law::default(),
        source: String::new(),
        density_kg_m3: Some(1850.0),
        relaxation: None,
    }];
    let masses = |mesh: &Mesh, density_kg_m3| {
        let options = SolverOptions {
            material: Material {
                density_kg_m3,
                ..Material::default()
            },
            mass_scaling_s: 6e-4,
            ..SolverOptions::default()
        };
        let solver = Solver::new(mesh, Boundary::Fixed, options).unwrap();
        let slots = solver.partition.slot_of_node.iter();
        let scaled: Vec<f32> = slots.map(|slot| solver.mass[*slot as usize]).collect();
        (scaled, solver.mass_of_nodes())
    };
    let (own, want) = (masses(&heavy, 1000.0), masses(&plain, 1850.0));
    let added: f64 = want.0.iter().map(|m| f64::from(*m)).sum();
    assert!(
        added > 1.001 * want.1.iter().sum::<f64>(),
        "nothing was scaled"
    );
    for (own, want) in own.0.iter().zip(&want.0) {
        assert!((own / want - 1.0).abs() < 1e-5, "{own} for {want}");
    }
    for (own, want) in own.1.iter().zip(&want.1) {
        assert!((own / want - 1.0).abs() < 1e-12, "{own} for {want}");
    }
}
