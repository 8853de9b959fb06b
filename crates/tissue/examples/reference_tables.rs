//! Writes the tables of docs/results/reference-solver.md:
//! `cargo run --release -p tissue --example reference_tables [-- TABLE..]`.
//!
//! The tables are `verification`, `laws`, `locking` and `scaling`; all where none is named. The text between `<!-- TABLE -->`
//! and the next `<!-- end -->` is replaced.

use elements::{ElementForces, Law, MooneyRivlin, Simd};
use safetensors::SafeTensors;
use std::error::Error;
use std::path::{Path, PathBuf};
use tissue::contact::{ContactDomain, FACE_AREA_MM2};
use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh, box_phantom, regular_box};
use tissue::metrics::relative_l2;
use tissue::solver::{ContactNode, Pressure, Solver, SolverOptions};
use tissue::tensors::{f32_values, i32_values};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// `[K,3]` mm or mN.
type Vectors = Vec<[f32; 3]>;

fn main() -> Outcome<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = root.join("docs/results/reference-solver.md");
    let mut text = std::fs::read_to_string(&page)?;
    let brain = Mesh::read(&root.join("onnx/meshes/brain-coarse.mesh.safetensors"))?;
    let fine = Mesh::read(&root.join("onnx/meshes/brain.mesh.safetensors"))?;
    let asked: Vec<String> = std::env::args().skip(1).collect();
    for marker in ["verification", "laws", "locking", "scaling"] {
        if !asked.is_empty() && !asked.iter().any(|name| name == marker) {
            continue;
        }
        let table = match marker {
            "verification" => verification(&brain)?,
            "laws" => laws(&fine)?,
            "locking" => locking(&brain, &fine)?,
            _ => mass_scaling(&brain, &fine)?,
        };
        print!("{table}");
        text = replace(&text, marker, &table)?;
    }
    std::fs::write(page, text)?;
    Ok(())
}

fn replace(text: &str, marker: &str, table: &str) -> Outcome<String> {
    let start = format!("<!-- {marker} -->\n");
    let from = text.find(&start).ok_or(format!("no {start:?}"))? + start.len();
    let to = from + text[from..].find("<!-- end -->").ok_or("no end marker")?;
    Ok(format!("{}{table}{}", &text[..from], &text[to..]))
}

/// Leads `contact` in over ten frames and waits; displacement, reaction and CPU-bound seconds.
fn settle(
    mesh: &Mesh,
    contact: &[ContactNode],
    material: Material,
    pressure: Pressure,
    frames: u32,
) -> Outcome<(Vectors, Vectors, f64)> {
    let options = SolverOptions {
        material,
        pressure,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(mesh, Boundary::Fixed, options)?;
    let start = std::time::Instant::now();
    let mut reaction = Vec::new();
    for frame in 1..=frames {
        let part = (frame as f32 / 10.0).min(1.0);
        let led: Vec<ContactNode> = contact
            .iter()
            .map(|c| ContactNode {
                displacement: c.displacement.map(|v| v * part),
                ..*c
            })
            .collect();
        reaction = solver.step_frame(&led, 0.05)?.reaction;
    }
    let seconds = start.elapsed().as_secs_f64();
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    Ok((u, reaction, seconds))
}

fn soft(damping_per_s: f64) -> Material {
    Material {
        damping_per_s,
        ..Material::default()
    }
}

fn verification(brain: &Mesh) -> Outcome<String> {
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

fn largest(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

type Static = (Vec<ContactNode>, Vectors, Vectors, String);

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

/// Contact, displacement and forces of a case in the CalculiX fixture of a law.
fn calculix(name: &str, law: Law) -> Outcome<Static> {
    let file = match law {
        Law::NeoHookean(_) => "calculix.safetensors",
        Law::MooneyRivlin(_) => "calculix-mooney-rivlin.safetensors",
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

/// What each law costs: the forces of a mesh by one thread, the laws in turn, medians.
fn laws(mesh: &Mesh) -> Outcome<String> {
    const ROUNDS: usize = 200;
    let all = [Law::default(), Law::MooneyRivlin(MooneyRivlin::default())];
    let count = mesh.node_count();
    let mut table = format!(
        "| law | instruction set | forces of {count} nodes, {} tetrahedra, ms | over neo-Hookean |\n|---|---|---|---|\n",
        mesh.tets.len()
    );
    let u: Vec<f32> = (mesh.positions.iter().flatten())
        .map(|x| 0.5 * (0.1 * x).sin())
        .collect();
    for simd in Simd::ALL.into_iter().filter(|simd| simd.is_available()) {
        let bodies = all.map(|law| {
            let material = Material {
                law,
                ..Material::default()
            };
            ElementForces::new(mesh.tetrahedra(), &material, simd)
        });
        let mut scratch = bodies[0].scratch(1)?;
        let mut out = vec![0.0; u.len()];
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..ROUNDS {
            for (body, times) in bodies.iter().zip(&mut times) {
                let start = std::time::Instant::now();
                body.evaluate(&u, &mut scratch, &mut out, &|count, task| {
                    (0..count).for_each(|chunk| task(chunk, 0));
                });
                times.push(1e3 * start.elapsed().as_secs_f64());
            }
        }
        let medians = times.map(|mut times| {
            times.sort_by(f64::total_cmp);
            times[ROUNDS / 2]
        });
        for (law, median) in all.iter().zip(medians) {
            table += &format!(
                "| {law:.3} | {simd:?} | {median:.3} | {:.2} |\n",
                median / medians[0]
            );
        }
    }
    Ok(table)
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

/// What one pressure an element does to the answer at nu = 0.49, on a held 12 mm push.
fn locking(coarse: &Mesh, fine: &Mesh) -> Outcome<String> {
    let mut table = String::from(
        "| push, mesh | pressure | reaction, mN | displacement against average nodal pressure (relative L2) | run time |\n|---|---|---|---|---|\n",
    );
    for (brain, faces) in [
        (coarse, 25.0),
        (coarse, 50.0),
        (coarse, 100.0),
        (fine, 50.0),
    ] {
        let domain = ContactDomain::new(brain, Boundary::Fixed)?;
        let patch = domain.grow(domain.face_count() / 2, faces * FACE_AREA_MM2)?;
        let contact: Vec<ContactNode> = patch
            .nodes
            .iter()
            .map(|node| ContactNode {
                node: *node,
                displacement: patch.inward.map(|v| (12.0 * v) as f32),
            })
            .collect();
        let run = |pressure| settle(brain, &contact, soft(20.0), pressure, 30);
        let (nodal, nodal_force, nodal_time) = run(Pressure::AverageNodal)?;
        let (element, element_force, element_time) = run(Pressure::Element)?;
        let total = |forces: &[[f32; 3]]| -> f64 {
            let sum = [0, 1, 2].map(|k| forces.iter().map(|f| f64::from(f[k])).sum::<f64>());
            sum.iter().map(|v| v * v).sum::<f64>().sqrt()
        };
        table += &format!(
            "| 12 mm on {faces} faces, K = {} | average nodal | {:.0} | | {:.2} |\n| | element | {:.0} ({:+.0} %) | {:.1} % | 1 |\n",
            brain.node_count(),
            total(&nodal_force),
            nodal_time / element_time,
            total(&element_force),
            100.0 * (total(&element_force) / total(&nodal_force) - 1.0),
            100.0 * relative_l2(&nodal, &element),
        );
    }
    Ok(table)
}

/// A push of 12 mm in ten frames, an abrupt release, a second of free motion: with longer steps against 0.1 ms.
fn mass_scaling(coarse: &Mesh, fine: &Mesh) -> Outcome<String> {
    let mut table = String::from(
        "| mesh | inner step, ms | shortest element step, ms | mass added | MSE pushed / released, mm² | largest error, mm | times faster |\n|---|---|---|---|---|---|---|\n",
    );
    for (brain, settings) in [
        (coarse, [(0.19, 0.0), (0.28, 0.25), (0.38, 0.35)]),
        (fine, [(0.16, 0.15), (0.19, 0.2), (0.23, 0.25)]),
    ] {
        let (reference, _, reference_time) = push_and_release(brain, 0.1, 0.0)?;
        for (step, scaling) in settings {
            let (found, added, time) = push_and_release(brain, step, scaling)?;
            let error = |frames: std::ops::Range<usize>| -> (f64, f64) {
                let (mut square, mut largest) = (0.0, 0.0f64);
                let count = (frames.len() * brain.node_count()) as f64;
                for (a, b) in reference[frames.clone()].iter().zip(&found[frames]) {
                    for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
                        let d = f64::from(x - y);
                        square += d * d;
                        largest = largest.max(d.abs());
                    }
                }
                (square / count, largest)
            };
            let (pushed, released) = (error(0..PUSH_FRAMES), error(PUSH_FRAMES..reference.len()));
            table += &format!(
                "| K = {} | {step} | {} | {:.2} % | {:.1e} / {:.1e} | {:.2} | {:.1} |\n",
                brain.node_count(),
                if scaling > 0.0 {
                    scaling.to_string()
                } else {
                    "none".into()
                },
                100.0 * added,
                pushed.0,
                released.0,
                pushed.1.max(released.1),
                reference_time / time,
            );
        }
    }
    Ok(table)
}

const PUSH_FRAMES: usize = 10;

/// Displacement of each frame, added mass, seconds.
fn push_and_release(
    mesh: &Mesh,
    step_ms: f64,
    scaling_ms: f64,
) -> Outcome<(Vec<Vectors>, f64, f64)> {
    let domain = ContactDomain::new(mesh, Boundary::Fixed)?;
    let patch = domain.grow(domain.face_count() / 2, 60.0 * FACE_AREA_MM2)?;
    let options = SolverOptions {
        inner_step_s: step_ms * 1e-3,
        mass_scaling_s: scaling_ms * 1e-3,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(mesh, Boundary::Fixed, options)?;
    let start = std::time::Instant::now();
    let mut frames = Vec::new();
    for frame in 1..=PUSH_FRAMES + 20 {
        let length = 1.2 * frame as f64;
        let contact: Vec<ContactNode> = patch
            .nodes
            .iter()
            .filter(|_| frame <= PUSH_FRAMES)
            .map(|node| ContactNode {
                node: *node,
                displacement: patch.inward.map(|v| (length * v) as f32),
            })
            .collect();
        solver.step_frame(&contact, 0.05)?;
        let mut u = vec![[0.0; 3]; mesh.node_count()];
        solver.displacement(&mut u);
        frames.push(u);
    }
    Ok((frames, solver.added_mass(), start.elapsed().as_secs_f64()))
}
