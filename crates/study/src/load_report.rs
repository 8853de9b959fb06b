//! `upt-study report --load`: gravity that turns, a pulse, a lost pressure, a support that breathes, through the library and the reference solver, with a tool and without.
//!
//! Both get the same loads, step by step from their own last state. A moving support is compared in its own frame, in which the library has all. The solver runs here: a case of loads is seconds of tissue.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use contact::{Body, Pose, Vector, pose};
use serde::Serialize;
use tissue::load_programmes::LoadProgramme;
use tissue::mesh::{Boundary, Mesh};
use tissue::simulate::{ToolOrder, simulate_loads, simulate_tools};
use tissue::solver::{SolverOptions, SupportMotion};
use tissue::trajectory::Trajectory;
use upt::{
    Contact, Corrections, Loads, Model, ModelOptions, Pressure, Scene, SceneOptions, StepInput,
    SupportPose, Tool,
};

use crate::quantile::median;
use crate::report::options::Options;
use crate::table::{Column, Table, or_dash};
use upt_cli::bundle_folder::BundleFolder;
use upt_cli::effort::Effort;
use upt_cli::marks::replace_between;
use upt_cli::tool_scale;

/// A programme by a bundle: of several cases the medians, the worst, and how far any of them goes.
#[derive(Clone, Serialize)]
struct Row {
    bundle: String,
    load: &'static str,
    tool: &'static str,
    cases: usize,
    corrections: String,
    /// How far the solver's tissue goes in the support's frame, mm.
    farthest_mm: f64,
    /// Over the frames, mm².
    mse: f64,
    worst_mse: f64,
    /// What forces on the tools are off by, over what they are; none without a tool.
    force_error: Option<f64>,
    worst_force_error: Option<f64>,
    smallest_det: f64,
    /// Median, ms.
    step_ms: f64,
}

/// Measures and prints the table.
pub fn report(asked: &Options) -> Result<ExitCode> {
    if asked.bundles.is_empty() {
        bail!("name the bundles to measure with --bundle");
    }
    let mut rows = Vec::new();
    for path in &asked.bundles {
        let bundle = BundleFolder::read(path)?;
        let mesh = Mesh::read(&bundle.mesh_file)?;
        let boundary: Boundary = bundle.boundary.parse().map_err(anyhow::Error::msg)?;
        let options = ModelOptions::default();
        let model = Model::open(path, &options).with_context(|| path.display().to_string())?;
        for programme in &asked.load {
            eprintln!("{}: {}", bundle.name, programme.name());
            let seeds = asked.seed..asked.seed + if asked.tool.is_some() { asked.seeds } else { 1 };
            let truths: Vec<Trajectory> = seeds
                .map(|seed| truth(asked, (*programme, seed), &mesh, boundary, &model))
                .collect::<Result<_>>()?;
            let recommended = bundle.corrections.unwrap_or(Effort::NONE);
            let efforts = match asked.corrections.as_slice() {
                [] => &[recommended],
                efforts => efforts,
            };
            for effort in efforts {
                let case = |truth| measure(asked, (*programme, *effort), &bundle, &model, truth);
                let cases: Vec<Row> = truths.iter().map(case).collect::<Result<_>>()?;
                rows.push(joined(&cases)?);
            }
        }
    }
    let table = Table::of(&[0, 1, 2], &COLUMNS, &rows).markdown();
    if asked.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
    } else {
        print!("{table}");
    }
    for page in &asked.markdown {
        replace_between(page, "study report --load", &format!("\n{table}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// One row of several cases.
fn joined(cases: &[Row]) -> Result<Row> {
    let first = cases.first().context("no case")?;
    let medians = |value: fn(&Row) -> f64| median(cases.iter().map(value));
    let largest = |value: fn(&Row) -> f64| cases.iter().map(value).fold(0.0, f64::max);
    let force = |row: &Row| row.force_error.unwrap_or(0.0);
    let has_force = cases.iter().any(|row| row.force_error.is_some());
    Ok(Row {
        cases: cases.len(),
        farthest_mm: largest(|row| row.farthest_mm),
        mse: medians(|row| row.mse),
        worst_mse: largest(|row| row.worst_mse),
        force_error: has_force.then(|| medians(force)),
        worst_force_error: has_force.then(|| largest(force)),
        smallest_det: cases.iter().map(|row| row.smallest_det).fold(1.0, f64::min),
        step_ms: medians(|row| row.step_ms),
        ..first.clone()
    })
}

/// The reference solver's answer, with the bundle's material.
fn truth(
    asked: &Options,
    (programme, seed): (LoadProgramme, u64),
    mesh: &Mesh,
    boundary: Boundary,
    model: &Model,
) -> Result<Trajectory> {
    let options = SolverOptions {
        material: model.manifest.material,
        threads: asked.most_threads() as usize,
        ..SolverOptions::default()
    };
    let load = (programme, asked.load_sizes.sizes());
    let case = match asked.tool {
        None => simulate_loads(mesh, boundary, load, &options, |_, _| {}),
        Some(tool) => {
            let order = ToolOrder {
                load: Some(load),
                scale: tool_scale::Chosen::of(tool_scale::Arguments::default(), mesh, None).scale,
                ..ToolOrder::new(tool, seed)
            };
            simulate_tools(mesh, boundary, order, &options, |_, _| {})
        }
    };
    Ok(case?)
}

fn measure(
    asked: &Options,
    (programme, effort): (LoadProgramme, Effort),
    bundle: &BundleFolder,
    model: &Arc<Model>,
    truth: &Trajectory,
) -> Result<Row> {
    let options = SceneOptions {
        threads: asked.most_threads() as usize,
        corrections: match (effort.most, effort.target_mm) {
            (0, _) => bail!("loads act in corrections; give --corrections at least 1"),
            (most, 0.0) => Corrections::Fixed(most),
            (most, target_mm) => Corrections::Auto {
                most,
                target_mm,
                budget_us: 0,
            },
        },
        substeps: effort.substeps,
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(model), &options)?;
    let (nodes, mut u) = (scene.node_count(), vec![0.0; 3 * scene.node_count()]);
    let mut tools = tools(truth)?;
    let (mut errors, mut times) = (Vec::new(), Vec::new());
    let (mut off, mut felt, mut smallest_det, mut farthest) = (0.0, 0.0, 1.0f64, 0.0f64);
    if let Some(start) = programme.support_at(0.0) {
        // From here on the scene knows how fast it goes.
        let loads = Loads {
            support: Some(support_pose(start)),
            ..Loads::default()
        };
        let input = StepInput {
            loads,
            ..StepInput::default()
        };
        scene.step(input, None)?;
    }
    for step in 1..truth.frame_count() {
        let time_s = step as f64 * truth.header.dt_s;
        let (gravity, pascal) = programme.at(asked.load_sizes.sizes(), time_s);
        let support = programme.support_at(time_s).map(support_pose);
        let frame = (support.as_ref())
            .map(|support| pose::checked(support.position, support.rotation))
            .transpose()?;
        if let Some(tracks) = &truth.tools {
            for (tool, at) in tools.iter_mut().zip(tracks.frame(step)) {
                tool.pose = frame.map_or(at.pose, |frame| frame.inverse() * at.pose);
            }
        }
        let pressures = [Pressure {
            nodes: &[],
            pascal: pascal as f32,
        }];
        let input = StepInput {
            contact: match tools.is_empty() {
                true => Contact::None,
                false => Contact::Tools(&tools),
            },
            loads: Loads {
                gravity: gravity.map(|g| g as f32),
                pressures: &pressures,
                support,
                ..Loads::default()
            },
            ..StepInput::default()
        };
        let start = Instant::now();
        scene.step(input, Some(&mut u))?;
        times.push(1e3 * start.elapsed().as_secs_f64());
        let mut squares = 0.0;
        let rows = model.positions().as_chunks::<3>().0.iter();
        for ((rest, u), wanted) in rows.zip(u.as_chunks::<3>().0).zip(truth.frame(step)) {
            let wanted = in_frame(frame.as_ref(), *rest, *wanted);
            let pairs = u.iter().zip(wanted);
            squares += pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            let square: f32 = wanted.iter().map(|v| v * v).sum();
            farthest = farthest.max(f64::from(square));
        }
        errors.push(squares / nodes as f64);
        let det = f64::from(scene.stats().min_det);
        // 0 where nothing was corrected.
        if det != 0.0 {
            smallest_det = smallest_det.min(det);
        }
        if let Some(tracks) = &truth.tools {
            let readings = scene.with_contact_report(|report| {
                let forces = report.readings.iter().map(|reading| reading.force);
                forces.collect::<Vec<_>>()
            });
            let wrenches = &tracks.wrenches[step * tools.len()..];
            for (force, wanted) in readings.iter().zip(wrenches) {
                let size = |v: [f32; 3]| v.iter().map(|x| f64::from(x * x)).sum::<f64>().sqrt();
                let wanted = [wanted[0], wanted[1], wanted[2]];
                let turned = |frame: &Pose| frame.rotation.inverse() * Vector::from(wanted);
                let wanted = frame
                    .as_ref()
                    .map_or(wanted, |frame| turned(frame).to_array());
                felt += size(wanted);
                off += size(std::array::from_fn(|k| force[k] - wanted[k]));
            }
        }
    }
    Ok(Row {
        bundle: bundle.name.clone(),
        load: programme.name(),
        tool: asked.tool.map_or("none", |tool| tool.name()),
        cases: 1,
        corrections: effort.to_string(),
        farthest_mm: farthest.sqrt(),
        mse: median(errors.iter().copied()),
        worst_mse: errors.iter().copied().fold(0.0, f64::max),
        force_error: (felt > 0.0).then(|| off / felt),
        worst_force_error: None,
        smallest_det,
        step_ms: median(times),
    })
}

/// The pose of a support from its rotation vector.
fn support_pose(motion: SupportMotion) -> SupportPose {
    let angle = motion.turn.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (sine, cosine) = (0.5 * angle).sin_cos();
    let part = if angle > 0.0 { sine / angle } else { 0.5 };
    let [x, y, z] = motion.turn.map(|v| (part * v) as f32);
    SupportPose {
        position: motion.position.map(|v| v as f32),
        rotation: [x, y, z, cosine as f32],
    }
}

/// A displacement of the world in the support's frame.
fn in_frame(frame: Option<&Pose>, rest: [f32; 3], u: [f32; 3]) -> [f32; 3] {
    let Some(frame) = frame else {
        return u;
    };
    let (rest, u) = (Vector::from(rest), Vector::from(u));
    (frame.rotation.inverse() * (rest + u - frame.translation) - rest).to_array()
}

fn tools(truth: &Trajectory) -> Result<Vec<Tool>> {
    let Some(tracks) = &truth.tools else {
        return Ok(Vec::new());
    };
    let poses = tracks.frame(0);
    let made = tracks.tools.iter().zip(poses).map(|(tool, at)| {
        let body = Body::new(&tool.shape)?;
        let position = at.pose.translation.to_array();
        let mut made = Tool::of_body(body, position, at.pose.rotation.to_array())?;
        made.friction = tool.friction;
        anyhow::Ok(made)
    });
    made.collect()
}

const COLUMNS: [Column<Row>; 12] = [
    ("bundle", |row| format!("`{}`", row.bundle)),
    ("load", |row| row.load.into()),
    ("tool", |row| row.tool.into()),
    ("cases", |row| row.cases.to_string()),
    ("k", |row| row.corrections.clone()),
    ("farthest, mm", |row| format!("{:.2}", row.farthest_mm)),
    ("MSE, mm² (median)", |row| format!("{:.2e}", row.mse)),
    ("worst", |row| format!("{:.2e}", row.worst_mse)),
    ("force error (median)", |row| {
        or_dash(row.force_error, |error| format!("{:.1} %", 100.0 * error))
    }),
    ("worst force error", |row| {
        or_dash(row.worst_force_error, |error| {
            format!("{:.1} %", 100.0 * error)
        })
    }),
    ("smallest det F", |row| format!("{:.2}", row.smallest_det)),
    ("ms a step", |row| format!("{:.1}", row.step_ms)),
];
