//! Loads a bundle, pushes one site of its domain for 6 s, lets go for 2 s, and prints what a step costs.
//!
//! `cargo run --release --example push -- BUNDLE [STEPS]`; lengths are mm, a step is 50 ms.

use std::error::Error;
use std::path::Path;

use upt::{Contact, IndexSet, Model, ModelOptions, Scene, SceneOptions, StepInput};

const PUSH_MM: f32 = 8.0;
const PATCH_RADIUS_MM: f32 = 8.0;
const PUSH_SECONDS: f32 = 6.0;

fn point(values: &[f32], node: u32) -> [f32; 3] {
    let start = 3 * node as usize;
    [values[start], values[start + 1], values[start + 2]]
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn length(a: [f32; 3]) -> f32 {
    a.iter().map(|x| x * x).sum::<f32>().sqrt()
}

/// Unit normal of the domain's faces around `seed`.
fn normal(positions: &[f32], faces: &[u32], seed: [f32; 3]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for face in faces.chunks_exact(3) {
        let corner = point(positions, face[0]);
        if length(minus(corner, seed)) > PATCH_RADIUS_MM {
            continue;
        }
        let a = minus(point(positions, face[1]), corner);
        let b = minus(point(positions, face[2]), corner);
        for (axis, total) in sum.iter_mut().enumerate() {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            *total += a[next] * b[last] - a[last] * b[next];
        }
    }
    let size = length(sum).max(f32::MIN_POSITIVE);
    sum.map(|x| x / size)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let bundle = arguments.next().ok_or("usage: push BUNDLE [STEPS]")?;
    let steps: usize = arguments.next().map_or(Ok(160), |text| text.parse())?;

    let model = Model::open(Path::new(&bundle), &ModelOptions::default())?;
    let info = model.info();
    let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    println!(
        "{:?} bundle, K = {}, opened in {:.0} ms",
        info.kind,
        info.node_count,
        1e3 * info.load_seconds
    );

    let positions = model.positions();
    let domain = model.indices(IndexSet::DomainNodes);
    let middle = *domain
        .get(domain.len() / 2)
        .ok_or("the mesh has no domain")?;
    let seed = point(positions, middle);
    let near = |node: &u32| length(minus(point(positions, *node), seed)) <= PATCH_RADIUS_MM;
    let patch: Vec<u32> = domain.iter().copied().filter(near).collect();
    let outward = normal(positions, model.indices(IndexSet::DomainFaces), seed);
    println!("site: {} nodes around {seed:?} mm", patch.len());

    let mut displacement = vec![0.0; 3 * info.node_count as usize];
    let mut times = Vec::with_capacity(steps);
    let mut largest: f32 = 0.0;
    for step in 1..=steps {
        let time = step as f32 * info.dt;
        let push = PUSH_MM * (std::f32::consts::PI * time / PUSH_SECONDS).sin().powi(2);
        let vectors: Vec<f32> = patch
            .iter()
            .flat_map(|_| outward.map(|x| -push * x))
            .collect();
        let contact = match time < PUSH_SECONDS {
            true => Contact::Sparse {
                nodes: &patch,
                vectors: &vectors,
            },
            false => Contact::None,
        };
        let input = StepInput::from(contact);
        scene.step(input, Some(&mut displacement))?;
        times.push(scene.timing().step_ms);
        largest = largest.max(scene.stats().max_displacement_mm);
    }
    times.sort_by(f64::total_cmp);
    println!(
        "{steps} steps of {:.0} ms: median {:.2} ms, largest {:.2} ms; largest displacement {largest:.2} mm",
        1e3 * info.dt,
        times[steps / 2],
        times[steps - 1]
    );
    Ok(())
}
