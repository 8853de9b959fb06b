//! The solver against CalculiX, a closed form, the balance of energy and its own refinement.

use std::path::{Path, PathBuf};

use elements::{Law, MooneyRivlin};
use safetensors::SafeTensors;
use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh, box_phantom, regular_box};
use tissue::metrics::relative_l2;
use tissue::solver::{ContactNode, Pressure, Solver, SolverOptions};
use tissue::tensors::{f32_values, i32_values};

use super::{Outcome, Vectors, settle, soft};

pub fn table(brain: &Mesh) -> Outcome<String> {
    let mut table = String::from("| case | against | difference |\n|---|---|---|\n");
    let cube = regular_box([40.0; 3], [5; 3])?;
    let mooney_rivlin = Law::MooneyRivlin(MooneyRivlin::default());
    for (name, label, mesh, frames, law) in [
        (
            "cube",
            "cube, sheared 6 mm and pressed 8 mm of 40",
            &cube,
            40,
            Law::default(),
        ),
        (
            "brain",
            "coarse brain, pushed 8 mm",
            brain,
            80,
            Law::default(),
        ),
        ("cube", "cube, Mooney-Rivlin", &cube, 40, mooney_rivlin),
        (
            "brain",
            "coarse brain, Mooney-Rivlin",
            brain,
            80,
            mooney_rivlin,
        ),
    ] {
        let (contact, displacement, forces, solver) = calculix(name, law)?;
        let material = Material { law, ..soft(40.0) };
        let (u, reaction, _) = settle(mesh, &contact, material, Pressure::Element, frames)?;
        let worst = largest(&u, &displacement);
        let negated: Vec<[f32; 3]> = reaction.iter().map(|f| f.map(|v| -v)).collect();
        table += &format!(
            "| {label} | {solver}, static, same elements and law | displacement {:.1e} mm at most by the equilibrium in float64, {worst:.1e} by the explicit solver in float32, reactions {:.1e} (relative L2) |\n",
            equilibrium_difference(mesh, &contact, &material, &displacement)?,
            relative_l2(&forces, &negated)
        );
    }
    table += &format!(
        "| pressure wave over 100 mm of a bar, nu = 0 | `c = sqrt(E / rho)` | arrival {:+.2} % |\n",
        100.0 * wave_arrival()?
    );
    table += &format!(
        "| undamped push and release, 12 frames | work of the contact = strain + kinetic energy | {:.3} % of the largest energy at most |\n",
        100.0 * energy_balance()?
    );
    let forces = [3, 6, 12, 24].map(|cells| pressed_box(cells).unwrap_or(f64::NAN));
    table += &format!(
        "| pressed cube, nu = 0.3, 3, 6, 12, 24 cells a side | refinement | reaction {:.1}, {:.1}, {:.1}, {:.1} mN: differences shrink by {:.2} and {:.2} |\n",
        forces[0],
        forces[1],
        forces[2],
        forces[3],
        (forces[1] - forces[2]) / (forces[0] - forces[1]),
        (forces[2] - forces[3]) / (forces[1] - forces[2]),
    );
    Ok(table)
}

/// Largest difference between a static solution and the equilibrium of the law in f64 with the same nodes led, mm.
fn equilibrium_difference(
    mesh: &Mesh,
    contact: &[ContactNode],
    material: &Material,
    displacement: &[[f32; 3]],
) -> Outcome<f64> {
    let led = contact.iter().map(|c| c.node);
    let held: Vec<u32> = mesh.fixed.iter().copied().chain(led).collect();
    let found = tissue::statics::relax(mesh, &held, material, displacement)?;
    let pairs = found.as_flattened().iter().zip(displacement.as_flattened());
    Ok(pairs.fold(0.0, |most, (a, b)| most.max((a - f64::from(*b)).abs())))
}

/// Largest difference of two fields.
fn largest(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

type Static = (Vec<ContactNode>, Vectors, Vectors, String);

/// Contact, displacement and forces of a case in the CalculiX fixture of a law.
fn calculix(name: &str, law: Law) -> Outcome<Static> {
    let file = match law {
        Law::MooneyRivlin(_) => "calculix-mooney-rivlin.safetensors",
        _ => "calculix.safetensors",
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let path: PathBuf = folder.join(file);
    let bytes = std::fs::read(path)?;
    let (_, header) = SafeTensors::read_metadata(&bytes)?;
    let solver = header
        .metadata()
        .as_ref()
        .and_then(|m| m.get("solver").cloned())
        .unwrap_or_default();
    let file = SafeTensors::deserialize(&bytes)?;
    let vectors = |field: &str| -> Outcome<Vec<[f32; 3]>> {
        let tensor = file.tensor(&format!("{name}.{field}"))?;
        let values: Vec<f32> = f32_values(tensor.data()).collect();
        Ok(values.as_chunks().0.to_vec())
    };
    let nodes = file.tensor(&format!("{name}.nodes"))?;
    let contact = i32_values(nodes.data())
        .zip(vectors("vectors")?)
        .map(|(node, displacement)| ContactNode {
            node: node as u32,
            displacement,
        })
        .collect();
    Ok((
        contact,
        vectors("displacement")?,
        vectors("reaction")?,
        solver,
    ))
}

fn top(mesh: &Mesh, height: f32, displacement: [f32; 3]) -> Vec<ContactNode> {
    (0..mesh.node_count() as u32)
        .filter(|n| mesh.positions[*n as usize][2] > height - 1e-3)
        .map(|node| ContactNode { node, displacement })
        .collect()
}

/// Relative difference of the arrival of half the imposed step, 100 mm down a bar.
fn wave_arrival() -> Outcome<f64> {
    let mesh = box_phantom([8.0, 8.0, 160.0], [2, 2, 40])?;
    let mut options = SolverOptions::default();
    options.material.poisson = 0.0;
    options.material.damping_per_s = 0.0;
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options)?;
    let contact = top(&mesh, 160.0, [0.0, 0.0, -0.2]);
    let station: Vec<usize> = (0..mesh.node_count())
        .filter(|i| (mesh.positions[*i][2] - 60.0).abs() < 1e-3)
        .collect();
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    let mut before = 0.0;
    for _ in 0..200 {
        solver.step_frame(&contact, 0.001)?;
        solver.displacement(&mut u);
        let mean = station.iter().map(|i| u[*i][2]).sum::<f32>() / station.len() as f32;
        if mean <= -0.1 {
            let part = f64::from((-0.1 - before) / (mean - before));
            let arrival = solver.time_s() - 0.001 * (1.0 - part);
            return Ok(arrival / (0.0005 + 100.0 / (1000.0 * 3.0f64.sqrt())) - 1.0);
        }
        before = mean;
    }
    Err("the wave never arrived".into())
}

/// Largest gap between work and energy, relative to the largest energy.
fn energy_balance() -> Outcome<f64> {
    let mesh = box_phantom([40.0; 3], [6; 3])?;
    let options = SolverOptions {
        material: soft(0.0),
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options)?;
    let (mut gap, mut scale) = (0.0f64, 0.0f64);
    for frame in 1..=12 {
        let part = frame as f32 / 6.0;
        let contact = match frame {
            1..=6 => top(&mesh, 40.0, [3.0 * part, 0.0, -2.0 * part]),
            _ => Vec::new(),
        };
        let report = solver.step_frame(&contact, 0.05)?;
        let energy = report.strain_energy + report.kinetic_energy;
        gap = gap.max((report.external_work - energy).abs());
        scale = scale.max(energy);
    }
    Ok(gap / scale)
}

/// Reaction (mN) of a cube pressed by 6 of 40 mm at nu = 0.3.
fn pressed_box(cells: usize) -> Outcome<f64> {
    let mesh = box_phantom([40.0; 3], [cells; 3])?;
    let material = Material {
        poisson: 0.3,
        ..soft(60.0)
    };
    let contact = top(&mesh, 40.0, [0.0, 0.0, -6.0]);
    let (_, reaction, _) = settle(&mesh, &contact, material, Pressure::Element, 24)?;
    Ok(reaction.iter().map(|f| f64::from(f[2])).sum())
}
