//! Static solutions of CalculiX on the same meshes with the same elements and law
//! (fixtures: tests/fixtures/make_calculix.py).

use elements::{Law, MooneyRivlin};
use safetensors::SafeTensors;
use tissue::mesh::{Boundary, Mesh, regular_box};
use tissue::solver::{ContactNode, Solver, SolverOptions};
use tissue::tensors::{f32_values, i32_values};

const BRAIN: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../onnx/meshes/brain-coarse.mesh.safetensors"
);

struct Case {
    law: Law,
    displacement: Vec<[f32; 3]>,
    reaction: Vec<[f32; 3]>,
    contact: Vec<ContactNode>,
}

/// A case of the fixture of a law.
fn case(name: &str, law: Law) -> Case {
    let file = match law {
        Law::MooneyRivlin(_) => "calculix-mooney-rivlin.safetensors",
        _ => "calculix.safetensors",
    };
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures");
    let path = std::path::Path::new(folder).join(file);
    let bytes = std::fs::read(path).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let vectors = |field: &str| -> Vec<[f32; 3]> {
        let tensor = file.tensor(&format!("{name}.{field}")).unwrap();
        let values: Vec<f32> = f32_values(tensor.data()).collect();
        values.as_chunks().0.to_vec()
    };
    let nodes = file.tensor(&format!("{name}.nodes")).unwrap();
    let contact = i32_values(nodes.data())
        .zip(vectors("vectors"))
        .map(|(node, displacement)| ContactNode {
            node: node as u32,
            displacement,
        })
        .collect();
    Case {
        law,
        displacement: vectors("displacement"),
        reaction: vectors("reaction"),
        contact,
    }
}

/// Pushes to the case's contact and waits until nothing moves; returns displacement and reaction.
fn settle(mesh: &Mesh, case: &Case, frames: u32) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let mut options = SolverOptions::default();
    // The static end is the same for any damping; 40 /s gets there soon.
    options.material.damping_per_s = 40.0;
    options.material.law = case.law;
    options.inner_step_s = 2e-4;
    let mut solver = Solver::new(mesh, Boundary::Fixed, options).unwrap();
    let mut report = None;
    for frame in 1..=frames {
        let part = (frame as f32 / 10.0).min(1.0);
        let contact: Vec<ContactNode> = case
            .contact
            .iter()
            .map(|c| ContactNode {
                node: c.node,
                displacement: c.displacement.map(|v| v * part),
            })
            .collect();
        report = Some(solver.step_frame(&contact, 0.05).unwrap());
    }
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    (u, report.unwrap().reaction)
}

fn compare(mesh: &Mesh, case: &Case, frames: u32) {
    let (u, reaction) = settle(mesh, case, frames);
    let worst = u
        .as_flattened()
        .iter()
        .zip(case.displacement.as_flattened())
        .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
    assert!(worst < 0.02, "largest difference {worst} mm");
    // CalculiX prints the force on the tissue.
    let (mut difference, mut norm) = (0.0, 0.0);
    for (a, b) in reaction
        .as_flattened()
        .iter()
        .zip(case.reaction.as_flattened())
    {
        difference += f64::from(a + b).powi(2);
        norm += f64::from(*b).powi(2);
    }
    let relative = (difference / norm).sqrt();
    assert!(relative < 5e-3, "reactions differ by {relative}");
}

/// Two static solutions in f64: the explicit solver's f32 stays out of it.
#[cfg(feature = "linear")]
fn compare_equilibria(mesh: &Mesh, case: &Case) {
    let material = elements::Material {
        law: case.law,
        ..Default::default()
    };
    let led = case.contact.iter().map(|c| c.node);
    let held: Vec<u32> = mesh.fixed.iter().copied().chain(led).collect();
    let u = tissue::statics::relax(mesh, &held, &material, &case.displacement).unwrap();
    let pairs = u
        .as_flattened()
        .iter()
        .zip(case.displacement.as_flattened());
    let worst = pairs.fold(0.0f64, |most, (a, b)| most.max((a - f64::from(*b)).abs()));
    assert!(
        worst < 1e-5,
        "{:?}: largest difference {worst} mm",
        case.law
    );
}

/// Verifies REQ-080.
#[cfg(feature = "linear")]
#[test]
fn equilibria_of_both_laws_agree_with_calculix_to_its_printed_digits() {
    let cube = regular_box([40.0; 3], [5; 3]).unwrap();
    let brain = Mesh::read(std::path::Path::new(BRAIN)).unwrap();
    for law in [Law::default(), mooney_rivlin()] {
        compare_equilibria(&cube, &case("cube", law));
        compare_equilibria(&brain, &case("brain", law));
    }
}

#[test]
fn a_sheared_and_pressed_cube_agrees_with_calculix() {
    let mesh = regular_box([40.0; 3], [5; 3]).unwrap();
    compare(&mesh, &case("cube", Law::default()), 40);
    compare(&mesh, &case("cube", mooney_rivlin()), 40);
}

fn mooney_rivlin() -> Law {
    Law::MooneyRivlin(MooneyRivlin::default())
}

#[test]
fn a_pushed_brain_agrees_with_calculix() {
    let mesh = Mesh::read(std::path::Path::new(BRAIN)).unwrap();
    compare(&mesh, &case("brain", Law::default()), 80);
    compare(&mesh, &case("brain", mooney_rivlin()), 80);
}
