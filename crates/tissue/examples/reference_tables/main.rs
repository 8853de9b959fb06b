//! Writes tables of docs/results/solver.md:
//! `python tests/docs/results.py run solver -- cargo run --release -p tissue --example reference_tables`, which makes the page that it looks for.
//!
//! The tables are `verification`, `laws`, `locking` and `scaling`; all where none is named. The text between `<!-- TABLE -->`
//! and the next `<!-- end -->` is replaced.

mod verification;

use elements::{ElementForces, Isa, Law, MooneyRivlin, Ogden};
use std::error::Error;
use std::path::Path;
use tissue::contact::{ContactDomain, FACE_AREA_MM2};
use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh};
use tissue::metrics::relative_l2;
use tissue::solver::{ContactNode, Pressure, Solver, SolverOptions};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// `[K,3]` mm or mN.
type Vectors = Vec<[f32; 3]>;

fn main() -> Outcome<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = root.join("target/results/solver.md");
    let mut text = std::fs::read_to_string(&page)?;
    let brain = Mesh::read(&root.join("onnx/meshes/brain-coarse.mesh.safetensors"))?;
    let fine = Mesh::read(&root.join("onnx/meshes/brain.mesh.safetensors"))?;
    let asked: Vec<String> = std::env::args().skip(1).collect();
    for marker in ["verification", "laws", "locking", "scaling"] {
        if !asked.is_empty() && !asked.iter().any(|name| name == marker) {
            continue;
        }
        let table = match marker {
            "verification" => verification::table(&brain)?,
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

/// What each law costs: the forces of a mesh by one thread, the laws in turn, medians.
fn laws(mesh: &Mesh) -> Outcome<String> {
    const ROUNDS: usize = 200;
    let ogden = |terms: &[[f64; 2]]| Ogden::new(terms).map(Law::Ogden).ok_or("too many terms");
    // Cortex with an even exponent, and with the exponent that fits best.
    let all = [
        Law::default(),
        Law::MooneyRivlin(MooneyRivlin::default()),
        ogden(&[[-163.0, -18.0]])?,
        ogden(&[[-157.0, -18.7]])?,
    ];
    let count = mesh.node_count();
    let mut table = format!(
        "| law | instruction set | forces of {count} nodes, {} tetrahedra, ms | over neo-Hookean |\n|---|---|---|---|\n",
        mesh.tets.len()
    );
    let u: Vec<f32> = (mesh.positions.iter().flatten())
        .map(|x| 0.5 * (0.1 * x).sin())
        .collect();
    for isa in Isa::available().into_iter().rev() {
        let bodies = all.map(|law| {
            let material = Material::default().with_law(law);
            ElementForces::new(mesh.tetrahedra(), &material, isa).expect("memory for a body")
        });
        let mut scratch = bodies[0].scratch(1)?;
        let mut out = vec![0.0; u.len()];
        let mut times = all.map(|_| Vec::new());
        for _ in 0..ROUNDS {
            for (body, times) in bodies.iter().zip(&mut times) {
                let start = std::time::Instant::now();
                body.evaluate(&u, &mut scratch, &mut out, &|count, task| {
                    (0..count).for_each(|chunk| task(chunk, 0));
                });
                times.push(1e3 * start.elapsed().as_secs_f64());
            }
        }
        let medians = times.map(gauge::median);
        for (law, median) in all.iter().zip(medians) {
            table += &format!(
                "| {law:.3} | {isa:?} | {median:.3} | {:.2} |\n",
                median / medians[0]
            );
        }
    }
    Ok(table)
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
