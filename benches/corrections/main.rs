//! What corrections cost: whole steps under a tool, and their parts compared with the floor of their bytes and FLOP.
//!
//! `cargo bench --bench corrections` runs every bundle in `onnx/` that has corrections; `cargo bench --bench corrections -- brain-reduced`
//! those with that name. The error of a step is the relative L2 difference of its field from that of 40 corrections from the same
//! path.

#[path = "../measure/mod.rs"]
mod measure;
mod parts;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use contact::{Shape, Vector};
use gauge::median;
use measure::{Row, relative_l2};
use upt::contact::Tool;
use upt::{Contact, Corrections, Model, ModelOptions, Scene, SceneOptions, StepInput};

fn main() {
    measure::init_library();
    for bundle in measure::bundles() {
        let name = bundle.file_name().unwrap_or_default().to_string_lossy();
        if !measure::wanted(&name) {
            continue;
        }
        if let Err(error) = run(&bundle) {
            eprintln!("{}: {error}", bundle.display());
            std::process::exit(1);
        }
    }
}

fn run(path: &Path) -> upt::Result<()> {
    let model = Model::open(path, &ModelOptions::default())?;
    if model.manifest.corrections.is_none() {
        return Ok(());
    }
    let name = model.manifest.name.clone();
    println!("{name}: K = {}", model.info().node_count);
    steps(&model, &name)?;
    parts::rows(&model, &name)
}

/// What a path of steps came to.
struct Taken {
    /// ms of each step in which a tool pushes, of the corrections in it, and of finding and solving contact.
    step: Vec<f64>,
    corrections: Vec<f64>,
    contact: Vec<f64>,
    fields: Vec<Vec<f32>>,
}

/// A capsule that is pressed 6 mm into the middle of the domain in a second, slides 10 mm and is lifted.
fn tools(model: &Model) -> upt::Result<Vec<Tool>> {
    let mesh = &model.mesh;
    let domain = &mesh.domain.nodes;
    let place = |node: u32| Vector::from(mesh.position(node));
    let mean = domain.iter().map(|&node| place(node)).sum::<Vector>() / domain.len() as f32;
    let centre = mesh
        .positions
        .as_chunks::<3>()
        .0
        .iter()
        .map(|p| Vector::from(*p));
    let centre = centre.sum::<Vector>() / mesh.node_count() as f32;
    let out = (mean - centre).normalize();
    // The top of what lies under the tool.
    let aside = |p: Vector| (p - mean) - out * (p - mean).dot(out);
    let under = domain.iter().map(|&node| place(node));
    let under = under.filter(|p| aside(*p).length() < 6.0);
    let top = under.map(|p| p.dot(out)).fold(f32::MIN, f32::max);
    let foot = mean + out * (top - mean.dot(out));
    let across = contact::friction::frame(out).y_axis;
    let rotation = contact::Rotation::from_rotation_arc(Vector::Y, out).to_array();
    (0..60)
        .map(|t| {
            let depth =
                6.0 * (t as f32 / 20.0).min(1.0) - 6.0 * ((t as f32 - 45.0) / 10.0).max(0.0);
            let way = 10.0 * ((t as f32 - 20.0) / 25.0).clamp(0.0, 1.0);
            let at = foot + out * (26.0 - depth) + across * way;
            let shape = Shape::Capsule {
                half_length: 20.0,
                radius: 6.0,
            };
            let mut tool = Tool::new(&shape, at.to_array(), rotation)?;
            tool.friction = 0.2;
            Ok(tool)
        })
        .collect()
}

fn take(model: &Arc<Model>, way: &[Tool], k: u32, threads: usize) -> upt::Result<Taken> {
    let options = SceneOptions {
        threads,
        sleep: false,
        corrections: Corrections::Fixed(k),
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(model), &options)?;
    let mut taken = Taken {
        step: Vec::new(),
        corrections: Vec::new(),
        contact: Vec::new(),
        fields: Vec::new(),
    };
    let mut field = vec![0.0; 3 * model.mesh.node_count()];
    for tool in way {
        let start = Instant::now();
        scene.step(
            StepInput::from(Contact::Tools(std::slice::from_ref(tool))),
            Some(&mut field),
        )?;
        let ms = 1e3 * start.elapsed().as_secs_f64();
        if scene.stats().corrections > 0 {
            let timing = scene.timing();
            taken.step.push(ms);
            taken.corrections.push(timing.corrections_ms);
            taken.contact.push(timing.contact_ms);
        }
        taken.fields.push(field.clone());
    }
    Ok(taken)
}

fn steps(model: &Arc<Model>, name: &str) -> upt::Result<()> {
    let way = tools(model)?;
    let exact = take(model, &way, 40, 2)?;
    let brain = name == "brain-reduced";
    for k in [1, 3, 5] {
        for threads in [1, 2] {
            // The better of three runs of the path: what other programs take is not the step's.
            let mut best: Option<(f64, Taken)> = None;
            for _ in 0..3 {
                let taken = take(model, &way, k, threads)?;
                let ms = median(&taken.step);
                if best.as_ref().is_none_or(|(least, _)| ms < *least) {
                    best = Some((ms, taken));
                }
            }
            let Some((ms, taken)) = best else {
                continue;
            };
            let error = relative_l2(&taken.fields.concat(), &exact.fields.concat());
            let (bar, goal) = match (brain, k, threads) {
                (true, 3, 2) => (Some(6.0), Some(3.0)),
                (true, 3, 1) => (Some(9.0), Some(5.0)),
                (true, 5, 2) => (Some(12.0), Some(5.0)),
                _ => (None, None),
            };
            println!(
                "k = {k}, {threads} threads: {} steps under the tool",
                taken.step.len()
            );
            let title = format!("{name}/step under a tool/k = {k}/{threads} threads");
            Row::new(title.clone(), ms, "ms")
                .error(error)
                .limits(bar, goal)
                .print();
            let contact = median(&taken.contact);
            Row::new(format!("{title}/contact in it"), contact, "ms").print();
            let rest = ms - median(&taken.corrections);
            Row::new(format!("{title}/outside of the corrections"), rest, "ms").print();
        }
    }
    Ok(())
}
